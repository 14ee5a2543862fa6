"""From finite strains to far below those of bone: the same densities under the same relative loads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
from mpi4py import MPI

import growthx as gx
from benchmarks.shared.pictures import COLOURS, blank
from benchmarks.stability.study import FINISHED, Part, named
from benchmarks.stability.study import march as march_to_its_end

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation
    from growthx.stepping.record import Step

LADDER = (1.0, 5e-2, 1.6e-2, 1.6e-3)  # of the femur's strains: 6e-3, 3e-4, 1e-4 and 1e-5
FACTORS = (1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5)  # of the strains of plate and block, which are finite
TRIANGLES = 5.0  # mm


@dataclass(frozen=True)
class Ladder:
    """A scene, the discretisations of its cells, and the factors on its strains.

    scene: by the shape of the cells.  softer: the same at a factor of the strains.
    """

    shapes: dict[str, tuple[str, ...]]
    scene: Callable[[str], gx.Scene]
    softer: Callable[[gx.Scene, float], gx.Scene]
    factors: tuple[float, ...]


def _stiffer(scene: gx.Scene, factor: float) -> gx.Scene:
    """Young's modulus by the factor squared, and forces by it: the energies, and so the densities, stay."""
    loads = tuple(replace(load, force=tuple(part / factor for part in load.force)) for load in scene.loads)
    return replace(scene, material=replace(scene.material, young=scene.material.young / factor**2), loads=loads)


def _less(scene: gx.Scene, factor: float) -> gx.Scene:
    """Loads by the factor, the attractor by its square, and the rate so that densities change as fast."""
    loads = tuple(replace(load, value=tuple(factor * part for part in load.value)) for load in scene.loads)
    growth = replace(scene.growth, attractor=scene.growth.attractor * factor**2, rate=scene.growth.rate / factor**2)
    return replace(scene, loads=loads, growth=growth)


@cache
def _femur(shape: str) -> gx.Scene:
    return gx.scenes.femur(shape=shape, size=None if shape == "quadrilateral" else TRIANGLES)


@cache
def _plate(shape: str) -> gx.Scene:
    return gx.scenes.plate(8, shape=shape)


@cache
def _block(shape: str) -> gx.Scene:
    """The plate with a depth of one, in cells of a quarter."""
    kind = getattr(dolfinx.mesh.CellType, shape)
    domain = dolfinx.mesh.create_box(MPI.COMM_WORLD, [[0.0, 0.0, 0.0], [2.0, 1.0, 1.0]], [8, 4, 4], kind)
    ends = {"left": lambda x: np.isclose(x[0], 0.0), "right": lambda x: np.isclose(x[0], 2.0)}
    loads = (gx.Traction("right", (0.0, -0.02, 0.0)),)
    return replace(_plate("quadrilateral"), name="block", mesh=gx.Mesh.with_names(domain, ends), loads=loads)


SIMPLE = ("P1P0", "P1P1")
ALL = tuple(COLOURS)
LADDERS = {
    "femur": Ladder({"quadrilateral": ALL, "triangle": SIMPLE}, _femur, _stiffer, LADDER),
    "plate": Ladder({"quadrilateral": ALL, "triangle": SIMPLE}, _plate, _less, FACTORS),
    "block": Ladder({"hexahedron": ("Q1", "Q1P0", "Q1Q1"), "tetrahedron": (*SIMPLE, "P2")}, _block, _less, FACTORS),
}


@dataclass(frozen=True)
class Case:
    """A body, the shape of its cells, a discretisation and a factor on its strains."""

    body: str
    cells: str
    variant: str
    factor: float


@dataclass(frozen=True)
class Row:
    """How the march went.

    strain: at the set point, √(2 Ψ₀*/E).  round_off: of the residual, the largest that ended a step; zero if none did.
    defect: largest of mass and of forces.
    """

    body: str
    cells: str
    variant: str
    factor: float
    strain: float
    ended: str
    steps: int
    iterations: int
    least: float
    greatest: float
    round_off: float
    defect: float


def run(case: Case) -> list[Row]:
    """The march."""
    ladder, done = LADDERS[case.body], []
    scene = ladder.softer(ladder.scene(case.cells), case.factor)

    def watch(step: Step, problem: Discretisation) -> None:
        done.append(step)

    found = march_to_its_end(scene, named(case.variant), watch=watch)
    strain = float(np.sqrt(2 * scene.growth.attractor / scene.material.young))
    low, high = found.problem.density_range()
    return [
        Row(
            case.body,
            case.cells,
            case.variant,
            case.factor,
            strain,
            found.ended,
            len(done),
            sum(step.newton_iterations for step in done),
            low,
            high,
            max((step.newton.round_off for step in done), default=0.0),
            max((max(step.mass_defect, step.force_defect) for step in done), default=0.0),
        )
    ]


def cases() -> list[Case]:
    """All of them."""
    return [
        Case(body, cells, variant, factor)
        for body, ladder in LADDERS.items()
        for cells, variants in ladder.shapes.items()
        for variant in variants
        for factor in ladder.factors
    ]


PART = Part("strains", Row, cases, run)


def ladders(rows: list[Row]) -> dict[tuple[str, str, str], list[Row]]:
    """The rows of each body, shape of cells and discretisation, from the largest strain down."""
    found: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        found.setdefault((row.body, row.cells, row.variant), []).append(row)
    return found


# -- the picture -------------------------------------------------------------------------------------------------------

STRAINS = 10.0 ** np.arange(-8, 0.01, 0.25)
OTHERS = {"P1P0": "#d55e00", "P1P1": "#0072b2", "P2": "#cc79a7"}  # as their like on quadrilaterals


def draw(rows: list[Row], path: Path) -> None:
    """Iterations, largest densities, and the round-off of the energy, over the strain."""
    figure = blank(17, 5.2)
    panels = figure.subplots(1, 3)
    styles = {"femur": "-", "plate": "--", "block": ":"}
    for (body, _, variant), these in ladders(rows).items():
        look = {"color": {**COLOURS, **OTHERS}[variant], "linestyle": styles[body], "marker": "o", "markersize": 4}
        strains, first, last = [row.strain for row in these], these[0], these[-1]
        panels[0].semilogx(strains, [row.iterations / first.iterations for row in these], **look)
        panels[1].loglog(strains[:-1], [abs(row.greatest / last.greatest - 1) for row in these[:-1]], **look)
    panels[0].axhline(1.2, color="0.6", linewidth=1)
    panels[0].set(ylabel="Newton iterations over those at the largest strain", ylim=(0, 1.4))
    panels[1].set(ylabel="largest density: change from that at the smallest strain")
    _round_off(panels[2])
    for axes in panels:
        axes.set_xlabel("strain at the set point, √(2Ψ₀*/E)")
        axes.axvspan(1e-4, 3e-3, color="0.92", zorder=0)
        axes.grid(color="0.9")
    panels[2].set_xlabel("strain")
    _legend(panels[0], styles)
    figure.savefig(path, dpi=75, pil_kwargs={"optimize": True})


def _legend(axes: Any, styles: dict[str, str]) -> None:
    from matplotlib.lines import Line2D

    entries = [Line2D([], [], color=colour, label=name) for name, colour in COLOURS.items()]
    entries += [Line2D([], [], color="black", linestyle=style, label=body) for body, style in styles.items()]
    axes.legend(handles=entries, frameon=False, ncols=3, fontsize=9, loc="lower left")


def _round_off(axes: Any) -> None:
    """Relative error of I₁ − 3 − 2 ln J from F, and from H = F − I, against sixty digits."""
    from decimal import Decimal, localcontext

    from growthx.constitutive.kinematics import principal_changes

    naive, ours = [], []
    for strain in STRAINS:
        a, b = float(strain), -0.3 * float(strain) / (1 + float(strain))
        with localcontext() as context:
            context.prec = 60
            first, second = 1 + Decimal(a), 1 + Decimal(b)
            exact = first**2 + second**2 - 2 - 2 * (first * second).ln()
            F = np.array([1 + a, 1 + b])
            shape, volume = principal_changes((a, b, 0.0))
            for found, errors in (
                (F @ F - 2 - 2 * np.log(F.prod()), naive),
                (shape + 2 * gx.functions.ln1p_excess(volume), ours),
            ):
                errors.append(max(abs(float(Decimal(float(found)) / exact - 1)), 1e-17))
    axes.loglog(STRAINS, naive, "o-", color="#d55e00", markersize=4, label="from F, as the paper writes it")
    axes.loglog(STRAINS, ours, "s-", color="#0072b2", markersize=4, label="from ∇u, as growthx has it")
    axes.set(ylabel="relative error of I₁ − 3 − 2 ln J")
    axes.legend(frameon=False)


def complaint(rows: list[Row]) -> str:
    """What did not come to its end; empty if all did."""
    return ", ".join(f"{row.body} {row.variant} at {row.strain:.0e}" for row in rows if row.ended != FINISHED)
