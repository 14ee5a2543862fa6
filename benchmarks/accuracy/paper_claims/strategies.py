"""Tables 1 and 7, Remarks 4.4 to 5.3 and section 7: both strategies, what Q1P0 and Q1sri differ in, special cases."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

import growthx as gx
from benchmarks.accuracy.paper_claims.bars import MESHES, solved
from benchmarks.accuracy.paper_claims.claim import Claim, Numbers, decide, row, values
from benchmarks.shared.loads import times
from growthx.scenes.bar import CONTINUOUS, DISCONTINUOUS, end_displacement

NODES = 17 * 9  # of the plate with 8 cells over its height
SLIGHT = 2.0  # per cent
SAME = 1e-9


def _chart(variant: gx.Variant) -> dict[str, float]:
    """The strategy by the paper's Newton method, and by growthx's own, which keeps factors."""
    scene = gx.scenes.plate(8)
    full, kept = (gx.solve(scene, variant, full_newton=each) for each in (True, False))
    return {
        "unknowns beside the displacements": float(full.problem.dofs - 2 * NODES),
        "largest mass defect of a step": max(step.mass_defect for step in full.steps),
        "most iterations of a step": float(max(len(step.newton.residual_norms) - 1 for step in full.steps)),
        "growthx's own way changes the density by": float(
            np.abs(full.problem.density.x.array - kept.problem.density.x.array).max()
        ),
    }


def _balanced(numbers: Numbers, unknowns: int) -> bool:
    return numbers["unknowns beside the displacements"] == unknowns and max(values(numbers, "mass defect")) < SAME


def _plate(variant: gx.Variant, factor: float, free: bool) -> gx.Result:
    """The plate under a share of its load or, free of a clamp, pulled homogeneously."""
    scene = gx.scenes.plate(8)
    if free:
        edges = {"left": (0, 0.0), "right": (0, 2.0), "bottom": (1, 0.0)}
        mesh = gx.Mesh.with_names(
            scene.mesh.domain,
            {name: lambda x, at=at: np.isclose(x[at[0]], at[1]) for name, at in edges.items()},  # type: ignore[misc]
        )
        supports = gx.Support("left", (0.0, None)), gx.Support("bottom", (None, 0.0))
        scene = replace(scene, mesh=mesh, supports=supports, loads=(gx.Traction("right", (0.1 * factor, 0.0)),))
    else:
        scene = replace(scene, loads=tuple(times(load, factor) for load in scene.dead_loads))
    # Energies fall with the square of the load: the same growth in the same time.
    growth = replace(scene.growth, attractor=0.02 * factor**2, rate=10.0 / factor**2)
    return gx.solve(replace(scene, growth=growth), variant)


def _apart(factor: float, free: bool) -> float:
    """The largest difference between Q1P0 and Q1sri, in per cent of the highest density."""
    one, other = (_plate(variant, factor, free).problem.density.x.array for variant in (gx.Q1P0, gx.Q1sri))
    return float(100 * np.abs(one - other).max() / np.abs(other).max())


def _homogeneous() -> dict[str, float]:
    return {
        "homogeneous: % of density apart": _apart(1.0, free=True),
        "bent: % of density apart": _apart(1.0, free=False),
    }


def _where_it_shows(what: str) -> dict[str, float]:
    """Differences of the two on the bars."""
    found = {}
    for problem in (DISCONTINUOUS, CONTINUOUS):
        for n in MESHES:
            one, other = (solved(problem, n, variant).problem for variant in (gx.Q1P0, gx.Q1sri))
            gap = {
                "end displacement": end_displacement(other) - end_displacement(one),
                "highest density": other.density_range()[1] - one.density_range()[1],
            }[what]
            found[f"{problem.name}: {what} apart at {n}"] = abs(gap)
    return found


def _hidden(numbers: Numbers, digit: float) -> str:
    """Where a difference is below half of a digit."""
    return ", ".join(label.replace(": ", " bar, ") for label, value in numbers.items() if value < digit / 2)


def _slightly() -> dict[str, float]:
    found = {"bent plate: % of density apart": _apart(1.0, free=False)}
    for problem in (DISCONTINUOUS, CONTINUOUS):
        one, other = (solved(problem, 10, variant).problem.density.x.array for variant in (gx.Q1P0, gx.Q1sri))
        found[f"{problem.name} bar, 10 elements: % of density apart"] = float(100 * np.abs(one / other - 1).max())
    return found


def _small_strains() -> dict[str, float]:
    found = {f"bent, load × {f:g}: % of density apart": _apart(f, free=False) for f in (1.0, 0.1, 0.01)}
    return found | {"homogeneous, load × 0.01: % of density apart": _apart(0.01, free=True)}


def _updates(variant: gx.Variant) -> dict[str, float]:
    """The update of each cell after equilibrium against the implicit strategy, in ever shorter steps."""
    found = {}
    for step in (0.1, 0.05, 0.025):
        scene = replace(gx.scenes.plate(4), program=gx.Program(step=step, until=1.0, ramp=0.5))
        problem = gx.baselines.frozen(scene, variant)
        for _ in gx.baselines.update(scene, variant, problem):
            pass
        implicit = gx.solve(scene, variant).problem.density.x.array
        found[f"Δt = {step:g}: largest difference of density"] = float(np.abs(problem.density.x.array - implicit).max())
    return found


def _halves(numbers: Numbers) -> bool:
    """Whether the difference falls with Δt in proportion."""
    found = list(numbers.values())
    return all(0.4 < b / a < 0.6 for a, b in pairwise(found))


CLAIMS = (
    Claim(
        "node-based-strategy",
        "T1",
        "Node-based: densities at nodes are unknowns beside the displacements, of one Newton method for both.",
        lambda: _chart(gx.Q1Q1),
        decide(
            lambda numbers: _balanced(numbers, NODES),
            "the chart as printed is `--full-newton`; growthx's own way, which keeps factors, gives the same densities",
            "the unknowns are others, or mass is not in balance",
        ),
    ),
    Claim(
        "point-based-strategy",
        "T7",
        "Integration-point based: each density is found by a Newton method of its own, inside that of displacements.",
        lambda: _chart(gx.Q1),
        decide(
            lambda numbers: _balanced(numbers, 0),
            "the chart as printed is `--full-newton`; growthx's own way, which keeps factors, gives the same densities",
            "the unknowns are others, or mass is not in balance",
        ),
    ),
    Claim(
        "q1p0-and-q1sri-homogeneous",
        "R4.4, R5.2",
        "Q1P0 and Q1sri differ by the mean and the midpoint's source, which are the same for homogeneous deformation.",
        _homogeneous,
        decide(
            lambda numbers: row(numbers, "homogeneous")[0] < SAME < row(numbers, "bent")[0],
            "a plate that is pulled is the same in both, one that is bent is not",
            "a plate that is pulled is not the same in both, or one that is bent is",
        ),
    ),
    *(
        Claim(
            f"difference-in-{what.replace(' ', '-')}",
            "R5.3",
            f"The difference of the two shows in the {what}.",
            lambda what=what: _where_it_shows(what),  # type: ignore[misc]
            decide(
                lambda numbers, digit=digit: min(numbers.values()) > digit / 2,  # type: ignore[misc]
                "in the digits that the tables print, on every mesh",
                lambda numbers, digit=digit: (  # type: ignore[misc]
                    f"below half of the last digit that the tables print: {_hidden(numbers, digit)}"
                ),
            ),
        )
        for what, digit in (("highest density", 1e-6), ("end displacement", 1e-5))
    ),
    Claim(
        "q1p0-and-q1sri-differ-slightly",
        "§7",
        "Q1P0 and Q1sri are slightly different at finite strains.",
        _slightly,
        decide(
            lambda numbers: 0 < max(numbers.values()) < SLIGHT,
            "by less than 2 % on the bars and on the plate that is bent",
            "by more than 2 %, or not at all",
        ),
    ),
    Claim(
        "identical-in-linear-elasticity",
        "§7",
        "Q1P0 and Q1sri are absolutely identical in linear elasticity.",
        _small_strains,
        decide(
            lambda numbers: numbers["bent, load × 0.01: % of density apart"] < 1e-3,
            "at small strains the difference vanishes",
            "it stays as strains become small: where strain varies in a cell the mean of the energy is not that at the "
            "midpoint, which are the same in homogeneous cells alone",
        ),
    ),
    *(
        Claim(
            f"update-as-{kind}",
            "§7",
            f"The element-based update is a special case of the {words} strategy.",
            lambda variant=variant: _updates(variant),  # type: ignore[misc]
            decide(
                _halves,
                f"it is {variant.name} by explicit steps, one balance after the other: with Δt the difference falls in "
                "proportion",
                "the difference does not fall with Δt in proportion",
            ),
        )
        for kind, words, variant in (
            ("node-based", "node-based", gx.Q1P0),
            ("point-based", "integration-point based", gx.Q1sri),
        )
    ),
)
