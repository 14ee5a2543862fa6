"""Springs under a boundary: what a body rests on or is tied to, there from the start of a run and not ramped."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import ufl

from growthx.common.checks import require_name, require_number, require_vector
from growthx.common.errors import InputError
from growthx.common.renamed import renamed_fields
from growthx.model.actions.faces import Face
from growthx.model.open_loads import OpenLoad

if TYPE_CHECKING:
    from growthx.meshing.mesh import Mesh


class _Elastic(OpenLoad, replaceable=()):
    """A reaction to the displacement of a boundary from where it is at rest."""

    on: str

    ramped = False
    what = "spring"

    @property
    def may_hold(self) -> bool:  # type: ignore[override]
        """Whether it resists any motion."""
        return bool(self.holds)


@renamed_fields(normal="normal_stiffness", tangential="tangential_stiffness")
@dataclass(frozen=True)
class Foundation(_Elastic, replaceable=()):
    """An elastic foundation (Winkler's) under a named boundary, t = −[k N⊗N + k_t (I − N⊗N)] u, N normal at rest.

    normal_stiffness, tangential_stiffness: k and k_t, force per area and displacement.  It pulls, too.

    Example:
        >>> gx.Foundation("bottom", normal_stiffness=2.0).holds
        'normal'
        >>> gx.Foundation("bottom", normal_stiffness=2.0, tangential_stiffness=1.0).holds
        'all'
    """

    on: str
    normal_stiffness: float
    tangential_stiffness: float = 0.0

    def __post_init__(self) -> None:
        require_name(self.on, "the boundary of a foundation")
        for value, what in ((self.normal_stiffness, "normal"), (self.tangential_stiffness, "tangential")):
            wanted = "a number of at least 0"
            require_number(value, f"the {what} stiffness of the foundation of '{self.on}'", wanted, lambda k: k >= 0)

    @property
    def holds(self) -> tuple[int, ...] | str:
        """Along what it resists: any direction, or the normal alone."""
        if self.tangential_stiffness > 0:
            return "all" if self.normal_stiffness > 0 else ()
        return "normal" if self.normal_stiffness > 0 else ()

    def force(self, u: Any, rho: Any, mesh: Mesh) -> Any:
        """Force per reference area."""
        N = ufl.FacetNormal(mesh.domain)
        along = self.tangential_stiffness
        return -along * u - (self.normal_stiffness - along) * ufl.dot(u, N) * N


@dataclass(frozen=True)
class Spring(_Elastic, replaceable=()):
    """A spring at a named boundary, spread evenly over it: moved as a whole by u, it is pulled back by −k u.

    stiffness: k, force per displacement of the whole boundary (per thickness in two dimensions), a number or one for
        each direction.

    Example:
        >>> held = gx.Spring("right", stiffness=(0.1, 0.0))  # along x alone
        >>> held.holds
        (0,)
    """

    on: str
    stiffness: float | tuple[float, ...]

    def __post_init__(self) -> None:
        require_name(self.on, "the boundary of a spring")
        what, wanted = (
            f"the stiffness of the spring on '{self.on}'",
            "a number of at least 0, or one for each direction,",
        )
        if isinstance(self.stiffness, (tuple, list)):
            object.__setattr__(self, "stiffness", require_vector(self.stiffness, what))
        for value in self.stiffness if isinstance(self.stiffness, tuple) else (self.stiffness,):
            require_number(value, what, wanted, lambda k: k >= 0)

    @property
    def holds(self) -> tuple[int, ...] | str:
        """Along what it resists: the directions in which it is stiff."""
        if isinstance(self.stiffness, tuple):
            return tuple(i for i, k in enumerate(self.stiffness) if k > 0)
        return "all" if self.stiffness > 0 else ()

    def force(self, u: Any, rho: Any, mesh: Mesh) -> Any:
        """Force per reference area."""
        stiffness = self.stiffness if isinstance(self.stiffness, tuple) else (self.stiffness,) * mesh.dim
        if len(stiffness) != mesh.dim:
            raise InputError(
                f"the stiffness of the spring on '{self.on}' has {len(stiffness)} entries: the mesh needs {mesh.dim}"
            )
        area = Face.of(mesh, self.on).area
        return ufl.as_vector([-k / area * u[i] for i, k in enumerate(stiffness)])
