"""Tables 2, 8, 13 and 14, Figures 1, 4 and 7: unknowns, points, elements, and the loads of the femur."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache

import basix
import numpy as np

import growthx as gx
from benchmarks.accuracy.paper_claims.bars import MESHES
from benchmarks.accuracy.paper_claims.claim import Claim, Numbers, column, decide, values
from growthx.discretisation.discretisation import Discretisation
from growthx.scenes.bar import DISCONTINUOUS, bar
from growthx.scenes.femur import LOAD_CASES, loaded_arcs

CELLS = {1: 658, 2: 2632, 3: 5922}  # of the femur, by refinement
Q1P0 = "Q1P0"

# Tables 2 and 8: unknowns and points at 10, 40 and 100 elements.
UNKNOWNS = {
    "Q1Q1": (66, 246, 606),
    "Q2Q2": (189, 729, 1809),
    "Q1P0": (44, 164, 404),
    "S2Q1": (128, 488, 1208),
    "Q1": (44, 164, 404),
    "Q2": (126, 486, 1206),
    "Q1sri": (44, 164, 404),
    "S2fri": (106, 406, 1006),
}
POINTS = {
    "Q1Q1": (40, 160, 400),
    "Q2Q2": (90, 360, 900),
    "Q1P0": (90, 360, 900),
    "S2Q1": (40, 160, 400),
    "Q1": (40, 160, 400),
    "Q2": (90, 360, 900),
    "Q1sri": (40, 160, 400),
    "S2fri": (40, 160, 400),
}
# Table 13 and Figure 7: joint force (N) and angle, abductor force and angle.
FORCES = ((2317, 24, 703, 28), (1158, -15, 351, -8), (1548, 56, 468, 35))
# Table 14: element, refinement, unknowns and points of the femur.
FEMUR = (
    ("Q1Q1", 1, 2175, 2632),
    ("Q1Q1", 2, 8295, 10528),
    ("Q1Q1", 3, 18363, 23688),
    ("Q2Q2", 1, 8295, 5922),
    ("Q1P0", 1, 1450, 2632),
    ("S2Q1", 1, 4939, 2632),
    ("Q1", 1, 1450, 2632),
    ("Q2", 1, 5530, 5922),
    ("Q1sri", 1, 1450, 2632),
    ("S2fri", 1, 4214, 2632),
)
SRI_MASS_POINTS = {"bar": MESHES, "femur": (658,)}  # of Q1sri, in Tables 8 and 14
# Figures 1 and 4: nodes of displacement, densities, points of momentum and of mass in a cell.
NODE_BASED = {"Q1Q1": (4, 4, 4, 4), "Q2Q2": (9, 9, 9, 9), "Q1P0": (4, 1, 4, 4), "S2Q1": (8, 4, 4, 4)}
POINT_BASED = {"Q1": (4, 4, 4, 4), "Q2": (9, 9, 9, 9), "Q1sri": (4, 1, 4, 1), "S2fri": (8, 4, 4, 4)}


@cache
def _bar(name: str, elements: int) -> Discretisation:
    return gx.discretise(bar(DISCONTINUOUS, elements), gx.variants.named(name))


@cache
def _femur(name: str, refine: int) -> Discretisation:
    return gx.discretise(gx.scenes.femur(refine=refine), gx.variants.named(name))


def _of_bars(count: Callable[[Discretisation], int], names: tuple[str, ...]) -> dict[str, float]:
    return {f"{name}: {elements} elements": float(count(_bar(name, elements))) for name in names for elements in MESHES}


def _as_printed(numbers: Numbers, printed: Mapping[str, tuple[int, ...]]) -> bool:
    return all(
        value == printed[label.partition(":")[0]][MESHES.index(int(label.split()[1]))]
        for label, value in numbers.items()
    )


def _mass_points(problem: Discretisation) -> int:
    degree = problem.variant.mass_degree
    points, _ = basix.make_quadrature(basix.CellType[problem.scene.mesh.cell_name], degree)
    return problem.scene.mesh.cell_count * np.asarray(points).shape[0]


def _sri_mass_points() -> dict[str, float]:
    found = {f"bar, {n} elements: points of the source": float(_mass_points(_bar("Q1sri", n))) for n in MESHES}
    return found | {"femur, 658 elements: points of the source": float(_mass_points(_femur("Q1sri", 1)))}


def _elements(names: Mapping[str, tuple[int, ...]]) -> dict[str, float]:
    found = {}
    for name in names:
        problem = _bar(name, 10)
        nodes, densities = (
            space.dofmap.dof_layout.num_dofs for space in (problem.displacement_space, problem.density_space)
        )
        counts = (nodes, densities, problem.points // 10, _mass_points(problem) // 10)
        for what, count in zip(("nodes", "densities", "points of stress", "points of source"), counts, strict=True):
            found[f"{name}: {what}"] = float(count)
    return found


def _as_drawn(names: Mapping[str, tuple[int, ...]]) -> Callable[[Numbers], bool]:
    drawn = [float(count) for counts in names.values() for count in counts]
    return lambda numbers: list(numbers.values()) == drawn


def _of_femur(what: str) -> dict[str, float]:
    found = {}
    for name, refine, dofs, points in FEMUR:
        problem = _femur(name, refine)
        ours, printed = (problem.dofs, dofs) if what == "unknowns" else (problem.points, points)
        found[f"{name}, {problem.scene.mesh.cell_count} elements: {what}"] = float(ours)
        found[f"{name}, {CELLS[refine]} elements: in the paper"] = float(printed)
    return found


def _same(what: str) -> Callable[[Numbers], bool]:
    return lambda numbers: column(numbers, what) == column(numbers, "in the paper")


def _forces() -> dict[str, float]:
    found: dict[str, float] = {}
    for ours, printed in zip(LOAD_CASES, FORCES, strict=True):
        numbers = ours.joint, ours.joint_angle, ours.abductor, ours.abductor_angle
        whats = "joint, N", "its angle", "abductors, N", "their angle"
        found |= {f"{ours.name}: {what}": float(number) for what, number in zip(whats, numbers, strict=True)}
        found[f"{ours.name}: not as printed"] = float(sum(a != b for a, b in zip(numbers, printed, strict=True)))
    return found


def _resultants() -> dict[str, float]:
    found = {}
    for refine in (1, 2):
        arcs = {
            (arc.case, arc.force): arc.newtons
            for arc in loaded_arcs(gx.scenes.femur(refine=refine, weights=(1.0, 1.0, 1.0)))
        }
        for case in LOAD_CASES:
            for force, size in (("joint", case.joint), ("abductor", case.abductor)):
                label = f"{CELLS[refine]} elements, {case.name}: {force}, N off the table"
                found[label] = abs(arcs[case.name, force] - size)
    return found


OTHERS = tuple(name for name in POINTS if name != Q1P0)

CLAIMS = (
    Claim(
        "unknowns",
        "T2, T8",
        "The bars have 44 to 1809 unknowns, by element and mesh.",
        lambda: _of_bars(lambda problem: problem.dofs, tuple(UNKNOWNS)),
        decide(lambda numbers: _as_printed(numbers, UNKNOWNS), "all 24 are the printed ones", "some are not printed"),
    ),
    Claim(
        "points",
        "T2, T8",
        "The bars have 40 to 900 integration points, by element and mesh (all elements but Q1P0).",
        lambda: _of_bars(lambda problem: problem.points, OTHERS),
        decide(lambda numbers: _as_printed(numbers, POINTS), "all 21 are the printed ones", "some are not"),
    ),
    Claim(
        "points-of-q1p0",
        "T2",
        "Q1P0 has 90, 360 and 900 integration points.",
        lambda: _of_bars(lambda problem: problem.points, (Q1P0,)),
        decide(
            lambda numbers: _as_printed(numbers, POINTS),
            "as printed",
            lambda numbers: (
                "a slip: with the 2 × 2 points that the text gives it there are "
                + ", ".join(f"{value:.0f}" for value in numbers.values())
            ),
        ),
    ),
    Claim(
        "source-points-of-q1sri",
        "T8, T14",
        "Q1sri takes the source at one point of each cell: 10, 40, 100 in the bars, 658 in the femur.",
        _sri_mass_points,
        decide(
            lambda numbers: list(numbers.values()) == [*SRI_MASS_POINTS["bar"], *SRI_MASS_POINTS["femur"]],
            "as many as cells",
            "not as many as cells",
        ),
    ),
    *(
        Claim(
            f"elements-of-{place.lower()}",
            place,
            f"The {kind} elements' nodes of displacement, densities and integration points, as drawn.",
            lambda names=names: _elements(names),  # type: ignore[misc]
            decide(_as_drawn(names), "each cell has as many of each as are drawn", "the counts are others"),
        )
        for place, kind, names in (
            ("F1", "node-based", NODE_BASED),
            ("F4", "integration-point based", POINT_BASED),
        )
    ),
    *(
        Claim(
            f"femur-{what}",
            "T14",
            f"The femur's {what}, by element and mesh.",
            lambda what=what: _of_femur(what),  # type: ignore[misc]
            decide(_same(what), "all ten are the printed ones", "some are not the printed ones"),
        )
        for what in ("unknowns", "points")
    ),
    Claim(
        "load-cases",
        "T13",
        "Three load cases: forces of the hip joint and of the abductors with their angles.",
        _forces,
        decide(lambda numbers: not any(values(numbers, "not as")), "the scene has the printed ones", "some differ"),
    ),
    Claim(
        "loads-as-drawn",
        "F7",
        "These forces load the head and the greater trochanter.",
        _resultants,
        decide(
            lambda numbers: max(numbers.values()) < 1e-9,
            "what the edges of either mesh bear sums up to the printed forces; over which arcs is our choice, since "
            "the paper tells none",
            "the resultants are not the printed forces",
        ),
    ),
)
