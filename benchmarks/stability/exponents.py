"""Which exponents m and n a march survives, and what its density looks like, on two nested meshes of each body."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

from benchmarks.shared.integrals import relative
from benchmarks.stability.study import (
    BODIES,
    FINISHED,
    LUMPED,
    VARIANTS,
    March,
    Part,
    cell_means,
    march,
    means_over,
    named,
    share,
    with_exponents,
)
from growthx.baselines import checkerboard_index, high_frequency_index

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation
    from growthx.stepping.record import Step

M, N = (0.0, 1.0, 2.0, 3.0, 4.0), (1.0, 2.0, 3.5)
PARTS = (1, 2)  # of each side of the coarse cells
EMPTY, DENSE = 0.1, 2.0  # of ρ*: below and above, cells count as 0 and 1


@dataclass(frozen=True)
class Case:
    """A body, the exponents and a discretisation."""

    body: str
    n: float
    m: float
    variant: str


@dataclass(frozen=True)
class Row:
    """A march on one of the meshes.

    jump, noise: checkerboard and high-frequency index.  empty, dense: shares of the volume.
    other_mesh: distance of the densities' means over coarse cells from those of the other mesh, relative, at the last
    nominal time that both have reached, `compared`.
    lumped: steps in which the balance of mass was lumped somewhere; lumped_cells: the largest share of the cells.
    """

    body: str
    n: float
    m: float
    variant: str
    cells: int
    ended: str
    time: float
    steps: int
    rejected: int
    lowest: float
    highest: float
    jump: float
    noise: float
    empty: float
    dense: float
    other_mesh: float
    compared: float
    lumped: int
    lumped_cells: float

    @property
    def well_posed(self) -> bool:
        """M > n."""
        return self.m > self.n

    @property
    def finished(self) -> bool:
        """Whether the march came to its end."""
        return self.ended == FINISHED


def run(case: Case) -> list[Row]:
    """Both meshes."""
    variant = named(case.variant)
    scenes = [with_exponents(BODIES[case.body].scene(refine), case.n, case.m) for refine in PARTS]
    marches, histories = [], []
    for scene in scenes:
        history: dict[int, Floats] = {}

        def remember(step: Step, problem: Discretisation, history: dict[int, Floats] = history) -> None:
            number = step.time / problem.scene.program.step
            if abs(number - round(number)) < 1e-6:
                history[round(number)] = cell_means(problem)[0]

        marches.append(march(scene, variant, watch=remember))
        histories.append(history)
    common = max(histories[0].keys() & histories[1].keys(), default=0)
    apart = _apart(marches, [history[common] for history in histories]) if common else math.nan
    return [_row(case, each, apart, common * each.problem.scene.program.step) for each in marches]


def _apart(marches: Sequence[March], means: Sequence[Floats]) -> float:
    """Distance of two densities, given by cells, over the coarse cells."""
    coarse, fine = (each.problem for each in marches)
    over_coarse = means_over(coarse.scene.mesh, fine.scene.mesh, means[1], cell_means(fine)[1])
    return relative(means[0], over_coarse, cell_means(coarse)[1])


def _row(case: Case, each: March, apart: float, compared: float) -> Row:
    problem = each.problem
    reference = problem.scene.material.reference_density
    return Row(
        case.body,
        case.n,
        case.m,
        case.variant,
        problem.scene.mesh.cell_count,
        each.ended,
        each.time,
        each.steps,
        each.rejected,
        *problem.density_range(),
        checkerboard_index(problem),
        high_frequency_index(problem),
        share(problem, lambda rho: rho < EMPTY * reference),
        share(problem, lambda rho: rho > DENSE * reference),
        apart,
        compared,
        each.lumped,
        each.cells,
    )


def cases() -> list[Case]:
    """Every one of every discretisation; where it is well posed, also with what Remark 4.3 recommends for nodes."""
    every = [Case(*these) for these in product(BODIES, N, M, VARIANTS)]
    lumped = product(BODIES, N, M, (variant.name for variant in LUMPED))
    return every + [Case(*these) for these in lumped if these[2] > these[1]]


PART = Part("exponents", Row, cases, run)
