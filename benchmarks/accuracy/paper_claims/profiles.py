"""Sections 4.4, 5.4 and 7: densities along the stepped and the tapered bar."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import growthx as gx
from benchmarks.accuracy.paper_claims.bars import (
    LOCAL,
    MESHES,
    NODAL,
    front_width,
    jump_error,
    overshoot,
    smooth_error,
    solved,
)
from benchmarks.accuracy.paper_claims.claim import Claim, Numbers, holds_if, values
from growthx.scenes.bar import CONTINUOUS, DISCONTINUOUS, bar, end_displacement, equilibrium, midpoint_density_change

FINE = (*MESHES, 400)


def _over(variants: tuple[gx.Variant, ...], meshes: tuple[int, ...] = FINE) -> dict[str, float]:
    return {f"{v.name}, {n} elements: overshoot": overshoot(n, v) for v in variants for n in meshes}


def _errors(variants: tuple[gx.Variant, ...], meshes: tuple[int, ...] = MESHES) -> dict[str, float]:
    return {f"{v.name}, {n} elements: distance from the plateaus": jump_error(n, v) for v in variants for n in meshes}


def _smooth(variants: tuple[gx.Variant, ...], meshes: tuple[int, ...] = MESHES) -> dict[str, float]:
    return {f"{v.name}, {n} elements: distance, tapered": smooth_error(n, v) for v in variants for n in meshes}


def _load() -> dict[str, float]:
    found = {}
    for traction in (1.0, 2.0):
        scene = bar(DISCONTINUOUS, 40)
        problem = gx.solve(replace(scene, loads=(gx.Traction("right", (traction, 0.0)),)), gx.Q1).problem
        found[f"traction {traction:g}: end displacement less the paper's"] = end_displacement(problem) - 2.37122
    found["traction 2: elongation in per cent"] = 100 * (
        found["traction 2: end displacement less the paper's"] + 2.37122
    )
    return found


def _midpoints() -> dict[str, float]:
    exact = equilibrium(bar(CONTINUOUS, 10), CONTINUOUS, 0.5).density - 1
    return {
        f"{v.name}, {n} elements: density change at mid-length, off in per cent": 100
        * abs(midpoint_density_change(solved(CONTINUOUS, n, v).problem) / exact - 1)
        for v in (gx.Q1P0, gx.Q1Q1)
        for n in MESHES
    }


def _orders() -> dict[str, float]:
    found = _smooth((gx.Q1P0, gx.Q1Q1))
    for name in ("Q1P0", "Q1Q1"):
        coarse, _, fine = values(found, f"{name},")
        found[f"{name}: order from 10 to 100 elements"] = float(np.log10(coarse / fine))
    return found


def _q1_and_q1sri() -> dict[str, float]:
    found = {}
    for problem in (DISCONTINUOUS, CONTINUOUS):
        one, other = (solved(problem, 40, variant).problem for variant in (gx.Q1, gx.Q1sri))
        ends, densities = map(end_displacement, (one, other)), map(midpoint_density_change, (one, other))
        for what, (a, b) in (("end displacement", tuple(ends)), ("density change at mid-length", tuple(densities))):
            found[f"{problem.name}: {what}, relative difference"] = abs(a / b - 1)  # type: ignore[misc]
    return found


def _least(numbers: Numbers, name: str) -> bool:
    """Whether an element has the least distance on each mesh."""
    return all(
        numbers[f"{name}, {n} elements: distance from the plateaus"]
        == min(values(numbers, f", {n} elements: distance from the plateaus"))
        for n in MESHES
    )


def _worst(numbers: Numbers) -> bool:
    return all(
        numbers[f"Q2Q2, {n} elements: overshoot"] == max(values(numbers, f", {n} elements: overshoot")) for n in FINE
    )


CLAIMS = (
    Claim(
        "load",
        "§4.4",
        "A unit load at both ends stretches the bar to about 250 %.",
        _load,
        holds_if(
            lambda numbers: abs(numbers["traction 1: end displacement less the paper's"]) < 1e-2,
            "a traction of 1 gives another displacement than the tables; a clamped end and a traction of 2 give "
            "theirs, "
            "with an elongation of 237 %",
        ),
    ),
    Claim(
        "overshoots-stay",
        "§4.4.1, F2",
        "Q1Q1 oscillates at fronts, and its overshoots stay on refinement.",
        lambda: _over((gx.Q1Q1,)),
        holds_if(
            lambda numbers: min(numbers.values()) > 0.5 * max(numbers.values()) > 1e-3,
            "overshoot over the highest plateau, in ρ\\*: from 10 to 400 elements it does not even halve",
        ),
    ),
    Claim(
        "s2q1-oscillates-less",
        "§4.4.1",
        "S2Q1 oscillates less than Q1Q1.",
        lambda: _over((gx.Q1Q1, gx.S2Q1)),
        holds_if(
            lambda numbers: all(
                numbers[f"S2Q1, {n} elements: overshoot"] < numbers[f"Q1Q1, {n} elements: overshoot"] for n in FINE
            ),
            "the smaller overshoot on every mesh",
        ),
    ),
    Claim(
        "q2q2-worst",
        "§4.4.1",
        "Q2Q2 is the worst of all at fronts.",
        lambda: _over((*NODAL, gx.Q1P0)),
        holds_if(_worst, "it has the largest overshoot on 10 elements, and Q1Q1 on all finer meshes"),
    ),
    Claim(
        "q2q2-too-smooth",
        "§4.4.1",
        "Q2Q2 is too smooth at fronts.",
        lambda: {
            f"{v.name}, {n} elements: width of the front over a cell's length": n * front_width(n, v)
            for v in (*NODAL, gx.Q1P0)
            for n in MESHES
        },
        holds_if(
            lambda numbers: all(
                numbers[f"Q2Q2, {n} elements: width of the front over a cell's length"]
                == max(values(numbers, f", {n} elements"))
                for n in MESHES
            ),
            "step over steepest slope at x = 0.4: whether its front is the widest on every mesh",
        ),
    ),
    Claim(
        "q1p0-best-at-fronts",
        "§4.4.1",
        "Q1P0 is the best of the node-based elements at fronts.",
        lambda: _errors((*NODAL, gx.Q1P0)),
        holds_if(lambda numbers: _least(numbers, "Q1P0"), "the least distance from the semi-analytic plateaus"),
    ),
    Claim(
        "smooth-at-40",
        "§4.4.2, F3",
        "Continuous densities do equally well for the smooth problem and are converged at 40 elements.",
        lambda: _smooth(NODAL),
        holds_if(
            lambda numbers: max(values(numbers, ", 40 elements")) < 0.01,
            "within 1 % of a converged density at 40 elements (root mean square, ends left out)",
        ),
    ),
    Claim(
        "q1p0-useless-on-10",
        "§4.4.2",
        "Q1P0 is useless for the smooth problem on 10 elements.",
        _midpoints,
        holds_if(
            lambda numbers: values(numbers, "Q1P0, 10")[0] > 10 > values(numbers, "Q1Q1, 10")[0],
            "the density change at mid-length, which the tables tell, is off by more than 10 %, that of Q1Q1 by less",
        ),
    ),
    Claim(
        "q1p0-converges-rapidly",
        "§4.4.2",
        "Q1P0 converges rapidly for the smooth problem.",
        _orders,
        holds_if(
            lambda numbers: numbers["Q1P0: order from 10 to 100 elements"] > 1.5,
            "a density constant in each cell is of first order, and Q1Q1 of a higher one",
        ),
    ),
    Claim(
        "points-at-jumps",
        "§5.4, F5",
        "All integration-point elements do excellently at jumps.",
        lambda: _over(LOCAL),
        holds_if(lambda numbers: max(numbers.values()) < 2e-3, "no overshoot above 0.2 % of ρ\\* on any mesh"),
    ),
    Claim(
        "points-smooth",
        "§5.4, F6",
        "All integration-point elements do remarkably well for the smooth problem.",
        lambda: _smooth(LOCAL),
        holds_if(
            lambda numbers: max(values(numbers, ", 40 elements")) < 0.01,
            "within 1 % of a converged density at 40 elements (root mean square, ends left out)",
        ),
    ),
    Claim(
        "q1-and-q1sri",
        "§5.4",
        "Q1 and Q1sri differ little.",
        _q1_and_q1sri,
        holds_if(
            lambda numbers: max(numbers.values()) < 1e-3, "less than 0.1 % in what the tables tell at 40 elements"
        ),
    ),
    Claim(
        "each-for-its-problem",
        "§7",
        "Node-based elements are better for smooth solutions, integration-point based ones for discontinuous ones.",
        lambda: _errors((gx.Q1Q1, gx.Q1)) | _smooth((gx.Q1Q1, gx.Q1)),
        holds_if(
            lambda numbers: all(
                numbers[f"Q1, {n} elements: distance from the plateaus"]
                < numbers[f"Q1Q1, {n} elements: distance from the plateaus"]
                and numbers[f"Q1Q1, {n} elements: distance, tapered"] < numbers[f"Q1, {n} elements: distance, tapered"]
                for n in MESHES
            ),
            "Q1Q1 and Q1 against the plateaus of the stepped bar and a converged density of the tapered one",
        ),
    ),
    Claim(
        "alike-on-refinement",
        "§7",
        "Both strategies are alike on refinement.",
        lambda: _smooth((gx.Q1Q1, gx.Q1)),
        holds_if(
            lambda numbers: max(values(numbers, ", 100 elements")) < 5e-3,
            "within 0.5 % of the same density at 100 elements; at jumps Q1Q1 keeps its overshoots (see "
            "overshoots-stay)",
        ),
    ),
    Claim(
        "lower-order",
        "§7",
        "Lower order is superior in most cases, and Q2Q2 is not recommended.",
        lambda: {
            "Q2Q2, 10 elements, 189 unknowns: distance from the plateaus": jump_error(10, gx.Q2Q2),
            "Q1Q1, 30 elements, 186 unknowns: distance from the plateaus": jump_error(30, gx.Q1Q1),
            "Q1P0, 40 elements, 164 unknowns: distance from the plateaus": jump_error(40, gx.Q1P0),
            "Q2Q2, 10 elements, 189 unknowns: distance, tapered": smooth_error(10, gx.Q2Q2),
            "Q1Q1, 30 elements, 186 unknowns: distance, tapered": smooth_error(30, gx.Q1Q1),
            "Q1P0, 40 elements, 164 unknowns: distance, tapered": smooth_error(40, gx.Q1P0),
        },
        holds_if(
            lambda numbers: (
                values(numbers, "Q2Q2")[0] > max(values(numbers, "plateaus")[1:])
                and values(numbers, "Q2Q2")[1] > min(values(numbers, "tapered")[1:])
            ),
            "with as many unknowns Q2Q2 is the furthest off at jumps, but the nearest where all is smooth",
        ),
    ),
)
