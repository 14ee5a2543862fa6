"""Fibres, or the main direction of a fabric, in the paper's energy: stiffer along a direction that may vary."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import ufl

from growthx.common.arrays import Field, is_uniform
from growthx.common.checks import is_function, require, require_number
from growthx.common.communicators import steady
from growthx.common.errors import InputError, raise_on_all, shown
from growthx.constitutive.elastic.base import ByModuli
from growthx.constitutive.elastic.invariants import Invariants, green_strain
from growthx.constitutive.material import neo_hooke

AXES = ("fibre_x", "fibre_y", "fibre_z")


@dataclass(frozen=True)
class FibredNeoHooke(ByModuli, replaceable=()):
    """The paper's energy and ½ k E_a², with Green's strain E_a = ½ [λ_a² − 1] along a direction a at rest.

    Transversely isotropic: the standard reinforcing model (Qiu & Pence 1997; Merodio & Ogden 2003), E_a² = ¼ [I₄ − 1]².
    Fibres bear tension and compression alike; it is not elliptic where they are much compressed.
    fibre: k (stress), what a fibre adds to the modulus along it at small strains, a number or a field, at least 0.
    fibre_x, fibre_y, fibre_z: components of a direction of any length but zero (no unit), numbers or fields; see
    `along` for one field of directions.  In a plane body fibres lie in its plane.  Other parameters: see `ByModuli`.

    Example:
        >>> bone = gx.FibredNeoHooke(young=500.0, fibre=1000.0, fibre_x=0.0, fibre_y=1.0)
        >>> [f"{bone.principal_energy(along):.2f}" for along in ((0.1, 0.0, 0.0), (0.0, 0.1, 0.0))]
        ['2.65', '8.16']
    """

    fibre: Field = 1.0
    fibre_x: Field = 1.0
    fibre_y: Field = 0.0
    fibre_z: Field = 0.0

    coefficients: ClassVar[tuple[str, ...]] = (*ByModuli.coefficients, "fibre", *AXES)
    directions: ClassVar[tuple[str, ...]] = AXES
    across: ClassVar[tuple[str, ...]] = AXES[2:]

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.fibre, "the modulus k of fibres", "a number of at least 0", lambda k: k >= 0)
        for name in AXES:
            require(getattr(self, name), f"the component {name} of the fibres", "a finite number", lambda _: True)
        _check_length([getattr(self, name) for name in AXES])

    @classmethod
    def along(cls, direction: Any, young: Field, **parameters: Any) -> FibredNeoHooke:
        """The same by a field of directions.

        direction: an angle in degrees from x towards y; a vector of numbers; a function of x, shape (3, points), to
        vectors, (dim, points); an array of a vector for each cell, (cells, dim); or any of these for each region.
        """
        return cls(young, **parameters, **dict(zip(AXES, _components(direction), strict=True)))

    def energy_of(self, invariants: Invariants) -> Any:
        """Without the fibres, whose direction invariants do not know."""
        return neo_hooke(self.lame, invariants.shape, invariants.volume)

    def energy_at(self, H: Any) -> Any:
        """Ψ₀ᵉˡ as a UFL expression of the displacement gradient H = ∇u."""
        a = ufl.as_vector([getattr(self, name) for name in AXES[: H.ufl_shape[0]]])
        along = ufl.dot(a, green_strain(H) * a) / ufl.dot(a, a)
        return super().energy_at(H) + self.fibre / 2 * along * along

    def principal_energy(self, extensions: tuple[Any, Any, Any]) -> Any:
        """Ψ₀ᵉˡ at principal stretches less one along x, y and z, for parameters that are numbers."""
        parts = [getattr(self, name) for name in AXES]
        strains = [extension * (2 + extension) / 2 for extension in extensions]
        along = sum(a * a * strain for a, strain in zip(parts, strains, strict=True)) / sum(a * a for a in parts)
        return super().principal_energy(extensions) + self.fibre / 2 * along * along


def _check_length(parts: list[Any]) -> None:
    """Refuse fibres of zero length, of numbers, or of one value per cell (collective)."""
    problem = ""
    if all(map(is_uniform, parts)):
        if not any(parts):
            problem = f"the direction of the fibres is {tuple(parts)}: a vector that is not zero would be right"
    elif fields := [part for part in parts if hasattr(part, "function_space")]:
        values = [part.x.array if hasattr(part, "function_space") else getattr(part, "value", part) for part in parts]
        if len({len(field.x.array) for field in fields}) == 1 and np.any(sum(np.square(each) for each in values) == 0):
            problem = "the direction of the fibres is zero somewhere: vectors that are not zero would be right"
        raise_on_all(steady(fields[0].function_space.mesh.comm), problem)
    if problem:
        raise InputError(problem)


def _components(direction: Any) -> list[Field]:
    """The three components of a field of directions, each a field."""
    if isinstance(direction, Mapping):
        parts = {name: _components(part) for name, part in direction.items()}
        return [{name: part[i] for name, part in parts.items()} for i in range(3)]
    if is_uniform(direction) and not isinstance(direction, (str, bytes)):
        require_number(direction, "the angle of the fibres", "a number of degrees", lambda _: True)
        return [float(np.cos(np.radians(direction))), float(np.sin(np.radians(direction))), 0.0]
    if is_function(direction):
        return [_component(direction, i) for i in range(3)]
    try:
        values = np.asarray(direction, dtype=float)
    except (TypeError, ValueError):
        values = np.empty(0)
    if values.ndim == 0 or values.ndim > 2 or values.shape[-1] not in (2, 3):
        raise InputError(
            f"the direction of the fibres is {shown(direction)}: an angle in degrees, a vector, a function of x or a "
            "vector for each cell, of 2 or 3 numbers each, would be right"
        )
    wide = np.concatenate([values, np.zeros((*values.shape[:-1], 3 - values.shape[-1]))], axis=-1)
    return [float(part) for part in wide] if wide.ndim == 1 else [np.ascontiguousarray(part) for part in wide.T]


def _component(direction: Callable[[Any], Any], number: int) -> Callable[[Any], Any]:
    def component(x: Any) -> Any:
        vectors = np.asarray(direction(x), dtype=float)
        if vectors.ndim not in (1, 2) or len(vectors) not in (2, 3):
            raise InputError(
                f"the direction of the fibres has values of shape {vectors.shape} for {x.shape[1]} points: a row for "
                "each of 2 or 3 components would be right"
            )
        return vectors[number] if number < len(vectors) else 0.0

    return component
