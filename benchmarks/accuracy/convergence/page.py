"""What is left of the study: tables of orders, the page around them, and the numbers as CSV."""

from __future__ import annotations

import csv
from pathlib import Path

from mpi4py import MPI

from benchmarks.accuracy.convergence import picture
from benchmarks.accuracy.convergence.orders import Order
from benchmarks.accuracy.convergence.study import Curve
from benchmarks.shared.command import write_page
from benchmarks.shared.reporting import RESULTS, Table
from benchmarks.shared.reporting import write_csv as write_rows

NOTES = """\
# Observed orders of convergence

Made by `python -m benchmarks.accuracy.convergence`; all errors are in `convergence.csv`, drawn here over h and, for the
order in Δt, in [convergence_time.png](convergence_time.png).

![Errors over the size of cells](convergence.png)

The manufactured problem couples the balances of mass and momentum at finite strains: one implicit Euler step of a unit
square (plane strain) or cube, clamped on its left side, with stretches between 0.79 and 1.40 and densities within 20 %
of ρ*. Body force, tractions on all other sides and the attractor stimulus are derived with sympy; the order in Δt is
taken from a block in homogeneous tension.

- *Everywhere* reads the density at a general point, as the variant knows it; *at its points* reads it where it is
  solved for: at nodes, cell midpoints or integration points.
- **1** is the order theory guarantees; **1 → 2**: on smooth meshes 2 is to be expected, since the points are special
  (superconvergence).
- Quadrilaterals, triangles, hexahedra and tetrahedra are images of regular grids under one smooth map: the finer the
  mesh, the closer its cells are to parallelograms. Trapezoids keep their shape.

What to read from it:

- A density that is constant per cell or per point is of first order at a general point, whatever the displacement.
  Read at its points it is as good as ∇u there: of second order for Q1P0 and Q1sri (midpoints) and for Q2, P2.
- Q1 and P1 solve for densities at points where ∇u is of first order only: so are they. (On simplices with linear
  displacements ∇u is constant: P1P0 and P1 are then the same.)
- S2fri reads ∇u at the 2 × 2 points where quadratic elements are of third order. That holds inside; in the row of cells
  along loaded sides it is 2, which makes 2.5 in the mean over a plane body.
- Q1Q1 and P1P1 average ∇u around nodes: second order inside, first along the boundary, 1.5 in the mean; coarse
  meshes show more.
- On trapezoids serendipity loses one order: 2 in L² (Q2 keeps 3), and 1 in H¹, which the meshes here only approach.
  The density does not feel it: at the 2 × 2 points that drive it ∇u keeps order 2 on these meshes.
- Implicit Euler is of first order, and the same numbers for every variant: the state is homogeneous.
- Newton's method begins at the interpolated exact solution. From rest the equations of S2Q1 on 5 or 6 hexahedra per
  side lead to another root, wrong in the cells at a free corner: presumably an hourglass, which 2 × 2 × 2 points for
  20 nodes do not rule out.
"""


def tables(curves: list[Curve]) -> list[Table]:
    """A table for each family: observed order and theory, one variant a row."""
    return [Table(title, *_summary(curves, family)) for family, title in titles(curves).items()]


def _summary(curves: list[Curve], family: str) -> tuple[list[str], list[list[str]]]:
    ours = [curve for curve in curves if curve.family == family]
    quantities = list(dict.fromkeys(curve.quantity for curve in ours))
    rows: dict[str, list[str]] = {}
    for curve in ours:
        mark = " (below)" if curve.below_theory else ""
        rows.setdefault(curve.variant, []).append(f"{curve.order:.2f} / {curve.theory}{mark}")
    return ["variant", *quantities], [[variant, *cells] for variant, cells in rows.items()]


def titles(curves: list[Curve]) -> dict[str, str]:
    """A title for the table of each family, by its name."""
    found = {}
    for curve in curves:
        unit = "time steps" if curve.family == "time steps" else "cells per side"
        kind = "in Δt" if curve.family == "time steps" else f"in h on {curve.family}"
        ends = sorted({c.parts[-2:] for c in curves if c.family == curve.family})
        last = " or ".join(f"{coarse} to {fine}" for coarse, fine in ends)
        found[curve.family] = f"Orders {kind}, observed / theory ({last} {unit})"
    return found


def page(folder: Path = RESULTS) -> str:
    """The page, from the CSV file of a folder."""
    return "\n".join([NOTES, *(table.markdown() for table in tables(read_curves(folder / "convergence.csv")))])


def write(curves: list[Curve], folder: Path) -> None:
    """CSV, Markdown and picture, on rank 0."""
    if MPI.COMM_WORLD.rank != 0:
        return
    folder.mkdir(parents=True, exist_ok=True)
    write_csv(curves, folder / "convergence.csv")
    write_page(folder, "convergence", page(folder))
    picture.draw(curves, folder / "convergence.png")
    picture.draw_time(curves, folder / "convergence_time.png")


def write_csv(curves: list[Curve], path: Path) -> None:
    """One row per error; the order is that from the row before."""
    rows = []
    for curve in curves:
        orders = ["", *(f"{order:.3f}" for order in curve.orders)]
        for parts, error, order in zip(curve.parts, curve.errors, orders, strict=True):
            theory = (f"{curve.theory.guaranteed:g}", f"{curve.theory.expected:g}")
            rows.append((curve.family, curve.variant, curve.quantity, parts, f"{error:.5e}", order, *theory))
    write_rows(path, ("family", "variant", "quantity", "parts", "error", "order", "theory", "theory if smooth"), rows)


def read_curves(path: Path) -> list[Curve]:
    """The curves of a CSV file."""
    found: dict[tuple[str, str, str, Order], list[tuple[int, float]]] = {}
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            guaranteed, expected = float(row["theory"]), float(row["theory if smooth"])
            order = Order(guaranteed, None if expected == guaranteed else expected)
            curve = found.setdefault((row["family"], row["variant"], row["quantity"], order), [])
            curve.append((int(row["parts"]), float(row["error"])))
    return [Curve(*key, *zip(*points, strict=True)) for key, points in found.items()]
