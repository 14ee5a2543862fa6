"""The numbers of a run that every scene has."""

from __future__ import annotations

from typing import TYPE_CHECKING

from growthx.fem import compat
from growthx.stepping.arguments import require_result

if TYPE_CHECKING:
    from collections.abc import Mapping

    from growthx.stepping.record import Result


def summary(result: Result) -> Mapping[str, object]:
    """The numbers of a run that every scene has, as scalars.

    at_bounds: shares of the volume at the lowest and the highest bound of density, where the law has bounds.
    mass, min_density, max_density: of what grows; `growing` names its regions where other parts of the body rest.

    Example:
        >>> numbers = gx.results.summary(gx.solve(gx.scenes.plate(2), gx.Q1P0))
        >>> print(f"{numbers['mass']:.3f}")
        1.349
    """
    from growthx.common.installed import __version__

    require_result(result)
    problem = result.problem
    low, high = problem.density_range()
    return {
        "schema": 1,
        "versions": {"growthx": __version__, "dolfinx": compat.DOLFINX_VERSION},
        "scene": result.scene.name,
        "variant": result.variant.name,
        "cells": result.scene.mesh.cell_count,
        "dofs": problem.dofs,
        "points": problem.points,
        "time": result.time,
        "steps": len(result.steps),
        "newton_iterations": result.newton_iterations,
        "factorisations": result.factorisations,
        "linear_solver": result.linear_solver,
        "converged": result.converged,
        "ended": result.ended,
        **({} if result.converged else {"reason": result.reason}),
        "min_density": low,
        "max_density": high,
        **({"at_bounds": list(problem.measures.shares_at_bounds())} if result.scene.growth.is_bounded else {}),
        "mass": problem.mass(),
        "mass_defect": max((step.mass_defect for step in result.steps), default=0.0),
        "force_defect": max((step.force_defect for step in result.steps), default=0.0),
        "moment_defect": max((step.moment_defect for step in result.steps if step.moment_defect >= 0), default=None),
        "lumped_cells": max((step.lumped_cells for step in result.steps), default=0),
        "round_off": max((step.newton.round_off for step in result.steps), default=0.0),
        **({"growing": list(problem.scene.growing or ())} if problem.rests else {}),
        "setup_s": result.setup_s,
        "compile_s": result.compile_s,
        "solve_s": result.solve_s,
    }
