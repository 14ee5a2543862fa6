"""A scene, a variant and what was made of them, looked at before they cost time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from growthx.common.checks import require_kind, require_name
from growthx.common.communicators import require_same_on_all
from growthx.common.errors import InputError, shown
from growthx.discretisation.variants import CATALOGUE, Variant, suited
from growthx.model.scene import Scene

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation


def check_scene(scene: Any, variant: Any) -> None:
    """Refuse what is no scene, no variant, both the other way round, or a variant for other cells (collective)."""
    if isinstance(scene, Variant) and isinstance(variant, Scene):
        raise InputError(
            f"the scene is the variant {scene.name} and the variant is the scene '{variant.name}': the other way round "
            "would be right"
        )
    require_kind(scene, Scene, "the scene", "a Scene, such as gx.scenes.femur() makes,")
    require_same_on_all(scene.mesh.comm, {"variant": variant})
    if not isinstance(variant, Variant):
        raise InputError(f"the variant is {shown(variant)}: {_right_variants(scene.mesh.cell_name, variant)}")
    variant.check(scene.mesh.cell_name)


def _right_variants(cell_name: str, meant: Any) -> str:
    """The variant that a name means on that shape of cells, or all that there are, as the end of a sentence."""
    for_these = suited(cell_name) or list(CATALOGUE.values())
    same = [variant for variant in for_these if isinstance(meant, str) and variant.name.lower() == meant.lower()]
    names = ", ".join(f"gx.{variant.name}" for variant in same or for_these)
    return f"{names} would be right" if same else f"one of {names} would be right"


def check_problem_of(problem: Any, scene: Scene, variant: Variant) -> None:
    """Refuse what is not this scene discretised by this variant."""
    from growthx.discretisation.discretisation import Discretisation

    require_kind(problem, Discretisation, "the problem", "a discretised scene, as discretise(scene, variant) returns,")
    if problem.variant != variant:
        raise InputError(
            f"the problem is discretised by {problem.variant.name} and the variant is {variant.name}: the same one, "
            "as discretise(scene, variant) was given, would be right"
        )
    if other := next((part.name for part in fields(scene) if not _same(problem.scene, scene, part.name)), ""):
        raise InputError(
            f"the problem is of another scene, '{problem.scene.name}', than '{scene.name}', by its {other}: "
            "discretise(scene, variant), or problem.scene for the scene, would be right"
        )


def _same(one: Scene, other: Scene, name: str) -> bool:
    """Whether two scenes have the same part of that name; of arrays, the same one."""
    a, b = getattr(one, name), getattr(other, name)
    if a is b:
        return True
    try:
        return bool(a == b)
    except ValueError:  # arrays, which have no one answer
        return False


def require_problem(given: Any, what: str = "the problem") -> Discretisation:
    """The discretised scene that is given, or that of a result; refuse what has no densities of a scene."""
    problem = getattr(given, "problem", given)
    if isinstance(given, type) or not (hasattr(problem, "scene") and hasattr(problem, "density_at")):
        raise InputError(f"{what} is {shown(given)}: a result, or a scene that is discretised, would be right")
    return problem


def require_problems(problems: Any) -> dict[str, Discretisation]:
    """The discretised scenes by name, of results their own; refuse what maps no names to such, at least one."""
    require_kind(problems, Mapping, "what holds the problems", "a mapping from labels to problems")
    if not problems:
        raise InputError("there are no problems to draw: one for each label would be right")
    for label in problems:
        require_name(label, "the label of a problem")
    return {label: require_problem(problem, f"the problem '{label}'") for label, problem in problems.items()}
