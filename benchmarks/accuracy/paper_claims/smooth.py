"""Sections 4.4.2, 5.4 and 7: a smooth density, along the tapered bar, and which element is for what."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

import growthx as gx
from benchmarks.accuracy.paper_claims.bars import (
    FINE,
    LOCAL,
    MESHES,
    NODAL,
    density,
    distance,
    exact,
    order,
    solved,
)
from benchmarks.accuracy.paper_claims.claim import Claim, Numbers, column, decide, largest, row
from growthx.scenes.bar import (
    CONTINUOUS,
    DISCONTINUOUS,
    bar,
    end_displacement,
    equilibrium,
    midpoint_density_change,
)

USELESS = 10.0  # per cent of the density change at mid-length, which the tables tell
GOOD = 0.5  # per cent of the density, in L²
CONVERGED = 0.1


def _distances(variants: Iterable[gx.Variant], meshes: tuple[int, ...] = MESHES) -> dict[str, float]:
    return {f"{v.name}: % off at {n}": 100 * distance(CONTINUOUS, n, v) for v in variants for n in meshes}


def _midpoints(variants: Iterable[gx.Variant]) -> dict[str, float]:
    right = float(equilibrium(bar(CONTINUOUS, 10), CONTINUOUS, 0.5).density) - 1
    return {
        f"{v.name}: % off at mid-length at {n}": 100
        * abs(midpoint_density_change(solved(CONTINUOUS, n, v).problem) / right - 1)
        for v in variants
        for n in MESHES
    }


def _orders() -> dict[str, float]:
    found = _distances((gx.Q1P0, *NODAL))
    for name in [variant.name for variant in (gx.Q1P0, *NODAL)]:
        coarse, _, fine = row(found, name)
        found[f"{name}: order"] = order(coarse, fine, 10)
    return found


def _q1_and_q1sri() -> dict[str, float]:
    found = {}
    for problem in (DISCONTINUOUS, CONTINUOUS):
        for n in MESHES:
            one, other = (solved(problem, n, variant).problem for variant in (gx.Q1, gx.Q1sri))
            label = f"{problem.name}, {n} elements"
            found[f"{label}: % of the end displacement"] = 100 * abs(
                end_displacement(one) / end_displacement(other) - 1
            )
            apart = density(problem, n, gx.Q1) - density(problem, n, gx.Q1sri)
            found[f"{label}: % of the density"] = 100 * float(np.linalg.norm(apart) / np.linalg.norm(exact(problem)))
    return found


def _apart() -> dict[str, float]:
    """Q1Q1 and Q1, in L² and relative, in per cent."""
    found = {}
    for problem in (DISCONTINUOUS, CONTINUOUS):
        for n in FINE:
            gap = density(problem, n, gx.Q1Q1) - density(problem, n, gx.Q1)
            found[f"{problem.name}: % apart at {n}"] = 100 * float(np.linalg.norm(gap) / np.linalg.norm(exact(problem)))
    return found


def _fall(numbers: Numbers) -> bool:
    return all(
        list(each) == sorted(each, reverse=True) and each[-1] < GOOD
        for each in (row(numbers, problem.name) for problem in (DISCONTINUOUS, CONTINUOUS))
    )


# Of each strategy: an element of higher order, and those of lower order on as fine a mesh as its unknowns allow.
RIVALS = (
    ((gx.Q2Q2, 10), ((gx.Q1Q1, 30), (gx.S2Q1, 10), (gx.Q1P0, 40))),
    ((gx.Q2Q2, 40), ((gx.Q1Q1, 120), (gx.S2Q1, 60), (gx.Q1P0, 180))),
    ((gx.Q2, 10), ((gx.Q1, 30), (gx.Q1sri, 30), (gx.S2fri, 10))),
    ((gx.Q2, 40), ((gx.Q1, 120), (gx.Q1sri, 120), (gx.S2fri, 40))),
)


def _rivals(strategy: tuple[gx.Variant, ...]) -> dict[str, float]:
    """Distances with about as many unknowns."""
    found = {}
    for high, low in RIVALS:
        for variant, n in (high, *low) if high[0] in strategy else ():
            label = f"{high[0].name} of {high[1]} against {variant.name} of {n}"
            found[f"{label}: unknowns"] = float(solved(CONTINUOUS, n, variant).problem.dofs)
            for problem in (DISCONTINUOUS, CONTINUOUS):
                found[f"{label}: % off, {problem.name}"] = 100 * distance(problem, n, variant)
    return found


def _won(numbers: Numbers, problem: str) -> tuple[int, int]:
    """Of the cases, in how many the element of lower order is the nearer one, and how many there are."""
    off = column(numbers, f"% off, {problem}")
    cases = [label for label in off if label.split()[0] != label.split()[4]]
    beaten = {label: off[" ".join((*label.split()[:3], "against", *label.split()[:3]))] for label in cases}
    return sum(off[label] < beaten[label] for label in cases), len(cases)


def _lower_wins(numbers: Numbers) -> bool:
    (a, of_a), (b, of_b) = _won(numbers, "discontinuous"), _won(numbers, "continuous")
    return 2 * (a + b) > of_a + of_b


def _score(numbers: Numbers) -> str:
    (a, of_a), (b, of_b) = _won(numbers, "discontinuous"), _won(numbers, "continuous")
    return (
        f"with about as many unknowns the lower order is nearer to the semi-analytic density in {a} of {of_a} cases at "
        f"jumps and in {b} of {of_b} where all is smooth"
    )


def _always_a_better_one(numbers: Numbers) -> bool:
    """Whether Q2Q2 has a rival of lower order that is nearer, on either bar and with either count of unknowns."""
    found = []
    for problem in ("discontinuous", "continuous"):
        off = column(numbers, f"% off, {problem}")
        for label in (each for each in off if each.count("Q2Q2") == 2):
            rivals = [value for each, value in off.items() if each.split()[:3] == label.split()[:3] and each != label]
            found.append(min(rivals) < off[label])
    return all(found)


CLAIMS = (
    Claim(
        "continuous-for-smooth",
        "§4.4.2, F3",
        "Continuous densities do equally well for the smooth problem.",
        lambda: _distances(NODAL),
        decide(
            lambda numbers: max(numbers.values()) < GOOD,
            lambda numbers: (
                "all are within 0.5 % of the semi-analytic density in L² on every mesh; to a closer look S2Q1 is "
                f"{row(numbers, 'Q1Q1')[0] / row(numbers, 'S2Q1')[0]:.0f} times nearer than Q1Q1 on 10 elements, and "
                "Q2Q2 stays where it is"
            ),
            "not all are within 0.5 % of the semi-analytic density in L² on every mesh",
        ),
    ),
    Claim(
        "converged-at-40",
        "§4.4.2",
        "Continuous densities are converged at 40 elements.",
        lambda: _distances(NODAL, (40, 100)),
        decide(
            lambda numbers: max(column(numbers, "% off at 40").values()) < CONVERGED,
            "all are within 0.1 % of the semi-analytic density in L²",
            "not all are within 0.1 % of the semi-analytic density in L²",
        ),
    ),
    Claim(
        "q1p0-useless-on-10",
        "§4.4.2",
        "Q1P0 is useless for the smooth problem on 10 elements.",
        lambda: _midpoints((gx.Q1P0, *NODAL)),
        decide(
            lambda numbers: row(numbers, "Q1P0")[0] > USELESS > max(row(numbers, v.name)[0] for v in NODAL),
            "its density change at mid-length, which the tables tell, is off by more than a tenth, that of the "
            "continuous ones by less",
            "its density change at mid-length, which the tables tell, is not off by more than a tenth",
        ),
    ),
    Claim(
        "q1p0-converges-rapidly",
        "§4.4.2",
        "Q1P0 converges rapidly for the smooth problem.",
        _orders,
        decide(
            lambda numbers: numbers["Q1P0: order"] > 1.5,
            "from 10 to 100 elements at more than first order",
            lambda numbers: (
                f"from 10 to 100 elements at the order {numbers['Q1P0: order']:.2f}, as constants in "
                f"cells can at best; Q1Q1 at {numbers['Q1Q1: order']:.1f}, S2Q1 at {numbers['S2Q1: order']:.1f}"
            ),
        ),
    ),
    Claim(
        "points-for-smooth-at-40",
        "§5.4, F6",
        "All integration-point elements do remarkably well for the smooth problem.",
        lambda: _distances(LOCAL),
        decide(
            lambda numbers: max(column(numbers, "% off at 40").values()) < GOOD,
            "within 0.5 % of the semi-analytic density in L² on 40 elements",
            "not all within 0.5 % of the semi-analytic density in L² on 40 elements",
        ),
    ),
    Claim(
        "points-for-smooth-on-10",
        "§5.4, F6",
        "All integration-point elements do so on 10 elements, where Q1P0 is useless.",
        lambda: _midpoints(LOCAL),
        decide(
            lambda numbers: max(column(numbers, "% off at mid-length at 10").values()) < USELESS,
            "by the measure by which Q1P0 is useless there all are good",
            lambda numbers: (
                "by the measure by which Q1P0 is useless there, "
                + " and ".join(n for n, v in column(numbers, "% off at mid-length at 10").items() if v > USELESS)
                + " are as far off as it is"
            ),
        ),
    ),
    Claim(
        "q1-and-q1sri",
        "§5.4",
        "Q1 and Q1sri differ little.",
        _q1_and_q1sri,
        decide(
            lambda numbers: max(numbers.values()) < GOOD,
            lambda numbers: f"by {largest(numbers, '')} % at most, on 10 elements",
            "by more than 0.5 %",
        ),
    ),
    Claim(
        "nodes-for-smooth",
        "§7",
        "Node-based elements are better for smooth solutions.",
        lambda: _distances((*NODAL, gx.Q1P0, *LOCAL)),
        decide(
            lambda numbers: all(
                max(off[v.name] for v in NODAL) < min(off[v.name] for v in LOCAL)
                for off in (column(numbers, f"% off at {n}") for n in MESHES)
            ),
            "every continuous density is nearer than every one at integration points on every mesh; not Q1P0, which is "
            "node-based by the paper's count alone",
            "not every continuous density is nearer than every one at integration points on every mesh",
        ),
    ),
    Claim(
        "alike-on-refinement",
        "§7",
        "Both strategies give the same on refinement.",
        _apart,
        decide(
            _fall,
            "the distance between Q1Q1 and Q1 in L² falls with every mesh; not the overshoots at jumps, see "
            "overshoots-stay",
            "the distance between Q1Q1 and Q1 in L² does not fall with every mesh",
        ),
    ),
    Claim(
        "lower-order",
        "§7",
        "Lower order is superior in most cases.",
        lambda: _rivals((gx.Q2Q2, gx.Q2)),
        decide(_lower_wins, _score, _score),
    ),
    Claim(
        "q2q2-not-recommended",
        "§7",
        "Q2Q2 is not recommended.",
        lambda: _rivals((gx.Q2Q2,)),
        decide(
            _always_a_better_one,
            lambda numbers: f"on either bar some element of lower order is always nearer: {_score(numbers)}",
            lambda numbers: f"no element of lower order is always nearer: {_score(numbers)}",
        ),
    ),
)
