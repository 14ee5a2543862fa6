"""Observed orders of convergence in h and Δt of every discretisation on every shape of cells, next to theory.

    python benchmarks/convergence.py [--coarse]           mpirun -n 2 python benchmarks/convergence.py

In h: the manufactured solution of `manufactured.py`.  In Δt: a block in homogeneous tension, whose density solves an
ordinary differential equation.  Prints tables and leaves convergence.csv and .md, with pictures, in benchmarks/results.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import basix
import dolfinx
import manufactured
import numpy as np
import ufl
from manufactured import HEXAHEDRA, QUADRILATERALS, TETRAHEDRA, TRAPEZOIDS, TRIANGLES, Family
from mpi4py import MPI
from reporting import RESULTS, Table, progress
from reporting import write_csv as write_rows
from scipy.integrate import solve_ivp
from scipy.optimize import root

import growthx as gx
from growthx.sampling import positions, volume_ratios
from growthx.variants import CATALOGUE, SERENDIPITY, Nodal, Variant, suited

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.discretisation import Discretisation

COMM = MPI.COMM_WORLD
DEGREE = 9  # of the rule the errors are integrated with
SLACK = 0.15  # an observed order this much below theory is still on its way to it

# What is measured in space, by its name in tables.
DISPLACEMENT, GRADIENT = "displacement, L²", "displacement, H¹"
EVERYWHERE, AT_POINTS = "density, everywhere", "density, at its points"
QUANTITIES = (DISPLACEMENT, GRADIENT, EVERYWHERE, AT_POINTS)
# … and in time.
END_DENSITY, END_DISPLACEMENT = "density at the end", "displacement at the end"

# Cells per side, for linear and for quadratic displacements: what shows the order and stays below some minutes.
LEVELS = {
    QUADRILATERALS: {1: (4, 8, 16, 32, 64), 2: (4, 8, 16, 32, 64)},
    TRAPEZOIDS: {2: (8, 16, 32, 64, 128)},
    TRIANGLES: {1: (4, 8, 16, 32, 64), 2: (4, 8, 16, 32, 64)},
    HEXAHEDRA: {1: (2, 4, 8, 16), 2: (2, 4, 8)},
    TETRAHEDRA: {1: (3, 6, 12, 24), 2: (3, 6, 12)},
}
FAMILIES = tuple(LEVELS)
STEPS = (4, 8, 16, 32, 64)


# -- theory ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Order:
    """What theory says of an order: `guaranteed` on all meshes of the family; `smooth`, more, where points are special.

    The guaranteed order of a displacement of degree p is p + 1 in L² and p in H¹.  A density follows from ∇u, so that
    it gains nothing over p, and not more than its own space allows: 1 for a constant per cell or per point.
    """

    guaranteed: float
    smooth: float | None = None

    @property
    def expected(self) -> float:
        """The order to expect on meshes as smooth as ours."""
        return self.guaranteed if self.smooth is None else self.smooth

    def __str__(self) -> str:
        return f"{self.guaranteed:g}" if self.smooth is None else f"{self.guaranteed:g} → {self.smooth:g}"


def theory(variant: Variant, family: Family) -> dict[str, Order]:
    """Orders in h of the four errors."""
    p = _gradient_order(variant, family)
    allowed = variant.density.degree + 1 if isinstance(variant.density, Nodal) else 1
    orders = {
        DISPLACEMENT: Order(p + 1),
        GRADIENT: Order(p),
        EVERYWHERE: Order(min(p, allowed)),
        AT_POINTS: Order(min(p, allowed) if isinstance(variant.density, Nodal) else p),
    }
    if family.smooth:
        for quantity, order in SUPERCONVERGENCE.get(variant.name, {}).items():
            orders[quantity] = replace(orders[quantity], smooth=order)
    return orders


def _gradient_order(variant: Variant, family: Family) -> int:
    """Order of ∇u: the degree; but serendipity lacks x²y² and so, on cells that stay trapezoids, also x² and y²."""
    if variant.displacement == SERENDIPITY and not family.smooth:
        return 1
    return variant.displacement.degree


# Midpoints of linear cells and the 2 × 2 points of quadratic serendipity are points where ∇u is more exact than
# elsewhere, and averages around a node are, too; one order is lost again in the row of cells along loaded sides (where
# it is, half an order in the mean).
SUPERCONVERGENCE = {
    "Q1Q1": {EVERYWHERE: 1.5, AT_POINTS: 1.5},
    "P1P1": {EVERYWHERE: 1.5, AT_POINTS: 1.5},
    "Q1P0": {AT_POINTS: 2},
    "Q1sri": {AT_POINTS: 2},
    "S2fri": {AT_POINTS: 2.5},
}


# -- errors in space ---------------------------------------------------------------------------------------------------


def errors_in_space(variant: Variant, mesh: gx.Mesh) -> dict[str, float]:
    """The four errors of the manufactured problem on one mesh, each an L² norm over a body of volume one.

    At its points: the root mean square over the places of the densities (nodes, midpoints or integration points).
    """
    problem = solved(variant, mesh)
    dim = mesh.dim
    X, weights = basix.make_quadrature(basix.CellType[mesh.cell_name], DEGREE)
    x = positions(mesh, X).reshape(-1, 3).T
    dV = (weights * volume_ratios(mesh, X)).ravel()
    gradients = dolfinx.fem.Expression(ufl.grad(problem.displacement), X).eval(mesh.domain, mesh.owned_cells)
    found = {
        "displacement": problem.displacement_at(X).reshape(-1, dim).T,
        "gradient": np.reshape(gradients, (-1, dim, dim)).transpose(1, 2, 0),
        "density": problem.density_at(X).ravel(),
    }
    norms = [norm(values - manufactured.numeric(dim, name)(x), dV) for name, values in found.items()]
    return dict(zip(QUANTITIES, [*norms, error_at_points(problem)], strict=True))


def solved(variant: Variant, mesh: gx.Mesh) -> Discretisation:
    """The manufactured problem after its one step."""
    scene = manufactured.scene(mesh)
    problem = gx.discretise(scene, variant)
    begin_at_the_solution(problem)
    times = [step.time for step in gx.march(scene, variant, problem, tolerance=1e-11)]
    if times != [scene.program.until]:
        raise gx.EndedEarly(f"{variant.name} took the step in pieces, to the times {times}: it solves another problem")
    return problem


def begin_at_the_solution(problem: Discretisation) -> None:
    """Interpolate the exact fields into the first iterate.

    From rest, S2Q1 on 5 or 6 hexahedra per side finds another root of its equations, wrong at a free corner.
    """
    unknown, dim = problem.unknown, problem.scene.mesh.dim
    alone = unknown is problem.displacement
    parts = {"displacement": unknown} if alone else {"displacement": unknown.sub(0), "density": unknown.sub(1)}
    for name, part in parts.items():
        part.interpolate(manufactured.numeric(dim, name))
    unknown.x.scatter_forward()


def error_at_points(problem: Discretisation) -> float:
    """Root mean square error of the densities where they are."""
    owned = problem.density_space.dofmap.index_map.size_local
    x = problem.density_positions()[:owned].T
    exact = manufactured.numeric(problem.scene.mesh.dim, "density")(x)
    return norm(problem.density.x.array[:owned] - exact, 1 / COMM.allreduce(owned))


def norm(values: np.ndarray, weights: np.ndarray | float) -> float:
    """Square root of the weighted sum of squares over all points of all ranks."""
    return float(np.sqrt(COMM.allreduce(float(np.sum(values**2 * weights)))))


# -- errors in time ----------------------------------------------------------------------------------------------------

BLOCK = gx.Material(young=3.0, poisson=0.3, reference_density=1.2)
GROWTH = gx.EnergyDrivenGrowth(attractor=0.05, rate=4.0)
TENSION, UNTIL = 0.9, 1.0


def errors_in_time(variant: Variant, steps: int) -> dict[str, float]:
    """Errors at the end of a block in homogeneous tension, the load constant from t = 0; the mesh plays no part."""
    scene = gx.Scene(
        name="block",
        mesh=(QUADRILATERALS if "quadrilateral" in variant.cells else TRIANGLES).mesh(2),
        material=BLOCK,
        growth=GROWTH,
        supports=(gx.Support("left", (0.0, None)), gx.Support("bottom", (None, 0.0))),
        loads=(gx.Traction("right", (TENSION, 0.0)),),
        program=gx.Program(step=UNTIL / steps, until=UNTIL),
    )
    problem = gx.discretise(scene, variant)
    taken = sum(1 for _ in gx.march(scene, variant, problem, tolerance=1e-12))
    if taken != steps:
        raise gx.EndedEarly(f"{variant.name} took {taken} steps instead of {steps}")
    density, stretch = end_of_tension()
    middle = np.array([[0.5, 0.5]]) if scene.mesh.cell_name == "quadrilateral" else np.array([[1 / 3, 1 / 3]])
    x, u = positions(scene.mesh, middle)[..., 0], problem.displacement_at(middle)[..., 0]
    owned = np.abs(problem.density.x.array[: problem.density_space.dofmap.index_map.size_local] - density)
    return {
        END_DENSITY: COMM.allreduce(owned.max(initial=0.0), MPI.MAX),
        END_DISPLACEMENT: COMM.allreduce(np.abs(u - (stretch - 1) * x).max(initial=0.0), MPI.MAX),
    }


@cache
def end_of_tension() -> tuple[float, float]:
    """Density and stretch at the end by a method of high order: ρ̇ = R₀ (3), (6) with stretches in balance (7)."""
    lam, mu = BLOCK.lame
    reference, n, m = BLOCK.reference_density, BLOCK.density_exponent, GROWTH.exponent

    def stretches(density: float) -> tuple[float, float]:
        def stresses(s: np.ndarray) -> np.ndarray:
            P = mu * s + (lam * np.log(s[0] * s[1]) - mu) / s
            return (density / reference) ** n * P - (TENSION, 0.0)

        return tuple(root(stresses, (1.2, 0.9), tol=1e-14).x)

    def source(_: float, density: np.ndarray) -> float:
        a, b = stretches(density[0])
        energy = lam / 2 * np.log(a * b) ** 2 + mu / 2 * (a**2 + b**2 + 1 - 3 - 2 * np.log(a * b))
        return GROWTH.rate * ((density[0] / reference) ** (n - m) * energy - GROWTH.attractor)

    density = solve_ivp(source, (0, UNTIL), [reference], method="DOP853", rtol=1e-12, atol=1e-14).y[0, -1]
    return float(density), stretches(density)[0]


# -- the study ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Curve:
    """Errors of one variant in one quantity on ever finer meshes of a family, or with ever smaller time steps."""

    family: str
    variant: str
    quantity: str
    theory: Order
    parts: tuple[int, ...]  # cells per side, or time steps
    errors: tuple[float, ...]

    @property
    def orders(self) -> np.ndarray:
        """Observed order from each refinement to the next, shape (parts − 1,)."""
        return -np.diff(np.log(self.errors)) / np.diff(np.log(self.parts))

    @property
    def order(self) -> float:
        """Observed order between the finest two."""
        return float(self.orders[-1])

    @property
    def below_theory(self) -> bool:
        """Whether the observed order is lower than what is guaranteed."""
        return self.order < self.theory.guaranteed - SLACK


def in_space(variant: Variant, family: Family, levels: tuple[int, ...]) -> list[Curve]:
    """The four curves of a variant on a family of meshes."""
    errors = [errors_in_space(variant, family.mesh(cells)) for cells in levels]
    orders = theory(variant, family)
    return [
        Curve(family.name, variant.name, quantity, orders[quantity], levels, tuple(e[quantity] for e in errors))
        for quantity in QUANTITIES
    ]


def in_time(variant: Variant, steps: tuple[int, ...]) -> list[Curve]:
    """The two curves of a variant: implicit Euler is of first order."""
    errors = [errors_in_time(variant, count) for count in steps]
    return [
        Curve("time steps", variant.name, quantity, Order(1), steps, tuple(e[quantity] for e in errors))
        for quantity in (END_DENSITY, END_DISPLACEMENT)
    ]


def members(family: Family) -> list[Variant]:
    """The variants measured on a family: on trapezoids serendipity, and Q2 to compare it with."""
    return suited(family.cell) if family.smooth else [gx.S2Q1, gx.Q2, gx.S2fri]


def study(coarse: bool = False) -> list[Curve]:
    """All curves; `coarse` leaves out the finest level of each."""
    last = -1 if coarse else None
    jobs: list[tuple[str, Callable[[], list[Curve]]]] = []
    for family in FAMILIES:
        for variant in members(family):
            levels = LEVELS[family][variant.displacement.degree][:last]
            jobs.append((f"{variant.name} on {family.name}", lambda v=variant, f=family, n=levels: in_space(v, f, n)))
    for variant in CATALOGUE.values():
        jobs.append((f"{variant.name} in time", lambda v=variant: in_time(v, STEPS[:last])))
    with progress("convergence", len(jobs)) as begin:
        curves = []
        for name, job in jobs:
            begin(name)
            curves += job()
    return curves


# -- what is left ------------------------------------------------------------------------------------------------------


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


NOTES = """\
# Observed orders of convergence

Made by `python benchmarks/convergence.py`; all errors are in `convergence.csv`, drawn here over h and, for the order in
Δt, in [convergence_time.png](convergence_time.png).

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


def write(curves: list[Curve], folder: Path) -> None:
    """CSV, Markdown and picture, on rank 0."""
    if COMM.rank != 0:
        return
    folder.mkdir(parents=True, exist_ok=True)
    write_csv(curves, folder / "convergence.csv")
    page = "\n".join([NOTES, *(table.markdown() for table in tables(curves))])
    (folder / "convergence.md").write_text(page, encoding="utf-8")
    draw(curves, folder / "convergence.png")
    draw_time(curves, folder / "convergence_time.png")


def write_csv(curves: list[Curve], path: Path) -> None:
    """One row per error; the order is that from the row before."""
    rows = []
    for curve in curves:
        orders = ["", *(f"{order:.3f}" for order in curve.orders)]
        for parts, error, order in zip(curve.parts, curve.errors, orders, strict=True):
            theory = (f"{curve.theory.guaranteed:g}", f"{curve.theory.expected:g}")
            rows.append((curve.family, curve.variant, curve.quantity, parts, f"{error:.5e}", order, *theory))
    write_rows(path, ("family", "variant", "quantity", "parts", "error", "order", "theory", "theory if smooth"), rows)


# Okabe and Ito's colours, told apart by all; what is alike on tensor cells and on simplices looks alike.
LOOKS = {
    ("Q1Q1", "P1P1"): ("#0072b2", "o"),
    ("Q2Q2", "P2P2"): ("#56b4e9", "s"),
    ("S2Q1", "P2P1"): ("#009e73", "D"),
    ("Q1P0", "P1P0"): ("#d55e00", "^"),
    ("Q1", "P1"): ("#e69f00", "v"),
    ("Q2", "P2"): ("#cc79a7", "P"),
    ("Q1sri",): ("#000000", "x"),
    ("S2fri",): ("#999999", "*"),
}
SLOPE = "0.35"  # grey of the reference lines
TICKS = (2, 3, 4, 6, 8, 12, 16, 24, 32, 64, 128)


def draw(curves: list[Curve], path: Path) -> None:
    """Errors over h, one panel per quantity (rows) and family of meshes (columns)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    families = [family.name for family in FAMILIES if any(curve.family == family.name for curve in curves)]
    figure = Figure(figsize=(3.3 * len(families), 3.0 * len(QUANTITIES) + 0.9), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(QUANTITIES), len(families), sharex="col", sharey="row", squeeze=False)
    for row, quantity in zip(panels, QUANTITIES, strict=True):
        for axes, family in zip(row, families, strict=True):
            _panel(axes, [c for c in curves if (c.family, c.quantity) == (family, quantity)])
        row[0].set_ylabel(f"error in {quantity}")
    for axes, family in zip(panels[0], families, strict=True):
        axes.set_title(family)
    for axes in panels[-1]:
        axes.set_xlabel("h = 1 / cells per side")
    figure.suptitle("Errors of the manufactured problem over the size of cells")
    _legend(figure)
    figure.savefig(path, dpi=110)


def draw_time(curves: list[Curve], path: Path) -> None:
    """Errors over Δt, one panel per quantity."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, quantity in zip(figure.subplots(1, 2), (END_DENSITY, END_DISPLACEMENT), strict=True):
        _panel(axes, [curve for curve in curves if curve.quantity == quantity])
        axes.set_xlabel("Δt = 1 / time steps")
        axes.set_ylabel(f"error in {quantity}")
    figure.suptitle("Errors of a block in homogeneous tension over the time step: the same for all variants")
    figure.savefig(path, dpi=110)


def _panel(axes: Any, curves: list[Curve]) -> None:
    """Errors over h or Δt, and a dashed line for each order that theory expects."""
    for curve in curves:
        index, look = next((i, LOOKS[names]) for i, names in enumerate(LOOKS) if curve.variant in names)
        axes.loglog(1 / np.array(curve.parts), curve.errors, **_style(index, *look))
    for order in sorted({curve.theory.expected for curve in curves}):
        _slope(axes, order, [curve for curve in curves if curve.theory.expected == order])
    ticks = sorted({parts for curve in curves for parts in curve.parts if parts in TICKS})
    axes.set_xticks([1 / parts for parts in ticks], [f"1/{parts}" for parts in ticks])
    axes.minorticks_off()
    axes.grid(color="0.9")


def _style(index: int, colour: str, marker: str) -> dict[str, Any]:
    """Hollow markers, smaller and smaller, so that curves that coincide are seen as such."""
    return {
        "color": colour,
        "marker": marker,
        "markerfacecolor": "none",
        "markersize": 10 - 0.7 * index,
        "markeredgewidth": 1.5,
        "linewidth": 1.2,
    }


def _slope(axes: Any, order: float, curves: list[Curve]) -> None:
    """A line of this slope at the finest meshes, half as high as the lowest of the curves it belongs to."""
    lowest = min(curves, key=lambda curve: curve.errors[-1])
    h = 1 / np.array([lowest.parts[-3:][0], lowest.parts[-1]])
    line = 0.5 * lowest.errors[-1] * (h / h[-1]) ** order
    axes.loglog(h, line, color=SLOPE, linestyle="--", linewidth=1)
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.5}
    axes.annotate(
        f"{order:g}", (h[0], line[0]), (3, -4), textcoords="offset points", va="center", color=SLOPE, bbox=box
    )


def _legend(figure: Any) -> None:
    """Below all panels: the variants, and the dashed lines."""
    from matplotlib.lines import Line2D

    entries = [
        Line2D([], [], label=" / ".join(names), **_style(index, *look))
        for index, (names, look) in enumerate(LOOKS.items())
    ]
    entries.append(Line2D([], [], color=SLOPE, linestyle="--", label="slope of the order to expect"))
    figure.legend(handles=entries, loc="outside lower center", ncols=len(entries), frameon=False)


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(description="Observed orders of convergence in h and Δt, next to theory.")
    parser.add_argument("--coarse", action="store_true", help="leave out the finest meshes and time steps")
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder for the results (default: %(default)s)")
    options = parser.parse_args()
    curves = study(options.coarse)
    for table in tables(curves):
        table.show()
    write(curves, options.out)


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
