"""Shapes of cells by their names."""

from __future__ import annotations

from typing import TYPE_CHECKING

import basix
import basix.ufl
import numpy as np

if TYPE_CHECKING:
    from growthx.common.arrays import Floats


TENSOR_CELLS = ("quadrilateral", "hexahedron")
SIMPLICES = ("triangle", "tetrahedron")
PLURALS = {
    "triangle": "triangles",
    "quadrilateral": "quadrilaterals",
    "tetrahedron": "tetrahedra",
    "hexahedron": "hexahedra",
}


def counted(count: int, shape: str) -> str:
    """So many cells of a shape, also of shapes that growthx does not compute with."""
    return f"1 {shape}" if count == 1 else f"{count} {PLURALS.get(shape, f'{shape}s')}"


def equal_sided(cell: basix.CellType, X: Floats) -> Floats:
    """Points X of the reference cell in coordinates in which its sides are equal: for simplices, barycentric ones."""
    if cell.name in SIMPLICES:
        return np.column_stack([1 - X.sum(axis=1), X])
    return X
