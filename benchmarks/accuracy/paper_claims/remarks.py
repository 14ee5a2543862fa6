"""Remarks 3.2, 3.3, 4.2 and 4.3, and other problems of section 7: flux, stimuli, inertia, lumping, damage."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

import growthx as gx
from benchmarks.accuracy.paper_claims.bars import INNER
from benchmarks.accuracy.paper_claims.claim import OPEN, Claim, Numbers, decide, row, values
from benchmarks.accuracy.paper_claims.newton import free_tangent
from growthx.scenes.bar import DISCONTINUOUS, bar, lower_edge

FEMUR_WAVE = 0.2 / np.sqrt(5e8 / 1200.0)  # s: 0.2 m at √(E/ρ*), E = 500 MPa, ρ* = 1.2 g/cm³
FEMUR_GROWTH = 120 * 86400.0  # s: ρ*/(cΨ₀*) = 120 units of time, of a day each
CONDUCTION = 1e-3
BALANCED = 1e-9
FAR_WORSE = 100.0


# -- mass flux ---------------------------------------------------------------------------------------------------------


def _bar_of(length: float, conduction: float | None) -> gx.Scene:
    """The stepped bar of another length, its stimulus with it."""
    scene = bar(DISCONTINUOUS, 100)
    scene.mesh.domain.geometry.x[:] *= length
    law: Any = scene.growth
    growth = replace(law, attractor=lambda x: DISCONTINUOUS.attractor(x[0] / length))
    return replace(scene, growth=growth, flux=None if conduction is None else gx.MassFlux(conduction))


@cache
def _fronts() -> dict[str, float]:
    """Peaks, and widths of the front at x = 0.4 of the length."""
    found = {}
    places = lower_edge(DISCONTINUOUS)
    low, high = INNER[DISCONTINUOUS.name]
    places = places[(places[:, 0] > low) & (places[:, 0] < high)]
    here = (places[:, 0] > 0.35) & (places[:, 0] < 0.45)
    for conduction in (None, CONDUCTION):
        for length in (1.0, 0.25):
            done = gx.solve(_bar_of(length, conduction), gx.Q1Q1).problem
            density = done.sample_density(length * places)
            steepest = np.abs(np.gradient(density[here], places[here, 0])).max()
            what = f"{'no flux' if conduction is None else 'flux'}, length {length:g}"
            found[f"{what}: width of a front over the length"] = float(np.ptp(density[here]) / steepest)
            found[f"{what}: peak density"] = float(density.max())
    return found


def _smooths(numbers: Numbers) -> bool:
    return row(numbers, "flux, length 1")[0] > 2 * row(numbers, "no flux, length 1")[0]


def _has_a_size(numbers: Numbers) -> bool:
    without, with_it = (
        abs(row(numbers, f"{what}, length 1")[1] - row(numbers, f"{what}, length 0.25")[1])
        for what in ("no flux", "flux")
    )
    return with_it > 1e-3 > 10 * without


def _taken() -> dict[str, float]:
    found = {}
    for variant in gx.variants.suited("quadrilateral"):
        try:
            gx.discretise(_bar_of(1.0, CONDUCTION), variant)
            found[f"{variant.name}: takes a flux"] = 1.0
        except gx.InputError:
            found[f"{variant.name}: takes a flux"] = 0.0
        found[f"{variant.name}: continuous density"] = float(not variant.density.local)
    return found


# -- stimuli -----------------------------------------------------------------------------------------------------------


def _driven_by(law: gx.MassSource) -> dict[str, float]:
    result = gx.solve(replace(gx.scenes.plate(8), growth=law), gx.Q1)
    low, high = result.problem.density_range()
    return {
        "reached t, of 2.5": result.time,
        "largest mass defect of a step": max(step.mass_defect for step in result.steps),
        "lowest density": low,
        "highest density": high,
    }


def _grows(numbers: Numbers) -> bool:
    return (
        numbers["reached t, of 2.5"] == 2.5
        and numbers["largest mass defect of a step"] < BALANCED
        and numbers["lowest density"] < 1 < numbers["highest density"]
    )


def _dissipated() -> dict[str, float]:
    """What a cycle of load leaves of the displacements on the way, without growth: a hysteresis."""
    scene = gx.scenes.plate(8)
    load = replace(scene.loads[0], history=lambda t: min(t, 2.0 - t))  # type: ignore[type-var]
    scene = replace(scene, loads=(load,), growth=scene.growth.without_growth(), program=gx.Program(0.25, 1.75))
    problem, moved = gx.discretise(scene, gx.Q1), {}
    for step in gx.march(scene, gx.Q1, problem):
        moved[round(step.time, 6)] = problem.displacement.x.array.copy()
    gap = max(np.abs(moved[t] - moved[2.0 - t]).max() for t in (0.25, 0.5, 0.75))
    return {"hysteresis over the largest displacement": float(gap / np.abs(moved[1.0]).max())}


# -- inertia -----------------------------------------------------------------------------------------------------------


def _scales() -> dict[str, float]:
    return {
        "femur, time of growth in s": FEMUR_GROWTH,
        "femur, time of a wave in s": FEMUR_WAVE,
        "the one over the other": FEMUR_GROWTH / FEMUR_WAVE,
    }


def _conditions() -> dict[str, float]:
    """Of the tangent of a step of the plate, where a wave takes about 2, with steps down from that of growth."""
    found = {}
    for variant in (gx.Q1, gx.Q1Q1):
        for step in (1e10, 1e2, 1e-1, 1e-2, 1e-3):
            for name, inertia in (("quasi-static", None), ("with inertia", gx.Inertia())):
                scene = gx.scenes.plate(4)
                # Growth as slow as the step is long: as in bone, a step changes the density by the same share.
                law: Any = scene.growth
                growth = replace(law, rate=law.rate * scene.program.step / step)
                problem = gx.discretise(replace(scene, inertia=inertia, growth=growth), variant)
                problem.system.begin_step(step, 0.1)
                problem.system.out_of_balance()
                condition = float(np.linalg.cond(free_tangent(problem)))
                found[f"{variant.name}, Δt = {step:g}: condition, {name}"] = condition
    return found


def _times_worse(numbers: Numbers, name: str) -> list[float]:
    """Conditions with inertia over those without, from long steps to short ones."""
    still, moving = (
        [value for label, value in numbers.items() if label.startswith(f"{name}, ") and label.endswith(of)]
        for of in ("quasi-static", "with inertia")
    )
    return [b / a for a, b in zip(still, moving, strict=True)]


def _blocks_apart(numbers: Numbers) -> str:
    nodal, local = _times_worse(numbers, "Q1Q1"), _times_worse(numbers, "Q1")
    return (
        "in steps that are short against a wave, where the unknowns of Q1Q1 have blocks that go with Δt⁻² and Δt⁻¹, "
        f"the condition of the tangent is up to {max(nodal):.2g} times that of the quasi-static one; in steps of "
        f"growth it is {nodal[0]:.3g} times that, and that of Q1, whose densities are eliminated, {max(local):.2g} "
        "times at most"
    )


# -- lumping -----------------------------------------------------------------------------------------------------------


@cache
def _lumping() -> dict[str, float]:
    places = lower_edge(DISCONTINUOUS)
    places = places[(places[:, 0] > 0.3) & (places[:, 0] < 0.7)]
    found = {}
    for until in (0.3, 6.0):
        scene = bar(DISCONTINUOUS, 100, until=until)
        level = float(gx.solve(scene, gx.Q1P0).problem.sample_density(np.array([[0.45, -0.004]]))[0])
        for variant in (gx.Q1Q1, gx.S2Q1):
            for each in (variant, variant.lumped(), variant.lumped(with_source=True)):
                highest = float(gx.solve(scene, each).problem.sample_density(places).max())
                found[f"{each.name}: overshoot at t = {until:g}"] = highest - level
    return found


def _damps(numbers: Numbers, when: str) -> bool:
    """Whether the lumped matrix alone leaves less than half, for both elements."""
    return all(
        numbers[f"{name} lumped: overshoot at t = {when}"] < 0.6 * numbers[f"{name}: overshoot at t = {when}"]
        for name in ("Q1Q1", "S2Q1")
    )


# -- other problems ----------------------------------------------------------------------------------------------------


def _diffusion() -> dict[str, float]:
    """A wave of density or heat on the unit length, without a source, decays as exp(−π² D t)."""
    scene, conduction, until = bar(DISCONTINUOUS, 40), 0.1, 1.0
    start = 1.0, 0.5
    scene = replace(
        scene,
        loads=(),
        growth=scene.growth.without_growth(),
        flux=gx.MassFlux(conduction),
        initial_density=lambda x: start[0] + start[1] * np.cos(np.pi * x[0]),
        program=gx.Program(0.005, until),
    )
    done = gx.solve(scene, gx.Q1Q1).problem
    left, right = done.sample_density(np.array([[1e-9, 0.0], [1 - 1e-9, 0.0]]))
    kept = float(left - right) / (2 * start[1])
    return {"wave that is left": kept, "exp(−π² D t)": float(np.exp(-(np.pi**2) * conduction * until))}


@dataclass(frozen=True)
class Damage(gx.MassSource):
    """Stiffness, [ρ/ρ*]ⁿ, is lost at a rate in proportion to the square of the energy, and never regained."""

    rate: float = 50.0

    coefficients = ("rate",)

    def mass_source(self, density: Any, elastic_energy: Any, material: Any) -> Any:
        """R₀ = −c ρ (Ψ₀ⁿᵉᵒ)²."""
        return -self.rate * density * elastic_energy**2

    def resting_rate(self, material: Any) -> Any:
        """The rate at the energy of the stiffness."""
        return self.rate * material.reference_density


def _damage() -> dict[str, float]:
    """By either strategy, and spread by a flux."""
    found: dict[str, float] = {}
    for name, variant, flux in (
        ("Q1", gx.Q1, None),
        ("Q1Q1 lumped", gx.Q1Q1.lumped(with_source=True), gx.MassFlux(1e-3)),
    ):
        scene = replace(gx.scenes.plate(8), growth=Damage(), flux=flux)
        result = gx.solve(scene, variant)
        low, high = result.problem.density_range()
        found |= {f"{name}: reached t, of 2.5": result.time, f"{name}: lowest": low, f"{name}: highest": high}
        found[f"{name}: largest mass defect"] = max(step.mass_defect for step in result.steps)
    return found


def _damaged(numbers: Numbers) -> bool:
    return (
        min(values(numbers, "reached t")) == 2.5
        and max(values(numbers, "highest")) < 1 + 1e-6
        and max(values(numbers, "lowest")) < 0.999
        and max(values(numbers, "defect")) < BALANCED
    )


CLAIMS = (
    Claim(
        "flux-smooths",
        "R3.2",
        "A mass flux smooths.",
        _fronts,
        decide(_smooths, "with it a front is more than twice as wide", "with it a front is not twice as wide"),
    ),
    Claim(
        "flux-has-a-size-effect",
        "R3.2",
        "A mass flux gives a size effect.",
        _fronts,
        decide(
            _has_a_size,
            "with it the peak depends on the length of the bar, without it does not",
            "the peak depends on the length of the bar with and without it, or not at all",
        ),
    ),
    Claim(
        "flux-needs-continuity",
        "R3.2",
        "A mass flux needs a continuous density.",
        _taken,
        decide(
            lambda numbers: values(numbers, "takes a flux") == values(numbers, "continuous density"),
            "the elements with one take it, the others have no gradient of the density to drive it and refuse",
            "elements without one take it, too, or those with one do not",
        ),
    ),
    *(
        Claim(
            f"{name}-stimulus",
            "R3.3",
            f"A stimulus based on {name} is possible.",
            lambda law=law: _driven_by(law),  # type: ignore[misc]
            decide(
                _grows, "the plate grows and is resorbed under it to the end, in balance", "the plate does not grow"
            ),
        )
        for name, law in (
            ("strain", gx.StrainDrivenGrowth(0.2, rate=1.0, exponent=3.0)),
            ("stress", gx.StressDrivenGrowth(0.1, rate=1.0, exponent=3.0)),
        )
    ),
    Claim(
        "dissipation-stimulus",
        "R3.3",
        "A stimulus based on dissipation is possible.",
        _dissipated,
        decide(
            lambda numbers: max(numbers.values()) > 1e-6,
            "the material dissipates energy that could drive it",
            "the paper's material dissipates nothing in a cycle of load, so that there is no such stimulus to be "
            "tried; its law would be a `gx.MassSource`",
            OPEN,
        ),
    ),
    Claim(
        "time-scales",
        "R4.2",
        "The time scales of growth and of waves are far apart.",
        _scales,
        decide(
            lambda numbers: numbers["the one over the other"] > 1e6,
            "in the femur by ten orders, where its unit of time is a day",
            "by less than six orders",
        ),
    ),
    Claim(
        "inertia-ill-conditioned",
        "R4.2",
        "The system with inertia is ill-conditioned.",
        _conditions,
        decide(
            lambda numbers: max(_times_worse(numbers, "Q1Q1")) > FAR_WORSE,
            _blocks_apart,
            "the condition of a step's tangent is nowhere more than a hundred times that of the quasi-static one",
        ),
    ),
    Claim(
        "lumping",
        "R4.3",
        "Lumping the matrix of densities damps overshoots.",
        _lumping,
        decide(
            lambda numbers: _damps(numbers, "0.3"),
            lambda numbers: (
                "while densities change, at t = 0.3, it leaves less than 0.6 of them; near equilibrium, at t = 6, "
                + (
                    "it does as well"
                    if _damps(numbers, "6")
                    else "they are of the source, only lumping that, too, does"
                )
            ),
            "while densities change, at t = 0.3, it leaves more than 0.6 of them",
        ),
    ),
    Claim(
        "diffusion-and-heat",
        "§7",
        "Other problems of two fields can be treated so: diffusion, conduction of heat.",
        _diffusion,
        decide(
            lambda numbers: abs(values(numbers, "wave")[0] / values(numbers, "exp")[0] - 1) < 0.02,
            "without a source the density is a concentration, or a temperature: a wave of it decays as it must, within "
            "2 %",
            "a wave of density does not decay as it must",
        ),
    ),
    Claim(
        "damage",
        "§7",
        "Other problems of two fields can be treated so: damage.",
        _damage,
        decide(
            _damaged,
            "with a law of one's own a plate loses stiffness where it is strained, by either strategy, in balance "
            "and to the end",
            "a plate with a law of damage does not come to the end in balance",
        ),
    ),
)
