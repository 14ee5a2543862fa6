"""All that can be read of a bar beside mid-length and at its end: the same readings by name, whatever the element."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from benchmarks.shared.integrals import rule
from growthx.fem.compat import interpolation_points
from growthx.meshing.sampling import positions, reference_corners

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation

COMM = MPI.COMM_WORLD
# By the number of cells between them and mid-length, to the right from 0, to the left from −1.
CELLS = {0: "right cell", -1: "left cell", 1: "second cell to the right", -2: "second cell to the left"}
BOTH = "mean of the right and left cell"
DENSITY_RULE = "right cell: column 1, edge"  # ours, `midpoint_density_change`
DISPLACEMENT_RULE = "corner"  # ours, `end_displacement`
DEGREE = 4  # of the integrals over a cell


@dataclass(frozen=True)
class _Cell:
    """A cell and what its densities say.

    X, places, values: of the densities, where they are in the reference cell and in the bar, and [ρ − ρ*]/ρ* there,
    shapes (densities, 2), (densities, 3) and (densities,).  end: the corners of the reference cell on the side nearer
    to mid-length, (2, 2).  points, volumes: of the integral over the cell, (points, 2) and (points,).
    """

    X: Floats
    places: Floats
    values: Floats
    end: Floats
    points: Floats
    volumes: Floats

    def readings(self) -> dict[str, float]:
        """By name: of columns and rows of densities, of means and of what is extrapolated."""
        found = {}
        distances = np.abs(self.places[:, 0] - 0.5).round(9)
        for number, distance in enumerate(np.unique(distances), start=1):
            values, y = self.values[distances == distance], self.places[distances == distance, 1].round(9)
            found[f"column {number}, edge"] = float(values[y.argmin()])
            found[f"column {number}, axis"] = float(values[np.abs(y).argmin()])
            found[f"column {number}, mean of its rows"] = float(values.mean())
        found["mean of its densities"] = float(self.values.mean())
        whole = round(np.sqrt(len(self.values))) - 1  # degree of the polynomial through all densities
        found["mean over its area"] = float(self.volumes @ self._fitted(whole, self.points) / self.volumes.sum())
        for name, degree in (("linearly", min(whole, 1)), ("through all densities", whole)):
            edge, axis = self._fitted(degree, np.array([self.end[0], self.end.mean(axis=0)]))
            found[f"extrapolated {name} to the end, edge"] = float(edge)
            found[f"extrapolated {name} to the end, axis"] = float(axis)
        return found

    def _fitted(self, degree: int, at: Floats) -> Floats:
        """The polynomial of that degree in each direction that is nearest to the densities, at reference points."""
        coefficients = np.linalg.lstsq(_powers(self.X, degree), self.values, rcond=None)[0]
        return np.asarray(_powers(at, degree) @ coefficients)


def _powers(X: Floats, degree: int) -> Floats:
    """Products of powers of the coordinates, shape (points, (degree + 1)²)."""
    return np.stack([X[:, 0] ** i * X[:, 1] ** j for i in range(degree + 1) for j in range(degree + 1)], axis=1)


def density_readings(problem: Discretisation, elements: int) -> dict[str, float]:
    """[ρ − ρ*]/ρ* beside mid-length of a bar of so many quadrilaterals, by names of readings, ours first (collective).

    In the cells on either side of mid-length and next to those: densities by column, counted from mid-length, and by
    row; means; values that the densities of the cell, extrapolated, have at its end nearer to mid-length; and the means
    of both cells at mid-length, which for extrapolated values are nodal averages.
    """
    by_cell = reduce(lambda one, other: one | other, COMM.allgather(_by_cell(problem, elements)))
    found = {
        f"{name}: {what}": value for place, name in CELLS.items() for what, value in by_cell.get(place, {}).items()
    }
    both = {f"{BOTH}: {what}": (value + by_cell[-1][what]) / 2 for what, value in by_cell[0].items()}
    return found | both


def _by_cell(problem: Discretisation, elements: int) -> dict[int, dict[str, float]]:
    """Readings of this rank's cells, by how many cells lie between them and mid-length."""
    mesh, space = problem.scene.mesh, problem.density_space
    corners, X = reference_corners(mesh.cell_name), interpolation_points(space.element)
    around, places = positions(mesh, corners), positions(mesh, X)
    points, volumes = rule(mesh, DEGREE)
    changes = problem.density_changes_of_cells()
    found = {}
    for cell, x in enumerate(around[:, :, 0].mean(axis=1)):
        place = int(np.floor((x - 0.5) * elements))
        if place in CELLS:
            near = np.abs(around[cell, :, 0] - 0.5).round(9)
            end = corners[np.lexsort((around[cell, :, 1], near))[:2]]
            found[place] = _Cell(X, places[cell], changes[cell], end, points, volumes[cell]).readings()
    return found


def displacement_readings(problem: Discretisation) -> dict[str, float]:
    """Axial displacement of the loaded end, by names of readings, ours first (collective)."""
    mesh = problem.scene.mesh
    corners = reference_corners(mesh.cell_name)
    at_end = np.isclose(positions(mesh, corners)[:, :, 0], 1.0)
    found: dict[str, float] = {}
    for cell in np.flatnonzero(at_end.any(axis=1)):
        order = np.argsort(positions(mesh, corners)[cell, at_end[cell], 1])
        low, high = corners[at_end[cell]][order]
        u = problem.displacement_at(np.array([low, (low + high) / 2, high]))[cell, :, 0]
        found = {"corner": u[0], "axis": u[1], "upper corner": u[2], "mean over the end": (u[0] + 4 * u[1] + u[2]) / 6}
    return reduce(lambda one, other: one | other, COMM.allgather({name: float(u) for name, u in found.items()}))
