"""Section 6 and Figures 8 to 11: the femur, by zones and by how its densities go up and down."""

from __future__ import annotations

from functools import cache

import numpy as np

import growthx as gx
from benchmarks.accuracy.paper_claims.bars import LOCAL
from benchmarks.accuracy.paper_claims.claim import Claim, Numbers, decide, row, values
from benchmarks.accuracy.paper_claims.counts import CELLS
from benchmarks.stability.study import share
from growthx.baselines import high_frequency_index
from growthx.discretisation.discretisation import Discretisation
from growthx.post.smoothing import corner_functions, smoothed_density
from growthx.post.subcells import subcells
from growthx.scenes.femur import zones

ALL = tuple(gx.variants.suited("quadrilateral"))
ALIKE = 5.0  # per cent of a zone's mean


@cache
def solved(variant: gx.Variant, refine: int = 1) -> Discretisation:
    """The femur at t = 160."""
    return gx.solve(gx.scenes.femur(refine=refine), variant).problem


@cache
def _means(variant: gx.Variant, refine: int = 1) -> dict[str, float]:
    return gx.zones.area_means(solved(variant, refine), zones())


def _apart(means: dict[str, float], others: dict[str, float]) -> float:
    """The largest difference of a zone's mean, in per cent."""
    return 100 * max(abs(means[zone] / others[zone] - 1) for zone in means)


def _refinement() -> dict[str, float]:
    means = {refine: _means(gx.Q1Q1, refine) for refine in CELLS}
    found: dict[str, float] = {}
    for zone, first in means[1].items():
        found |= {f"{zone}: g/cm³, {CELLS[refine]} cells": means[refine][zone] for refine in CELLS}
        found[f"{zone}: change in per cent"] = 100 * max(abs(means[refine][zone] / first - 1) for refine in (2, 3))
    return found


def _anatomy(*names: str) -> dict[str, float]:
    return {f"{zone}: mean density in g/cm³": _means(gx.Q1Q1)[zone] for zone in names}


def _mean(numbers: Numbers, zone: str) -> float:
    return row(numbers, zone)[0]


def _strut(numbers: Numbers) -> bool:
    around = max(_mean(numbers, zone) for zone in ("ward", "head_superolateral", "head_inferomedial"))
    return _mean(numbers, "calcar") > _mean(numbers, "strut") > 1.5 * around


def _wards_triangle(numbers: Numbers) -> bool:
    return _mean(numbers, "ward") < 0.8 * min(_mean(numbers, zone) for zone in ("strut", "arcuate", "calcar"))


def _dense_shaft(numbers: Numbers) -> bool:
    return min(_mean(numbers, zone) for zone in ("lat_cortex", "med_cortex")) > 2 * _mean(numbers, "canal")


def _against(reference: gx.Variant, variants: tuple[gx.Variant, ...]) -> dict[str, float]:
    return {
        f"{variant.name}: zones apart from {reference.name}'s, at most in per cent": _apart(
            _means(variant), _means(reference)
        )
        for variant in variants
    }


def _noise() -> dict[str, float]:
    return {f"{v.name}: high-frequency index": high_frequency_index(solved(v)) for v in ALL[:4]}


@cache
def _roughness() -> dict[str, float]:
    """What smoothing takes from the densities, over these, in L² of the points."""
    found = {}
    for variant in LOCAL:
        problem = solved(variant)
        smooth = smoothed_density(problem)
        corners = smooth.x.array[smooth.function_space.dofmap.list[: problem.scene.mesh.cell_count]]
        raw = problem.densities_of_cells()
        gone = raw - corners @ corner_functions(problem).T
        found[f"{variant.name}: taken by smoothing, per cent"] = float(100 * np.linalg.norm(gone) / np.linalg.norm(raw))
    return found


def _smoothed() -> dict[str, float]:
    """Distances of the smoothed densities from that of Q1Q1 at the corners, and of the zones' means."""
    reference, found = smoothed_density(solved(gx.Q1Q1)).x.array, {}
    for variant in LOCAL:
        gap = smoothed_density(solved(variant)).x.array - reference
        found[f"{variant.name}: zones apart, per cent"] = _apart(_means(variant), _means(gx.Q1Q1))
        found[f"{variant.name}: at corners, per cent"] = float(100 * np.linalg.norm(gap) / np.linalg.norm(reference))
    return found


def _own_areas() -> dict[str, float]:
    found = {}
    for variant in LOCAL:
        pieces = subcells("quadrilateral", solved(variant).spaces.density_points)
        found[f"{variant.name}: densities of a cell"] = float(solved(variant).densities_of_cells().shape[1])
        found[f"{variant.name}: areas of a cell"] = float(len(pieces.pieces))
    return found


def _changes() -> dict[str, float]:
    """[ρ − ρ*]/ρ*, as all pictures have it."""
    found, reference = {}, gx.scenes.femur().material.reference_density
    for variant in ALL:
        problem = solved(variant)
        low, high = problem.density_range()
        found[f"{variant.name}: lowest"], found[f"{variant.name}: highest"] = low / reference - 1, high / reference - 1
        found[f"{variant.name}: share within −1 and 1"] = share(problem, lambda rho: rho < 2 * reference)
    return found


ZONES = "no zone's mean differs by 5 %"
OTHER_ZONES = "some zone's mean differs by 5 %"

CLAIMS = (
    Claim(
        "femur-refinement",
        "§6, F8",
        "Q1Q1 on 658, 2632 and 5922 elements: little difference.",
        _refinement,
        decide(lambda numbers: max(values(numbers, "per cent")) < ALIKE, ZONES, OTHER_ZONES),
    ),
    Claim(
        "strut",
        "§6, F8",
        "There is a dense strut from the superior head to the calcar.",
        lambda: _anatomy("strut", "calcar", "ward", "head_superolateral", "head_inferomedial"),
        decide(
            _strut,
            "its mean is above 1.5 times those of what is beside it, and that of the calcar above its own",
            "its mean is not between 1.5 times those of what is beside it and that of the calcar",
        ),
    ),
    Claim(
        "arcuate-system",
        "§6, F8",
        "There is an arcuate system to the lateral metaphysis.",
        lambda: _anatomy("arcuate", "ward"),
        decide(
            lambda numbers: _mean(numbers, "arcuate") > 1.2 * _mean(numbers, "ward"),
            "its mean is above 1.2 times that of Ward's triangle",
            "its mean is not above 1.2 times that of Ward's triangle",
        ),
    ),
    Claim(
        "wards-triangle",
        "§6, F8",
        "There is Ward's triangle between them.",
        lambda: _anatomy("ward", "strut", "arcuate", "calcar"),
        decide(
            _wards_triangle,
            "its mean is below 0.8 times those of strut, arcuate system and calcar",
            "its mean is not below 0.8 times those of strut, arcuate system and calcar",
        ),
    ),
    Claim(
        "dense-shaft",
        "§6, F8",
        "There is a dense shaft around the canal.",
        lambda: _anatomy("lat_cortex", "med_cortex", "canal"),
        decide(
            _dense_shaft,
            "the means of both cortices are above twice that of the canal",
            "the means of the cortices are not above twice that of the canal",
        ),
    ),
    Claim(
        "node-based-alike",
        "§6, F9",
        "Q1Q1, Q2Q2, Q1P0 and S2Q1 are nearly alike.",
        lambda: _against(gx.Q1Q1, (gx.Q2Q2, gx.Q1P0, gx.S2Q1)),
        decide(lambda numbers: max(numbers.values()) < ALIKE, ZONES, OTHER_ZONES),
    ),
    Claim(
        "q1p0-stable",
        "§6, F9",
        "Q1P0 shows no instability.",
        _noise,
        decide(
            lambda numbers: row(numbers, "Q1P0")[0] <= max(numbers.values()) < 0.05,
            "what its densities go up and down from one neighbour to the next beyond their slope is no more than of "
            "continuous ones",
            "its densities go up and down from one neighbour to the next beyond their slope",
        ),
    ),
    Claim(
        "raw-pictures",
        "§6, F10",
        "Raw pictures give each point its own area.",
        _own_areas,
        decide(
            lambda numbers: values(numbers, "densities of") == values(numbers, "areas of"),
            "`gx.plots` cuts cells into as many",
            "cells are not cut into as many",
        ),
    ),
    Claim(
        "q1-oscillates-slightly",
        "§6, F10",
        "Raw, Q1 is slightly oscillatory.",
        _roughness,
        decide(
            lambda numbers: 20 > row(numbers, "Q1")[0] > 2 * max(row(numbers, "Q2")[0], row(numbers, "S2fri")[0]),
            "smoothing takes some per cent of it, more than twice as much as of Q2 and S2fri",
            "smoothing does not take some per cent of it, more than twice as much as of Q2 and S2fri",
        ),
    ),
    Claim(
        "s2fri-smooth",
        "§6, F10",
        "Raw, S2fri is smooth.",
        _roughness,
        decide(
            lambda numbers: row(numbers, "S2fri")[0] == min(numbers.values()) < 1,
            "smoothing takes less than a per cent of it, and the least of all",
            "smoothing takes more than a per cent of it, or less of another",
        ),
    ),
    Claim(
        "q1sri-as-q1p0",
        "§6, F10",
        "Q1sri is as Q1P0.",
        lambda: _against(gx.Q1P0, (gx.Q1sri, gx.Q1, gx.Q2, gx.S2fri)),
        decide(
            lambda numbers: row(numbers, "Q1sri")[0] == min(numbers.values()) < 1,
            "no zone's mean differs by 1 %, and less than those of the others",
            "some zone's mean differs by 1 %, or those of another less",
        ),
    ),
    Claim(
        "point-based-alike",
        "§6, F11",
        "Extrapolated and averaged at nodes, Q1, Q2, Q1sri and S2fri are all alike, and like the node-based ones.",
        _smoothed,
        decide(
            lambda numbers: max(values(numbers, "zones")) < ALIKE,
            lambda numbers: (
                f"no zone's mean differs by 5 % from Q1Q1's; at single corners Q1sri is {row(numbers, 'Q1sri')[1]:.2g} "
                f"% away in L², the others {max(row(numbers, name)[1] for name in ('Q1', 'Q2', 'S2fri')):.2g} % at most"
            ),
            OTHER_ZONES,
        ),
    ),
    Claim(
        "relative-change",
        "§6, F8, F9, F10, F11",
        "One scale of [ρ − ρ*]/ρ* shows all elements.",
        _changes,
        decide(
            lambda numbers: min(values(numbers, "share")) > 0.95,
            "from −1 to 1 it holds 95 % and more of the volume of each",
            "from −1 to 1 it does not hold 95 % of the volume of each",
        ),
    ),
)
