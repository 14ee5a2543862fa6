"""Densities of shared nodes that begin by scans: one function, nearest to what each of its parts says of its cells.

Of all functions that keep the mass of each part, the one nearest in the mean square to the parts' own.  A jump from one
part to the next is met by no continuous function: what a node between them has too much, its neighbours lack.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from growthx.fem.projection import NodalProjection
from growthx.meshing.images.density import MODULUS, ScanDensity
from growthx.meshing.images.tally import Tally
from growthx.meshing.sampling import dof_positions, split_rule, volume_ratios

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    import dolfinx

    from growthx.common.arrays import Floats, Indices, Marks
    from growthx.meshing.mesh import Mesh

    Samples = Iterator[tuple[Indices, Floats, Floats, Floats]]


class Part(Protocol):
    """Some owned cells, and what their density is."""

    @property
    def cells(self) -> Indices:
        """Which they are."""

    def samples(self, mesh: Mesh, degree: int, exponent: float) -> Samples:
        """Cells, points X of the reference cell, their volumes and ρ to the power of an exponent there (collective).

        degree: of polynomials that the volumes integrate exactly, at least.
        """

    def floor(self, lowest: float) -> float:
        """Below which no node has its density (collective); lowest: of the scans."""

    def tell(self, density: Floats, places: Floats, mesh: Mesh) -> None:
        """Say, or refuse, what nodes have that it has to do with, before the floor (collective)."""


@dataclass(frozen=True)
class OfScan:
    """Cells that begin by a scan."""

    scan: ScanDensity
    cells: Indices

    def samples(self, mesh: Mesh, degree: int, exponent: float) -> Samples:
        """Those of `Part`; where not all scans are averaged as this one, the means of its cells."""
        if self.scan.by == MODULUS and self.scan.density_exponent != exponent:
            values = np.zeros(len(mesh.owned_cells))
            values[self.cells] = self.scan.means(mesh, self.cells)
            yield from _constant(mesh, self.cells, degree, values**exponent)
            return
        tally = Tally()
        yield from self.scan.samples(mesh, self.cells, tally, degree)
        self.scan.judge(tally, mesh.comm, "points")

    def floor(self, lowest: float) -> float:
        """The scan's own."""
        return self.scan.relation.floor

    def tell(self, density: Floats, places: Floats, mesh: Mesh) -> None:
        """As the scan does of its points."""
        tally = Tally()
        tally.found(density, places, self.scan.relation.floor)
        self.scan.judge(tally, mesh.comm, "nodes")


@dataclass(frozen=True)
class OfField:
    """Cells beside those of scans, of another field.

    values: its values at points X of the reference cell, of each owned cell, (cells, points).
    smallest: of them, on all ranks.
    """

    values: Callable[[Floats], Floats]
    cells: Indices
    smallest: float

    def samples(self, mesh: Mesh, degree: int, exponent: float) -> Samples:
        """Those of `Part`."""
        X, weights = split_rule(mesh.cell_name, 1, degree)
        values = self.values(X)[self.cells]
        yield self.cells, X, weights * volume_ratios(mesh, X, self.cells), values**exponent

    def floor(self, lowest: float) -> float:
        """That of the scans, or what is smaller."""
        return min(lowest, self.smallest)

    def tell(self, density: Floats, places: Floats, mesh: Mesh) -> None:
        """Nothing."""


def _constant(mesh: Mesh, cells: Indices, degree: int, values: Floats) -> Samples:
    X, weights = split_rule(mesh.cell_name, 1, degree)
    shape = len(cells), len(X)
    yield cells, X, weights * volume_ratios(mesh, X, cells), np.broadcast_to(values[cells][:, np.newaxis], shape)


def at_nodes(space: dolfinx.fem.FunctionSpace, mesh: Mesh, parts: Sequence[Part]) -> tuple[Floats, Marks]:
    """The function of a space of shared nodes nearest to the densities of parts, of different cells.

    It has the integral of each part over its cells, of ρ or, where all scans are by modulus of one exponent, of E; and
    a field that is linear over all of them as it is.  Below the floor it is the floor.
    Returns values as in `x.array`, and at which nodes they are (collective); errors as of `ScanDensity.at_points`.
    """
    exponent, sums = _exponent(parts), [_Sums(space, mesh, part.cells) for part in parts]
    for part, own in zip(parts, sums, strict=True):
        for each in part.samples(mesh, 2 * space.ufl_element().basix_element.degree, exponent):
            own.add(*each)
    totals = mesh.comm.allreduce(np.array([own.total for own in sums]))
    masses, right = (sum(getattr(own, name) for own in sums) for name in ("masses", "right"))
    nearest = NodalProjection(space, masses, right, mesh.comm)
    found = nearest.nearest(float(totals[:, 0].sum() / totals[:, 1].sum()))
    if len(parts) > 1:
        found = nearest.keeping(found, [nearest.sum(own.masses.sum(axis=2)) for own in sums], totals[:, 0])
    found = found if exponent == 1 else np.maximum(found, 0.0) ** (1 / exponent)
    lowest = min(part.scan.relation.floor for part in parts if isinstance(part, OfScan))
    floors, owned = np.full(len(found), np.inf), space.dofmap.index_map.size_local
    places = dof_positions(space, mesh)[:, : mesh.dim]
    for part, own in zip(parts, sums, strict=True):
        there = nearest.sum(np.einsum("cii->ci", own.masses)) > 0
        floors[there] = np.minimum(floors[there], part.floor(lowest))
        nodes = np.flatnonzero(there[:owned])
        part.tell(found[nodes], places[nodes], mesh)
    return np.where(nearest.known, np.maximum(found, floors), found), nearest.known


def _exponent(parts: Sequence[Part]) -> float:
    """Of the power of ρ that is averaged: that of E, where all scans are by modulus of one exponent, or else one."""
    found = {
        part.scan.density_exponent if part.scan.by == MODULUS else 1.0 for part in parts if isinstance(part, OfScan)
    }
    return found.pop() if len(found) == 1 else 1.0


class _Sums:
    """∫ N N and ∫ N f of each owned cell, zero where a part has none; total: ∫ f and the volume, of this rank."""

    def __init__(self, space: dolfinx.fem.FunctionSpace, mesh: Mesh, cells: Indices) -> None:
        self._element, count = space.ufl_element(), space.dofmap.list.shape[1]
        self.masses = np.zeros((len(mesh.owned_cells), count, count))
        self.right = np.zeros((len(mesh.owned_cells), count))
        self.total = np.zeros(2)

    def add(self, cells: Indices, X: Floats, volumes: Floats, values: Floats) -> None:
        basis = self._element.tabulate(0, X)[0]
        self.masses[cells] = np.einsum("cp,pi,pj->cij", volumes, basis, basis, optimize=True)
        self.right[cells] = (volumes * values) @ basis
        self.total += (volumes * values).sum(), volumes.sum()
