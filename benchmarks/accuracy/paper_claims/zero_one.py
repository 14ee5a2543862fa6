"""Remark 6.1 and Figure 12: the femur with n = 2 and m = 0."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import growthx as gx
from benchmarks.accuracy.paper_claims.claim import OPEN, Claim, Numbers, decide, row, values
from benchmarks.stability.study import EMPTIED, STUCK, March, march, share
from growthx.baselines import checkerboard_index
from growthx.discretisation.discretisation import Discretisation

BOUNDS = (0.12, 2.4)  # g/cm³, a tenth of ρ* and twice ρ*: below and above them are zeros and ones
LONG = 800.0  # until no share changes any more between bounds
HALF = 0.1  # of the time, about the half
NEIGHBOURS = 2.0  # times the index of the well-posed model: a tendency to checkerboards


@cache
def _ill_posed(variant: gx.Variant) -> March:
    """With m = 0, as far as it comes of t = 160."""
    return march(gx.scenes.femur(m=0.0), variant)


@cache
def _between_bounds(variant: gx.Variant) -> Discretisation:
    scene = gx.scenes.femur(m=0.0, until=LONG)
    return march(replace(scene, growth=replace(scene.growth, bounds=BOUNDS)), variant).problem


def _zeros_and_ones(problem: Discretisation) -> dict[str, float]:
    """Shares of the volume at or beyond the bounds."""
    low = share(problem, lambda rho: rho <= BOUNDS[0] * (1 + 1e-9))
    high = share(problem, lambda rho: rho >= BOUNDS[1] * (1 - 1e-9))
    return {"share of zeros": low, "share of ones": high, "share of grey": 1 - low - high}


def _no_grey(numbers: Numbers) -> bool:
    return numbers["share of grey"] < 0.15


def _told_shares(numbers: Numbers) -> str:
    zeros, ones, grey = numbers.values()
    return f"{zeros:.0%} of the volume are below 0.12 g/cm³, {ones:.0%} above 2.4, and {grey:.0%} between"


def _checkerboards() -> dict[str, float]:
    return {
        "m = 0, last state: checkerboard index": checkerboard_index(_ill_posed(gx.Q1P0).problem),
        "m = 0, between bounds: checkerboard index": checkerboard_index(_between_bounds(gx.Q1P0)),
        "m = 3: checkerboard index": checkerboard_index(gx.solve(gx.scenes.femur(), gx.Q1P0).problem),
    }


def _end() -> dict[str, float]:
    run = _ill_posed(gx.Q1P0)
    return {
        "reached t, of 160": run.time,
        "share of the time": run.time / 160,
        "failed steps": float(run.rejected),
        "for want of a positive density": float(run.ended == EMPTIED),
        "for want of convergence of the displacements": float(run.ended == STUCK),
        "lowest density, g/cm³": run.problem.density_range()[0],
    }


def _likewise() -> dict[str, float]:
    found = {}
    for variant in (gx.Q1P0, gx.Q1sri):
        run = _ill_posed(variant)
        found[f"{variant.name}: reached t"] = run.time
        found[f"{variant.name}: checkerboard index"] = checkerboard_index(run.problem)
        found |= {f"{variant.name}: {what}": value for what, value in _zeros_and_ones(run.problem).items()}
        found[f"{variant.name}: grey between bounds"] = _zeros_and_ones(_between_bounds(variant))["share of grey"]
    return found


def _same_end(numbers: Numbers) -> bool:
    """The time and the index within 5 %, the shares of the volume within 2 % of it."""
    (time, index, *shares), (other_time, other_index, *others) = row(numbers, "Q1P0"), row(numbers, "Q1sri")
    return (
        abs(time / other_time - 1) < 0.05
        and abs(index / other_index - 1) < 0.05
        and all(abs(a - b) < 0.02 for a, b in zip(shares, others, strict=True))
    )


CLAIMS = (
    Claim(
        "zero-one-at-the-end",
        "§6, R6.1, F12",
        "With n = 2, m = 0 the last converged state of Q1P0 is a field of zeros and ones.",
        lambda: _zeros_and_ones(_ill_posed(gx.Q1P0).problem),
        decide(_no_grey, _told_shares, _told_shares),
    ),
    Claim(
        "zero-one-between-bounds",
        "§6, R6.1",
        "With n = 2, m = 0 densities that may go on become zeros and ones.",
        lambda: _zeros_and_ones(_between_bounds(gx.Q1P0)),
        decide(
            _no_grey,
            lambda numbers: (
                f"at t = {LONG:g}, between bounds that take the place of zero and one: {_told_shares(numbers)}; "
                "[the page on the remark](../benchmarks/results/zero_one.md) has meshes and steps"
            ),
            _told_shares,
        ),
    ),
    Claim(
        "checkerboards",
        "§6, R6.1, F12",
        "There is a tendency to checkerboards.",
        _checkerboards,
        decide(
            lambda numbers: min(values(numbers, "m = 0")) > NEIGHBOURS * row(numbers, "m = 3")[0],
            "from one cell to the next the density jumps more than twice as much as that of the well-posed model",
            "from one cell to the next the density does not jump twice as much as that of the well-posed model",
        ),
    ),
    Claim(
        "loss-of-convergence",
        "§6, R6.1",
        "The run stops by loss of convergence.",
        _end,
        decide(
            lambda numbers: numbers["share of the time"] < 1 and numbers["failed steps"] > 0,
            "it ends by itself: ever shorter steps fail since no positive density balances the mass, which the Newton "
            "method of the paper sees as loss of convergence",
            "it comes to its end",
        ),
    ),
    Claim(
        "after-half-the-time",
        "§6, R6.1",
        "It stops after half of the time.",
        _end,
        decide(
            lambda numbers: abs(numbers["share of the time"] - 0.5) < HALF,
            "of the time of the other pictures",
            lambda numbers: (
                f"ours after {numbers['share of the time']:.0%}; of which time and with what thickness, which the "
                "density's rate depends on, the paper does not tell"
            ),
            OPEN,
        ),
    ),
    Claim(
        "q1sri-likewise",
        "§6, R6.1",
        "Q1sri behaves likewise.",
        _likewise,
        decide(
            _same_end,
            "it ends when and as Q1P0 does: time and index within 5 %, shares of the volume within 2 % of it",
            "it ends at another time or in another state",
        ),
    ),
)
