"""The block step for nodal densities with factors in single precision, made right from the cells, on one rank.

Densities, displacements, densities: a symmetric block Gauss–Seidel step for

    | K_uu  K_uρ |
    | K_ρu  K_ρρ |

with factors of the displacement of each load case and of the densities.  Newton's method that keeps them sees by its
residual how good a step was: no Krylov method has to look at it.  Only the first one with new factors is looked at;
where that is poor, generalised conjugate residuals make a better one of each step with these factors.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.fem.sums.node_blocks import NodeBlocks
from growthx.solvers.single_factor import NAME, Factor

if TYPE_CHECKING:
    from petsc4py import PETSc

    from growthx.common.arrays import Floats
    from growthx.solvers.problem import NonlinearProblem

POOR = 0.3  # ‖b − A x‖ over ‖b‖ of a first step, by which the others with the same factors are watched
ENOUGH, MOST_ITERATIONS = 0.1, 30  # of the conjugate residuals: Newton's method gains no more from a better solution

WHOLE, DENSITY, DISPLACEMENTS = slice(None), slice(-1, None), slice(-1)


class NodeFactors:
    """The context of a PETSc PC of type "python" that needs no matrix.

    is_poor: whether the last factors could not be made, or their steps add up to no solution.
    """

    leaves_out_coupling = True  # what a step leaves of it
    name = f"block step ({NAME})"

    def __init__(self, library: Any, problem: NonlinearProblem) -> None:
        """library: see `single_factor.load`."""
        self._problem, layout = problem, problem.layout
        self._sums = sums = NodeBlocks(layout.space, problem.unknown.function_space)
        held = np.isin(sums.places, layout.held)
        self._held, dim = held, layout.dim
        self._lower = np.flatnonzero(sums.rows >= sums.columns)
        pairs = np.column_stack([sums.rows[self._lower], sums.columns[self._lower]])
        self._parts = [*(slice(first, first + dim) for first in range(0, held.shape[1] - 1, dim)), DENSITY]
        self._factors = [Factor.of_blocks(library, pairs, held[:, part].ravel(), dim) for part in self._parts]
        self._fresh = self._watched = self.is_poor = False

    @property
    def work(self) -> float:
        """Operations of a factorisation for each entry of the largest factor; zero before the first one."""
        return max(factor.work for factor in self._factors)

    def assemble(self) -> bool:
        """Factorise the blocks as they are now; whether all of them have a factor, and all cells have been added."""
        if not self._sums.add_up(self._problem.tangents):
            return False
        values = [np.moveaxis(self._sums.values[part, part], 2, 0)[self._lower] for part in self._parts]
        made = [
            factor.factorise(np.ascontiguousarray(each)) for factor, each in zip(self._factors, values, strict=True)
        ]
        self._fresh, self.is_poor = True, not all(made)
        return not self.is_poor

    def apply(self, pc: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """X ≈ A⁻¹ b; PETSc calls this."""
        side = b.array_r[self._sums.places]
        found = self._step(side)
        if self._fresh or self._watched:
            found = self._looked_at(side, found)
        x.array_w[self._sums.places] = found

    def _step(self, side: Floats) -> Floats:
        """Densities, displacements, densities; rows that are held have no residual and get no solution."""
        forces, rates = side[:, DISPLACEMENTS], side[:, DENSITY]
        density = self._solve(-1, rates)
        forces = forces - self._sums.times(DISPLACEMENTS, DENSITY, density)
        moved = np.hstack([self._solve(case, forces[:, part]) for case, part in enumerate(self._parts[:-1])])
        density = self._solve(-1, rates - self._sums.times(DENSITY, DISPLACEMENTS, moved))
        return np.hstack([moved, density])

    def _solve(self, number: int, side: Floats) -> Floats:
        part = self._parts[number]
        side = np.where(self._held[:, part], 0.0, side)
        return self._factors[number].approximate(side.ravel()).reshape(side.shape)

    def _product(self, x: Floats) -> Floats:
        return np.where(self._held, x, self._sums.times(WHOLE, WHOLE, x))

    def _looked_at(self, side: Floats, found: Floats) -> Floats:
        """A step, by generalised conjugate residuals a better one if the first one with these factors was poor."""
        size, rest = float(np.linalg.norm(side)), side - self._product(found)
        if self._fresh:
            self._fresh, self._watched = False, not np.linalg.norm(rest) <= POOR * size
        if not self._watched:
            return found
        former: list[tuple[Floats, Floats]] = []
        while np.linalg.norm(rest) > ENOUGH * size and len(former) < MOST_ITERATIONS:
            step = self._step(rest)
            product = self._product(step)
            for other, image in former:
                share = float(np.vdot(image, product))
                step, product = step - share * other, product - share * image
            length = float(np.linalg.norm(product))
            former.append((step / length, product / length))
            share = float(np.vdot(former[-1][1], rest))
            found, rest = found + share * former[-1][0], rest - share * former[-1][1]
        self.is_poor = not np.linalg.norm(rest) <= ENOUGH * size
        return found

    def destroy(self, pc: PETSc.PC) -> None:
        """Free the memory; PETSc calls this."""
        for factor in self._factors:
            factor.destroy()
