"""What a march or a run is given, looked at before it costs time."""

from __future__ import annotations

from typing import Any

from growthx.common.checks import (
    require_flag,
    require_kind,
    require_number,
)
from growthx.common.communicators import require_same_on_all
from growthx.discretisation.checks.arguments import check_scene
from growthx.stepping.control import Stepping


def check_run(scene: Any, variant: Any, *, tolerance: Any, stepping: Any, full_newton: Any) -> None:
    """Refuse what a march cannot take (collective); stepping: None stands for the default."""
    check_scene(scene, variant)
    told = {"tolerance": tolerance, "stepping": stepping, "full_newton": full_newton}
    require_same_on_all(scene.mesh.comm, told)
    check_tolerance(tolerance)
    wanted = "FixedSteps() or AdaptiveSteps(1e-3)"
    require_kind(stepping, (Stepping, type(None)), "the stepping", wanted)
    require_flag(full_newton, "full_newton")


def check_tolerance(tolerance: Any) -> None:
    """Refuse what Newton's method cannot be told to reach."""
    require_number(tolerance, "the tolerance of Newton's method", "a number between 0 and 1", lambda t: 0 < t < 1)


def require_result(result: Any) -> None:
    """Refuse what is no result of a run."""
    from growthx.stepping.record import Result

    require_kind(result, Result, "the result", "a Result, such as solve(scene, variant) returns,")
