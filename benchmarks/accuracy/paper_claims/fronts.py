"""Sections 4.4.1, 5.4 and 7: densities that jump, along the stepped bar."""

from __future__ import annotations

import growthx as gx
from benchmarks.accuracy.paper_claims.bars import (
    FINE,
    LOCAL,
    MESHES,
    NODAL,
    distance,
    front,
    needless_variation,
    order,
    overshoot,
    solved,
)
from benchmarks.accuracy.paper_claims.claim import Claim, Numbers, column, decide, row
from growthx.scenes.bar import DISCONTINUOUS, bar, equilibrium, midpoint_density_change

NODE_BASED = (*NODAL, gx.Q1P0)
CLEAN = 2e-3  # an overshoot, relative to ρ*, that no picture shows


def _over(variants: tuple[gx.Variant, ...]) -> dict[str, float]:
    return {f"{v.name}: overshoot at {n}": overshoot(n, v) for v in variants for n in FINE}


def _varies(variants: tuple[gx.Variant, ...]) -> dict[str, float]:
    return {f"{v.name}: needless variation at {n}": needless_variation(n, v) for v in variants for n in MESHES}


def _distances(variants: tuple[gx.Variant, ...]) -> dict[str, float]:
    return {f"{v.name}: distance at {n}": distance(DISCONTINUOUS, n, v) for v in variants for n in MESHES}


def _fast() -> dict[str, float]:
    right = float(equilibrium(bar(DISCONTINUOUS, 10), DISCONTINUOUS, 0.55).density) - 1
    found = {}
    for variant in (gx.Q1Q1, gx.S2Q1):
        for n in MESHES:
            change = midpoint_density_change(solved(DISCONTINUOUS, n, variant).problem)
            found[f"{variant.name}: mid-length off at {n}"] = abs(change - right)
        coarse, fine = (distance(DISCONTINUOUS, n, variant) for n in (10, 100))
        found[f"{variant.name}: order of the distance"] = order(coarse, fine, 10)
    return found


def _widths() -> dict[str, float]:
    found: dict[str, float] = {}
    for variant in NODE_BASED:
        for n in MESHES:
            by_slope, off = front(n, variant)
            found |= {f"{variant.name}: by slope at {n}": by_slope, f"{variant.name}: off at {n}": off}
    return found


def _across(numbers: Numbers, what: str) -> dict[str, dict[str, float]]:
    """Of something, the numbers of all elements by the mesh."""
    whats = {label.partition(": ")[2] for label in numbers if f": {what} at " in label}
    return {each.split()[-1]: column(numbers, each) for each in sorted(whats, key=lambda each: int(each.split()[-1]))}


def _most(numbers: Numbers, name: str, what: str) -> list[str]:
    """The meshes on which an element has the most of something."""
    return [mesh for mesh, each in _across(numbers, what).items() if each[name] == max(each.values())]


def _on(meshes: list[str]) -> str:
    return f"on {' and '.join(meshes)} elements" if meshes else "on no mesh"


def _worst_where(numbers: Numbers) -> str:
    leaders = {mesh: max(each, key=lambda name: each[name]) for mesh, each in _across(numbers, "overshoot").items()}
    others = ", ".join(f"{name} at {mesh}" for mesh, name in leaders.items() if name != "Q2Q2")
    return (
        f"its overshoot is the largest {_on(_most(numbers, 'Q2Q2', 'overshoot'))} and its distance from the plateaus "
        f"{_on(_most(numbers, 'Q2Q2', 'distance'))}; elsewhere the largest overshoots are those of {others}"
    )


def _nearest_by_far(numbers: Numbers) -> bool:
    """Whether Q1P0 has less than a tenth of any other's distance on every mesh."""
    return all(
        each["Q1P0"] < 0.1 * min(value for name, value in each.items() if name != "Q1P0")
        for each in _across(numbers, "distance").values()
    )


def _worst_everywhere(numbers: Numbers) -> bool:
    return len(_most(numbers, "Q2Q2", "overshoot")) == len(FINE) and len(_most(numbers, "Q2Q2", "distance")) == 3


CLAIMS = (
    Claim(
        "q1q1-oscillates",
        "§4.4.1, F2",
        "Q1Q1 oscillates at fronts.",
        lambda: _varies((gx.Q1Q1, gx.Q1P0)),
        decide(
            lambda numbers: min(row(numbers, "Q1Q1")) > 0.05 > max(row(numbers, "Q1P0")),
            "its density goes up and down by more than a twentieth beyond the steps on every mesh",
            "it does not go up and down by more than a twentieth beyond the steps on every mesh",
        ),
    ),
    Claim(
        "overshoots-stay",
        "§4.4.1, F2",
        "The overshoots of Q1Q1 stay on refinement.",
        lambda: _over((gx.Q1Q1,)),
        decide(
            lambda numbers: min(numbers.values()) > max(0.5 * max(numbers.values()), CLEAN),
            "over the highest plateau, in ρ\\*: from 10 to 400 elements they do not even halve",
            "over the highest plateau they vanish",
        ),
    ),
    Claim(
        "s2q1-oscillates-less",
        "§4.4.1",
        "S2Q1 oscillates less than Q1Q1.",
        lambda: _over((gx.Q1Q1, gx.S2Q1)),
        decide(
            lambda numbers: all(
                other < one for one, other in zip(row(numbers, "Q1Q1"), row(numbers, "S2Q1"), strict=True)
            ),
            "the smaller overshoot on every mesh, though it stays as well",
            "its overshoot is not the smaller one on every mesh",
        ),
    ),
    Claim(
        "s2q1-converges-fast",
        "§4.4.1",
        "S2Q1 converges fast at fronts.",
        _fast,
        decide(
            lambda numbers: numbers["S2Q1: mid-length off at 10"] > 1e2 * numbers["S2Q1: mid-length off at 100"],
            lambda numbers: (
                "by the density at mid-length, which the tables tell: faster than with the square of the cell; the "
                f"distance from all plateaus falls at the order {numbers['S2Q1: order of the distance']:.1f}, as that "
                "of a continuous density across a jump must"
            ),
            "the density at mid-length falls no faster than with the square of the cell",
        ),
    ),
    Claim(
        "q2q2-worst",
        "§4.4.1",
        "Q2Q2 is the worst of all at fronts.",
        lambda: _over(NODE_BASED) | _distances(NODE_BASED),
        decide(_worst_everywhere, "the largest overshoot and distance from the plateaus on every mesh", _worst_where),
    ),
    Claim(
        "q2q2-too-smooth",
        "§4.4.1",
        "Q2Q2 is too smooth at fronts.",
        _widths,
        decide(
            lambda numbers: len(_most(numbers, "Q2Q2", "by slope")) == 3 or len(_most(numbers, "Q2Q2", "off")) == 3,
            "its front is the widest on every mesh",
            lambda numbers: (
                "the width of the front at x = 0.4 in cells, by its steepest slope and as the length that is off by a "
                f"tenth of the step: Q2Q2's is the widest {_on(_most(numbers, 'Q2Q2', 'by slope'))} by the one and "
                f"{_on(_most(numbers, 'Q2Q2', 'off'))} by the other"
            ),
        ),
    ),
    Claim(
        "q1p0-best-at-fronts",
        "§4.4.1",
        "Q1P0 is the best of the node-based elements at fronts.",
        lambda: _distances(NODE_BASED),
        decide(
            _nearest_by_far,
            "its distance from the semi-analytic plateaus is less than a tenth of any other's on every mesh",
            "its distance from the semi-analytic plateaus is not less than a tenth of any other's",
        ),
    ),
    Claim(
        "points-at-jumps",
        "§5.4, F5",
        "All integration-point elements do excellently at jumps.",
        lambda: _over(LOCAL),
        decide(
            lambda numbers: max(numbers.values()) < CLEAN,
            "no overshoot above 0.2 % of ρ\\* on any mesh",
            "overshoots above 0.2 % of ρ\\*",
        ),
    ),
    Claim(
        "points-for-jumps",
        "§7",
        "Integration-point based elements are better for discontinuous solutions.",
        lambda: _distances((*NODAL, gx.Q1P0, *LOCAL)),
        decide(
            lambda numbers: (
                max(v for variant in LOCAL for v in row(numbers, variant.name))
                < min(v for variant in NODAL for v in row(numbers, variant.name))
            ),
            "the worst of them on the coarsest mesh is nearer to the plateaus than the best continuous density on the "
            "finest; Q1P0, node-based by the paper's count, is as near as they are",
            "not every one of them is nearer to the plateaus than all continuous densities",
        ),
    ),
)
