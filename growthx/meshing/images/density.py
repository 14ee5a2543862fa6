"""The density that a scan means, as a field of a scene: at points, or as means over cells."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
from mpi4py import MPI

from growthx.common.checks import require_number
from growthx.common.errors import InputError, shown
from growthx.fem.cells import SIMPLICES
from growthx.meshing.images.relation import Relation
from growthx.meshing.images.tally import Tally
from growthx.meshing.sampling import nodes_of_cells, positions, split_rule, volume_ratios

if TYPE_CHECKING:
    from collections.abc import Iterator

    from growthx.common.arrays import Floats, Indices
    from growthx.meshing.images.voxels import Voxels
    from growthx.meshing.mesh import Mesh

POINT, MEAN, MODULUS = "point", "mean", "modulus"
WAYS = (POINT, MEAN, MODULUS)
PLANES = {"axial": (0, 1, 2), "coronal": (0, 2, 1), "sagittal": (1, 2, 0)}  # the scan's axes of x, y and what is left
MOST_PARTS = 6  # of a cell in each direction
AT_ONCE = 400_000  # points


@dataclass(frozen=True)
class Slice:
    """Where a plane body lies in a scan: the plane's name, and the coordinate that is the same in it."""

    plane: str
    at: float

    def __post_init__(self) -> None:
        if self.plane not in PLANES:
            raise InputError(f"the plane of the slice is {shown(self.plane)}: one of {', '.join(PLANES)} is right")
        require_number(self.at, "the place of the slice, z,", "a finite number", lambda _: True)

    def lifted(self, places: Floats) -> Floats:
        """Places of the body's plane, (places, 2 or 3), as those of the scan."""
        found = np.full((len(places), 3), float(self.at))
        found[:, PLANES[self.plane][:2]] = places[:, :2]
        return found


class ScanDensity:
    """A density made of the values of a scan, wherever a scene takes a field; `Scan.density` makes it.

    At points it is a function of position, x of shape (3, points).  Means are of cells, and have no other places.

    Example:
        >>> import numpy as np
        >>> scan = gx.ct.from_array(np.full((3, 3, 3), 1000.0), np.eye(4))
        >>> density = scan.density(a=0.0, b=0.001)
        >>> isinstance(density, gx.ct.ScanDensity), density(np.array([[1.0], [1.0], [1.5]])).tolist()
        (True, [1.0])
    """

    def __init__(
        self, voxels: Voxels, relation: Relation, *, by: str, density_exponent: float, place: Slice | None, name: str
    ) -> None:
        if by not in WAYS:
            raise InputError(f"the density of a scan is by {shown(by)}: one of {', '.join(WAYS)} would be right")
        require_number(density_exponent, "the exponent of E ∝ ρⁿ", "a positive number", lambda n: n > 0)
        self.voxels, self.relation, self.by, self.place = voxels, relation, by, place
        self.density_exponent = density_exponent
        self.name = name
        self._told: set[str] = set()

    def __repr__(self) -> str:
        return f"ScanDensity({self.name} by {self.by})"

    @property
    def of_cells(self) -> bool:
        """Whether it has one value in each cell, of no place."""
        return self.by != POINT

    def __call__(self, x: Floats) -> Floats:
        """The density at points x, (3, points) or (2, points), in the frame of the scan.

        Raises InputError if any of them is outside, or for a mean over cells.
        """
        if self.of_cells:
            raise InputError(
                f"the density of {self.name} is by {self.by} over cells and is asked for at points: by='point' would "
                "be right"
            )
        return self.at_points(np.asarray(x, dtype=float).T, MPI.COMM_SELF)

    def at_points(self, places: Floats, comm: MPI.Comm, counted: Any = slice(None)) -> Floats:
        """The density at places of each rank, (places, 2 or 3) (collective).

        counted: those of them that no other rank has.  Raises InputError, on all ranks, if any is outside.
        """
        tally = Tally()
        density = self._density(places, tally, counted)
        tally.found(density[counted], places[counted], self.relation.floor)
        self.judge(tally, comm, "points")
        return np.maximum(density, self.relation.floor)

    def put_on(self, values: dolfinx.fem.Function, mesh: Mesh, cells: Indices | None = None) -> None:
        """Give it to a Function on some of the cells that a rank knows, default all (collective); errors as above."""
        self.check_dimension(mesh.dim)
        cells = mesh.local_cells if cells is None else cells
        owned = cells < len(mesh.owned_cells)
        if self.of_cells:
            rows = values.function_space.dofmap.list[cells[owned]]
            values.x.array[rows] = self.means(mesh, cells[owned])[:, np.newaxis]
        else:
            asked: list[Floats] = []

            def remember(x: Floats) -> Floats:
                asked.append(np.array(x[: mesh.dim].T))
                return np.zeros(x.shape[1])

            values.interpolate(remember, cells)
            places = asked[0] if asked else np.empty((0, mesh.dim))
            counted = np.repeat(owned, len(places) // max(len(cells), 1))
            found = self.at_points(places, mesh.comm, counted)
            values.interpolate(lambda x: found, cells)
        values.x.scatter_forward()

    def check_dimension(self, dim: int) -> None:
        """Refuse a body in the plane without a slice, and a body in space with one."""
        if dim == 2 and self.place is None:
            raise InputError(
                f"the body is plane and {self.name} is in space: the place of its slice, z=, would be right"
            )
        if dim == 3 and self.place is not None:
            raise InputError(f"z is {self.place.at:g}, of a slice, and the body is in space: no z would be right")

    def _density(self, places: Floats, tally: Tally, counted: Any) -> Floats:
        """At places of the body, before the floor."""
        values, outside = self.voxels.at(self._in_scan(places))
        tally.asked_at(places[counted], values[counted], outside[counted])
        return self.relation(values)

    def _in_scan(self, places: Floats) -> Floats:
        """Places of the body, (places, 2 or 3), as those of the scan, (places, 3)."""
        return places if self.place is None else self.place.lifted(places)

    def _fits_turned(self, ends: Floats) -> bool:
        """Whether a body between these ends would lie inside with the other sign of x and y."""
        corners = np.array(list(product(*ends.T)))
        return not self.voxels.at(self._in_scan(corners) * (-1.0, -1.0, 1.0))[1].any()

    def judge(self, tally: Tally, comm: MPI.Comm, what: str) -> None:
        """Say what is to be known of what was met, of these in the plural, once; InputError for what is no density."""
        notice = tally.judged(self.relation, self.name, what, comm, self._fits_turned)
        if notice and notice not in self._told and comm.rank == 0:
            logging.getLogger("growthx").warning("growthx: %s", notice)
        self._told.add(notice)

    def means(self, mesh: Mesh, cells: Indices) -> Floats:
        """Of owned cells, one for each (collective); errors as above."""
        tally, middle = Tally(), nodes_of_cells(mesh).mean(axis=1)[:, : mesh.dim]
        means = np.empty(len(mesh.owned_cells))
        for part, _, volumes, values in self.samples(mesh, cells, tally):
            means[part] = self._back(np.einsum("cp,cp->c", volumes, values) / volumes.sum(axis=1))
            if self.by != MODULUS:
                tally.found(means[part], middle[part], self.relation.floor)
        self.judge(tally, mesh.comm, "points" if self.by == MODULUS else "cells")
        return np.maximum(means[cells], self.relation.floor)

    def _back(self, means: Floats) -> Floats:
        """Densities of means of what is averaged."""
        return np.maximum(means, 0.0) ** (1 / self.density_exponent) if self.by == MODULUS else means

    def samples(
        self, mesh: Mesh, cells: Indices, tally: Tally, degree: int = 0
    ) -> Iterator[tuple[Indices, Floats, Floats, Floats]]:
        """What is averaged, of some owned cells after others (collective).

        By a rule in each of so many parts along their edges as the largest has voxels, 6 at most.  Yields cells, points
        X of the reference cell, (points, dim), their volumes and values there, both (cells, points).
        degree: of the rule, at least; it has the second on simplices, the third on others.
        """
        size = mesh.comm.allreduce(float(np.ptp(nodes_of_cells(mesh), axis=1).max(initial=0.0)), MPI.MAX)
        parts = int(np.clip(np.round(size / self.voxels.spacing.min()), 1, MOST_PARTS))
        X, weights = split_rule(mesh.cell_name, parts, max(degree, 2 if mesh.cell_name in SIMPLICES else 3))
        step = max(1, AT_ONCE // len(X))
        for start in range(0, len(cells), step):
            part = cells[start : start + step]
            places = positions(mesh, X, part)[:, :, : mesh.dim].reshape(-1, mesh.dim)
            values: Floats = self._density(places, tally, slice(None)).reshape(-1, len(X))
            if self.by == MODULUS:
                tally.found(values.ravel(), places, self.relation.floor)
                values = np.maximum(values, self.relation.floor) ** self.density_exponent
            yield part, X, weights * volume_ratios(mesh, X, part), values
