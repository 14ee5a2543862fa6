"""How a load is shown in pictures: an arrow for its force, where it acts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import dolfinx
import numpy as np

from growthx.common.checks import require_name, require_vector

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices
    from growthx.meshing.mesh import Mesh

ROUND_OFF = 1e-9  # of the sum of what a load's parts are: their resultant, where they balance each other


@dataclass(frozen=True)
class Arrow:
    """An arrow in a picture.

    force: what it shows (dim,); arrows of one picture are as long as their forces say.  place: where it acts, (dim,).
    label: its entry in the legend; arrows of one label have one colour.

    Example:
        >>> gx.Arrow(force=(0.0, -1.0), place=(2.0, 0.5), label="weight").label
        'weight'
    """

    force: tuple[float, ...]
    place: tuple[float, ...]
    label: str = "load"

    def __post_init__(self) -> None:
        for name, what in (("force", "the force of an arrow"), ("place", "the place of an arrow")):
            object.__setattr__(self, name, require_vector(getattr(self, name), what))
        require_name(self.label, "the label of an arrow")

    @property
    def size(self) -> float:
        """The size of the force."""
        return float(np.linalg.norm(self.force))


def middle(mesh: Mesh, boundary: str, intensity: Callable[[Floats], Floats]) -> tuple[float, ...]:
    """Mean position of a boundary, weighted by the size of a traction, a function of position (collective).

    Of the whole boundary, where the traction is nothing at the middle of any of its facets.
    """
    facets = mesh.owned_facets(boundary)
    middles = dolfinx.mesh.compute_midpoints(mesh.domain, mesh.dim - 1, facets)
    size = np.linalg.norm(intensity(middles.T), axis=0) if len(facets) else np.zeros(0)
    if mesh.comm.allreduce(float(size.sum())) == 0:
        size = np.ones(len(facets))
    total = mesh.comm.allreduce(np.append(size @ middles, size.sum()))
    return tuple(total[: mesh.dim] / total[3])


def facet_sizes(mesh: Mesh, facets: Indices) -> Floats:
    """Areas of facets, lengths of those of a plane body, (facets,)."""
    if not len(facets):
        return np.zeros(0)
    x = mesh.domain.geometry.x[dolfinx.mesh.entities_to_geometry(mesh.domain, mesh.dim - 1, facets)]
    if mesh.dim == 2:
        return np.asarray(np.linalg.norm(x[:, 1] - x[:, 0], axis=1))
    # Of a triangle, or of a quadrilateral in DOLFINx' order, by its diagonals.
    sides = (x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) if x.shape[1] == 3 else (x[:, 3] - x[:, 0], x[:, 2] - x[:, 1])
    return np.asarray(np.linalg.norm(np.cross(*sides), axis=1) / 2)


def resultant(mesh: Mesh, boundary: str, intensity: Callable[[Floats], Floats]) -> tuple[float, ...]:
    """The force of a traction, a function of position, by its values at the middles of facets (collective).

    Zero where parts of it that balance each other leave no more than round-off.
    """
    facets = mesh.owned_facets(boundary)
    sizes = facet_sizes(mesh, facets)
    here: Floats = np.zeros((mesh.dim, 0))
    if len(facets):
        here = intensity(dolfinx.mesh.compute_midpoints(mesh.domain, mesh.dim - 1, facets).T)
    *force, most = mesh.comm.allreduce(np.append(here @ sizes, np.linalg.norm(here, axis=0) @ sizes))
    whole = np.array(force, dtype=float)
    return tuple(float(each) for each in (whole if np.linalg.norm(whole) > ROUND_OFF * most else 0 * whole))
