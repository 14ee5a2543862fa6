"""Random bodies of a few cells: boxes with graded and shaken nodes, and with one moved until a cell is a sliver."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import permutations, product
from typing import TYPE_CHECKING

import numpy as np

import growthx as gx
from benchmarks.robustness.random_scenes import reference
from growthx.meshing.corners import corner_sines, qualities

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices

MOST = 60  # cells
POOREST = 1e-5  # quality of a sliver
ROUND = {"quadrilateral": (0, 1, 3, 2), "hexahedron": (0, 1, 3, 2, 4, 5, 7, 6)}  # in the order that goes round
SIDES = (("left", "right"), ("bottom", "top"), ("front", "back"))


@dataclass(frozen=True)
class Body:
    """A mesh as arrays: points (nodes, dim), cells (cells, corners) in DOLFINx's order of corners.

    sides: nodes of each side of the box.  regions: cells of "bone" and "implant".
    """

    shape: str
    points: Floats
    cells: Indices
    sides: dict[str, Indices]
    regions: dict[str, Indices]

    def mesh(self) -> gx.Mesh:
        """As growthx has it."""
        order = ROUND.get(self.shape)
        cells = self.cells if order is None else self.cells[:, order]
        return gx.meshing.from_arrays(self.points, cells, shape=self.shape, boundaries=self.sides, regions=self.regions)

    @cached_property
    def quality(self) -> float:
        """Of the poorest cell."""
        return float(qualities(self.shape, self.points[self.cells]).min())

    @property
    def size(self) -> float:
        """Longest side of the box."""
        return float(np.ptp(self.points, axis=0).max())

    def nodes_at(self, corners: Floats) -> Indices:
        """The nodes at places that are theirs to the last bit, (…, dim) to (…)."""
        known = {place.tobytes(): number for number, place in enumerate(self.points)}
        rows = np.ascontiguousarray(corners.reshape(-1, corners.shape[-1]))
        return np.array([known[row.tobytes()] for row in rows]).reshape(corners.shape[:-1])

    def cells_of(self, nodes: Indices) -> Indices:
        """The cells of some nodes each, in any order."""
        known = {tuple(sorted(cell)): number for number, cell in enumerate(self.cells.tolist())}
        return np.array([known[tuple(sorted(cell))] for cell in nodes.tolist()])


def random_body(rng: np.random.Generator, shape: str, most: int = MOST) -> Body:
    """A body of 2 to `most` cells, no fewer than 12, whose poorest one has a quality between 1e-5 and 1."""
    dim = reference.DIMENSION[shape]
    counts = _counts(rng, shape, most)
    box = rng.permutation(10 ** rng.uniform(-1.0, 0.0, dim)) * 10 ** rng.uniform(-3, 3)
    points = np.array(list(product(*[_graded(rng, count) for count in counts[::-1]])))[:, ::-1] * box
    grid = np.array(list(product(*[range(count + 1) for count in counts[::-1]])))[:, ::-1]
    cells = _split(rng, shape, _boxes(counts))
    points = _shaken(rng, shape, points, cells, box / counts)
    if rng.random() < 0.5:
        points = _with_sliver(rng, shape, points, cells, box)
    sides = {
        name: np.flatnonzero(grid[:, axis] == end * counts[axis])
        for axis, names in enumerate(SIDES[:dim])
        for end, name in enumerate(names)
    }
    return _renumbered(rng, shape, points, cells, sides)


def _counts(rng: np.random.Generator, shape: str, most: int) -> Indices:
    dim, split = reference.DIMENSION[shape], {"triangle": 2, "tetrahedron": 6}.get(shape, 1)
    while True:
        counts = rng.integers(1, 7 if dim == 2 else 4, dim)
        if 2 <= counts.prod() * split <= most:
            return counts


def _graded(rng: np.random.Generator, count: int) -> Floats:
    """Places from 0 to 1, each step a multiple of the one before: the last to the first by up to a thousand."""
    spread = 10 ** (rng.uniform(-3, 3) if rng.random() < 0.3 else 0.0)
    steps = spread ** (np.arange(count) / max(count - 1, 1))
    return np.concatenate([[0.0], np.cumsum(steps) / steps.sum()])


def _boxes(counts: Indices) -> Indices:
    """Cells of a grid in DOLFINx's order of corners; the first direction's number is the one that changes fastest."""
    strides = np.concatenate([[1], np.cumprod(counts[:-1] + 1)])
    first = np.array([np.dot(place, strides) for place in product(*[range(count) for count in counts])])
    bits = reference.corners("quadrilateral" if len(counts) == 2 else "hexahedron").astype(int)
    return first[:, None] + bits @ strides


def _split(rng: np.random.Generator, shape: str, boxes: Indices) -> Indices:
    """Boxes as cells of a shape: triangles along either diagonal, tetrahedra of one kind (Kuhn's)."""
    if shape == "triangle":
        ways = ((0, 1, 3), (0, 2, 3)), ((0, 1, 2), (1, 2, 3))
        return np.concatenate([box[list(map(list, ways[rng.integers(2)]))] for box in boxes])
    if shape == "tetrahedron":
        paths = [[0, 1 << a, (1 << a) | (1 << b), 7] for a, b, _ in permutations(range(3))]
        return np.concatenate([box[paths] for box in boxes])
    return boxes


def _quality(shape: str, corners: Floats, turns: Floats) -> float:
    """Of the poorest cell, below zero if one turns over; turns: the right way of each, 1 or −1."""
    sines = corner_sines(shape, corners) * turns[:, None]
    if sines.min() <= 0:
        return -1.0
    return float(sines.min() if shape in reference.TENSOR else qualities(shape, corners).min())


def _turns(shape: str, corners: Floats) -> Floats:
    return np.asarray(np.sign(corner_sines(shape, corners)[:, 0]))


def _shaken(rng: np.random.Generator, shape: str, points: Floats, cells: Indices, step: Floats) -> Floats:
    """Nodes moved at random, by half as much as before for as long as a cell would turn over."""
    turns, share = _turns(shape, points[cells]), 10 ** rng.uniform(-2, -0.3) if rng.random() < 0.7 else 0.0
    moves = rng.uniform(-1, 1, points.shape) * step
    for _ in range(40):
        moved = points + share * moves
        if _quality(shape, moved[cells], turns) > POOREST:
            return moved
        share /= 2
    return points


def _with_sliver(rng: np.random.Generator, shape: str, points: Floats, cells: Indices, box: Floats) -> Floats:
    """One node moved until a cell is as poor as was drawn."""
    turns, wanted = _turns(shape, points[cells]), 10 ** rng.uniform(np.log10(POOREST), -1)
    node, direction = rng.integers(len(points)), rng.normal(size=points.shape[1]) * box
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        moved = points.copy()
        moved[node] += middle * direction
        low, high = (middle, high) if _quality(shape, moved[cells], turns) > wanted else (low, middle)
    moved = points.copy()
    moved[node] += low * direction
    return moved


def _renumbered(
    rng: np.random.Generator, shape: str, points: Floats, cells: Indices, sides: dict[str, Indices]
) -> Body:
    """Nodes and cells in a random order; the cells of one half are bone, the others an implant."""
    order = rng.permutation(len(points))
    place = np.argsort(order)
    cells = place[cells[rng.permutation(len(cells))]]
    if shape in reference.SIMPLEX:
        cells = rng.permuted(cells, axis=1)
    bone = np.zeros(len(cells), dtype=bool)
    bone[: rng.integers(1, len(cells))] = True
    regions = {"bone": np.flatnonzero(bone), "implant": np.flatnonzero(~bone)}
    return Body(shape, points[order], cells, {name: np.sort(place[nodes]) for name, nodes in sides.items()}, regions)
