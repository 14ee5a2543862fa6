"""Remarks 3.2 to 5.3 and section 7: flux, stimuli, time scales, lumping, tangents, and what is a special case of "
"what.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from dolfinx.fem import petsc

import growthx as gx
from benchmarks.accuracy.paper_claims.bars import solved
from benchmarks.accuracy.paper_claims.claim import Claim, Numbers, holds_if, undecided, values
from benchmarks.shared.loads import times
from benchmarks.stability.study import BODIES, VARIANTS, at_once, march, named, with_exponents
from growthx.scenes.bar import DISCONTINUOUS, bar, end_displacement, lower_edge
from growthx.solvers.tangent import assemble_tangent

FEMUR_WAVE = 0.2 / np.sqrt(5e8 / 1200.0)  # s: 0.2 m at √(E/ρ*), E = 500 MPa, ρ* = 1.2 g/cm³
FEMUR_GROWTH = 120 * 86400.0  # s: ρ*/(cΨ₀*) = 120 units of time, of a day each

ROUND_OFF = 5e-14  # of the loads: norms of residuals below say nothing of an order
QUADRATIC = 100.0  # at linear convergence by a factor of a thousand this would be 1e4 and more in the last iteration


# -- mass flux, stimuli, inertia, lumping ------------------------------------------------------------------------------


def _bar_of(length: float, conduction: float | None) -> gx.Scene:
    """The stepped bar of another length, its stimulus with it."""
    scene = bar(DISCONTINUOUS, 100)
    scene.mesh.domain.geometry.x[:] *= length
    growth = replace(scene.growth, attractor=lambda x: DISCONTINUOUS.attractor(x[0] / length))
    return replace(scene, growth=growth, flux=None if conduction is None else gx.MassFlux(conduction))


def _peak_and_width(scene: gx.Scene, length: float) -> tuple[float, float]:
    places = lower_edge(DISCONTINUOUS)
    places = places[(places[:, 0] > 0.25) & (places[:, 0] < 0.75)]
    density = gx.solve(scene, gx.Q1Q1).problem.sample_density(length * places)
    here = (places[:, 0] > 0.35) & (places[:, 0] < 0.45)
    slope = np.abs(np.gradient(density[here], places[here, 0])).max()
    return float(density.max()), float(np.ptp(density[here]) / slope)


def _flux() -> dict[str, float]:
    found = {}
    for conduction in (None, 1e-3):
        for length in (1.0, 0.25):
            peak, width = _peak_and_width(_bar_of(length, conduction), length)
            what = f"{'no flux' if conduction is None else f'conduction {conduction:g}'}, length {length:g}"
            found |= {f"{what}: width of a front over the length": width, f"{what}: peak density": peak}
    try:
        gx.discretise(_bar_of(1.0, 1e-3), gx.Q1P0)
        found["Q1P0 takes a flux"] = 1.0
    except gx.InputError:
        found["Q1P0 takes a flux"] = 0.0
    return found


def _flux_holds(numbers: Numbers) -> bool:
    plain, wide = (
        numbers[f"{what}, length 1: width of a front over the length"] for what in ("no flux", "conduction 0.001")
    )
    without, with_it = (
        abs(numbers[f"{what}, length 1: peak density"] - numbers[f"{what}, length 0.25: peak density"])
        for what in ("no flux", "conduction 0.001")
    )
    return wide > 2 * plain and with_it > 1e-3 > 10 * without and numbers["Q1P0 takes a flux"] == 0


def _stimuli() -> dict[str, float]:
    scene = gx.scenes.plate(8)
    laws = {
        "energy": scene.growth,
        "strain": gx.StrainDrivenGrowth(0.2, rate=1.0, exponent=3.0),
        "stress": gx.StressDrivenGrowth(0.1, rate=1.0, exponent=3.0),
    }
    found = {}
    for name, law in laws.items():
        result = gx.solve(replace(scene, growth=law), gx.Q1)
        found[f"{name}: reached t"] = result.time
        found[f"{name}: largest mass defect"] = max(step.mass_defect for step in result.steps)
    return found


def _inertia() -> dict[str, float]:
    found = {"femur: time of growth over that of waves": FEMUR_GROWTH / FEMUR_WAVE}
    for name, inertia in (("quasi-static", None), ("with inertia", gx.Inertia())):
        scene = replace(gx.scenes.plate(4), inertia=inertia)
        problem = gx.discretise(scene, gx.Q1)
        problem.system.begin_step(scene.program.step, 0.1)
        problem.system.out_of_balance()
        matrix = petsc.create_matrix(problem.system.coupling)
        assemble_tangent(problem.system, matrix)
        found[f"plate, {name}: condition of the tangent"] = float(
            np.linalg.cond(matrix.convert("dense").getDenseArray())
        )
        matrix.destroy()
    return found


def _lumping() -> dict[str, float]:
    scene = bar(DISCONTINUOUS, 100)
    early = replace(scene, program=replace(scene.program, until=0.3))
    places = lower_edge(DISCONTINUOUS)
    places = places[(places[:, 0] > 0.3) & (places[:, 0] < 0.7)]
    level = float(gx.solve(early, gx.Q1P0).problem.sample_density(np.array([[0.45, -0.004]]))[0])
    return {
        f"{name}: overshoot at t = 0.3": float(gx.solve(early, variant).problem.sample_density(places).max()) - level
        for name, variant in (
            ("consistent", gx.Q1Q1),
            ("lumped", gx.Q1Q1.lumped()),
            ("lumped with its source", gx.Q1Q1.lumped(source=True)),
        )
    }


# -- condensation, tangents, convergence -------------------------------------------------------------------------------


def _block(variant: gx.Variant, factor: float, free: bool) -> gx.Result:
    """The plate under a share of its load or, free of a clamp, pulled homogeneously."""
    scene = gx.scenes.plate(8)
    if free:
        mesh = gx.Mesh.with_names(
            scene.mesh.domain,
            {
                "left": lambda x: np.isclose(x[0], 0.0),
                "right": lambda x: np.isclose(x[0], 2.0),
                "bottom": lambda x: np.isclose(x[1], 0.0),
            },
        )
        supports = gx.Support("left", (0.0, None)), gx.Support("bottom", (None, 0.0))
        scene = replace(scene, mesh=mesh, supports=supports, loads=(gx.Traction("right", (0.1 * factor, 0.0)),))
    else:
        scene = replace(scene, loads=tuple(times(load, factor) for load in scene.dead_loads))
        # Energies fall with the square of the load: the same growth in the same time.
        scene = replace(scene, growth=replace(scene.growth, attractor=0.02 * factor**2, rate=10.0 / factor**2))
    return gx.solve(scene, variant)


def _apart(factor: float, free: bool) -> float:
    one, other = (_block(variant, factor, free).problem.density.x.array for variant in (gx.Q1P0, gx.Q1sri))
    return float(100 * np.abs(one - other).max() / np.abs(other).max())


def _q1p0_and_q1sri() -> dict[str, float]:
    one, other = (solved(DISCONTINUOUS, 40, variant).problem for variant in (gx.Q1P0, gx.Q1sri))
    return {
        "homogeneous deformation: largest difference of density in per cent": _apart(1.0, free=True),
        "bar, 40 elements: difference of end displacement": end_displacement(other) - end_displacement(one),
        "bar, 40 elements: difference of the highest density": other.density_range()[1] - one.density_range()[1],
        "unknowns of Q1P0 with 10 elements": float(solved(DISCONTINUOUS, 10, gx.Q1P0).problem.dofs),
    }


def _linear_elasticity() -> dict[str, float]:
    found = {
        f"plate, load × {f:g}: largest difference of density in per cent": _apart(f, free=False)
        for f in (1.0, 0.1, 0.01)
    }
    return found | {"homogeneous, load × 0.01: largest difference of density in per cent": _apart(0.01, free=True)}


def _norms(variant: gx.Variant) -> Sequence[float]:
    """Of the step after the load's ramp on the plate, from the state before it."""
    scene = gx.scenes.plate(8)
    steps = gx.march(scene, variant, stepping=gx.FixedSteps(predicted=False), full_newton=True)
    norms = next(step.newton.residual_norms for step in steps if step.time > scene.program.ramp + 1e-9)
    steps.close()
    return norms


def _tangents() -> dict[str, float]:
    found = {}
    for variant in (gx.Q1Q1, gx.Q1, gx.Q1P0, gx.Q1sri):
        norms = [norm for norm in _norms(variant) if norm > ROUND_OFF]
        of_squares = [after / before**2 for before, after in pairwise(norms)]
        found[f"{variant.name}: iterations"] = float(len(norms) - 1)
        found[f"{variant.name}: norm over the square of the one before, at most"] = max(of_squares)
    return found


def _strategies() -> dict[str, float]:
    """What each flow chart is to do: solve for densities beside displacements, or balance each of them locally."""
    found = {}
    for variant in (gx.Q1Q1, gx.Q1):
        scene = gx.scenes.plate(8)
        one, other = (gx.solve(scene, variant, full_newton=full) for full in (True, False))
        found[f"{variant.name}: unknowns beside the displacements"] = float(one.problem.dofs - 2 * 17 * 9)
        found[f"{variant.name}: largest mass defect"] = max(step.mass_defect for step in one.steps)
        found[f"{variant.name}: kept factors change the density by"] = float(
            np.abs(one.problem.density.x.array - other.problem.density.x.array).max()
        )
    return found


# -- stability, special cases, other problems --------------------------------------------------------------------------


def _implicit() -> dict[str, float]:
    found = {}
    for step in (0.1, 10.0, 1e3):
        finished = 0
        for name in VARIANTS:
            scene, stepping = at_once(BODIES["bar"].scene(1), BODIES["bar"], step, 5)
            finished += march(scene, named(name), stepping=stepping).finished
        found[f"Δt = {step:g}: discretisations that come to the end of 5 steps, of 8"] = float(finished)
    return found


def _every_discretisation() -> dict[str, float]:
    found = {}
    for name in VARIANTS:
        each = march(with_exponents(BODIES["plate"].scene(1), 1.0, 2.0), named(name))
        found[f"{name}: reached t, of 10"] = each.time
        found[f"{name}: share of the cells that were lumped"] = each.cells
    return found


def _updates() -> dict[str, float]:
    """The update of each cell after equilibrium against the implicit strategies, in ever shorter steps."""
    found = {}
    for step in (0.1, 0.05, 0.025):
        scene = gx.scenes.plate(4)
        scene = replace(scene, program=gx.Program(step=step, until=1.0, ramp=0.5))
        problem = gx.baselines.frozen(scene, gx.Q1P0)
        for _ in gx.baselines.update(scene, gx.Q1P0, problem):
            pass
        implicit = gx.solve(scene, gx.Q1P0).problem.density.x.array
        found[f"Δt = {step:g}: largest difference of density"] = float(np.abs(problem.density.x.array - implicit).max())
    return found


CLAIMS = (
    Claim(
        "flow-charts",
        "T1, T7",
        "Node-based densities are solved for beside the displacements, others locally at each point.",
        _strategies,
        holds_if(
            lambda numbers: (
                numbers["Q1Q1: unknowns beside the displacements"] == 17 * 9
                and numbers["Q1: unknowns beside the displacements"] == 0
                and max(values(numbers, "mass defect")) < 1e-9
            ),
            "both charts as printed (`--full-newton`); the densities of growthx's own way are the same",
        ),
    ),
    Claim(
        "mass-flux",
        "R3.2",
        "A mass flux smooths, gives a size effect, and needs a continuous density.",
        _flux,
        holds_if(_flux_holds, "wider fronts; peaks that depend on the bar's length; densities that jump are refused"),
    ),
    Claim(
        "stimuli",
        "R3.3",
        "Strain-, stress- and dissipation-based stimuli are possible.",
        _stimuli,
        holds_if(
            lambda numbers: min(values(numbers, "reached t")) == 2.5 and max(values(numbers, "defect")) < 1e-9,
            "by strain and by stress; one by dissipation has no law here, and the place for it is `gx.MassSource`",
        ),
    ),
    Claim(
        "quasi-static",
        "R4.2",
        "Time scales of growth and of waves are far apart, and the system with inertia is ill-conditioned.",
        _inertia,
        undecided(
            "the time scales are ten orders apart; but inertia divided by Δt² adds a positive mass matrix to the "
            "tangent of the displacement, and where we can tell its condition is no worse"
        ),
    ),
    Claim(
        "lumping",
        "R4.3",
        "Lumping the matrix of densities damps overshoots.",
        _lumping,
        holds_if(
            lambda numbers: list(numbers.values()) == sorted(numbers.values(), reverse=True),
            "overshoot of the middle level while the load grows",
        ),
    ),
    Claim(
        "q1p0-and-q1sri",
        "R4.1, R4.4, R5.2, R5.3",
        "Q1P0 by static condensation; it differs from Q1sri by mean and midpoint source, not for homogeneous "
        "deformation; the difference shows in the highest density and the end displacement.",
        _q1p0_and_q1sri,
        holds_if(
            lambda numbers: (
                values(numbers, "homogeneous")[0] < 1e-9
                and min(abs(value) for value in values(numbers, "bar, 40")) > 1e-6
                and numbers["unknowns of Q1P0 with 10 elements"] == 44
            ),
            "displacements are all that is solved for",
        ),
    ),
    Claim(
        "consistent-tangent",
        "R5.1",
        "With the algorithmic derivative Newton's method converges quadratically.",
        _tangents,
        holds_if(
            lambda numbers: max(values(numbers, "square")) < QUADRATIC,
            "with (39), (40) read as [∂R₀/∂ρ − 1/Δt]⁻¹; as printed they lack a Δt between them",
        ),
    ),
    Claim(
        "implicit-steps",
        "§7",
        "Implicit steps are unconditionally stable.",
        _implicit,
        holds_if(
            lambda numbers: set(numbers.values()) == {8.0},
            "[Δt over nine orders](../benchmarks/results/stability.md#time-steps), where the distance from "
            "equilibrium falls in "
            "every step",
        ),
        quick=False,
    ),
    Claim(
        "every-discretisation",
        "§7",
        "A well-posed model, m > n, is stable in every discretisation.",
        _every_discretisation,
        holds_if(
            lambda numbers: not any(values(numbers, "share")) and min(values(numbers, "reached")) == 10,
            "of the plate with m = 2, n = 1, all end well, but a nodal density of S2Q1 would fall to zero were the "
            "balance "
            "not lumped about it; [108 marches](../benchmarks/results/stability.md#exponents)",
        ),
        quick=False,
    ),
    Claim(
        "element-based-update",
        "§7",
        "The element-based update is a special case of either strategy.",
        _updates,
        holds_if(
            lambda numbers: all(
                b < 0.6 * a for a, b in zip(list(numbers.values())[:-1], list(numbers.values())[1:], strict=True)
            ),
            "it is Q1P0 by explicit steps, one after the other: with Δt the difference falls in proportion",
        ),
    ),
    Claim(
        "identical-in-linear-elasticity",
        "§7",
        "Q1P0 and Q1sri are slightly different here but absolutely identical in linear elasticity.",
        _linear_elasticity,
        holds_if(
            lambda numbers: numbers["plate, load × 0.01: largest difference of density in per cent"] < 1e-3,
            "where strain varies in a cell the mean of the energy is not the energy of the mean, however small the "
            "strain; "
            "homogeneous cells are identical",
        ),
    ),
)
