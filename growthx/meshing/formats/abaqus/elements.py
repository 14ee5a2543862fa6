"""Types of elements of Abaqus: their shapes, and the sides by which their surfaces name them."""

from __future__ import annotations

import re

_SOLID = {
    4: "tetrahedron",
    5: "pyramid",
    6: "prism",
    8: "hexahedron",
    10: "tetrahedron",
    15: "prism",
    20: "hexahedron",
    27: "hexahedron",
}
_SURFACE = {3: "triangle", 4: "quadrilateral", 6: "triangle", 8: "quadrilateral", 9: "quadrilateral"}
_LINE = {2: "interval", 3: "interval"}

# A pattern of the name, with the number of nodes as its group; shapes by that number.
_FAMILIES = (
    (re.compile(r"(?:C3D|DC3D|AC3D|SC|F3D|G3D)(\d+)[A-Z]*"), _SOLID),
    (re.compile(r"(?:CPE|CPS|CPEG|DC2D|AC2D|CAX|CGAX|DCAX|ACAX|SAX)(\d+)[A-Z]*"), _SURFACE),
    (re.compile(r"(?:S|DS|M3D|R3D|SFM3D|STRI|F3D)(\d+)[A-Z]*\d?"), _SURFACE),
    (re.compile(r"(?:T2D|T3D|R2D|DC1D|GK2D|RB2D|RB3D)(\d+)[A-Z]*"), _LINE),
)
_BEAM = re.compile(r"B[23](\d)[A-Z]*")
_AXIAL = re.compile(r"(?:C|CG|DC|AC)AX\d+[A-Z]*")

# Corners of the sides S1, S2, … of a shape, from 0, in the order that goes round.
SIDES = {
    "triangle": ((0, 1), (1, 2), (2, 0)),
    "quadrilateral": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tetrahedron": ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    "pyramid": ((0, 1, 2, 3), (0, 4, 1), (1, 4, 2), (2, 4, 3), (3, 4, 0)),
    "prism": ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    "hexahedron": ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
}


def shape_of(kind: str) -> tuple[str, int, str] | None:
    """Shape, number of nodes, and what is to be told of a type; None for one that has no shape, such as springs."""
    if kind == "STRI65":
        return "triangle", 6, ""
    if found := _BEAM.fullmatch(kind):
        return ("interval", int(found[1]) + 1, "") if found[1] in "123" and found[1] != "3" else ("interval", 2, "")
    for pattern, shapes in _FAMILIES:
        found = pattern.fullmatch(kind)
        if found and int(found[1]) in shapes:
            count = int(found[1])
            axial = "the elements of type " + kind + " are axisymmetric: growthx takes them for plane ones"
            return shapes[count], count, axial if _AXIAL.fullmatch(kind) else ""
    return None
