"""Fields of a scene that have values at integration points alone: refused by variants with other points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from growthx.common.errors import InputError
from growthx.discretisation.variants import AtPoints, suited
from growthx.fem.point_values import are_same, points_of, rule_points
from growthx.meshing.transferred import TransferredDensity

if TYPE_CHECKING:
    from collections.abc import Iterable

    from growthx.common.arrays import Floats
    from growthx.discretisation.variants import Variant
    from growthx.model.scene import Scene


def check_fields(scene: Scene, variant: Variant, density_points: Floats) -> None:
    """Raise InputError for a field of a scene with values at other points than those where the variant needs it.

    density_points: where in a cell the variant's density takes values of functions, (points, dim).
    """
    mesh = scene.mesh
    rules = [variant.integration_points(mesh.cell_name), rule_points(mesh.cell_name, variant.mass_degree)]
    corners = rule_points(mesh.cell_name, 1, "vertex")
    needed = [*rules, corners] if variant.source_at_corners else rules
    for law in (scene.material, scene.growth, scene.flux):
        for name in law.coefficients if law is not None else ():
            _check(getattr(law, name), needed, f"the field given for '{name}'", scene, variant)
    _check_made_for(scene.start_density, scene, variant)
    start = [density_points]
    if scene.growing is not None:  # what rests keeps it as it is
        start += rules[:1] + ([corners] if scene.inertia is not None and scene.inertia.lumped else [])
    _check(scene.start_density, start, "the initial density ρ(0)", scene, variant)


def _check_made_for(start: Any, scene: Scene, variant: Variant) -> None:
    """Raise InputError for a density of another run that was made for another mesh or variant."""
    for part in start.values() if isinstance(start, Mapping) else [start]:
        if not isinstance(part, TransferredDensity):
            continue
        part.on(scene.mesh)
        if part.function_space.ufl_element() != variant.density_element(scene.mesh.cell_name):
            raise InputError(
                f"the {part.name} was made for that variant, whose densities live elsewhere in a cell than those of "
                f"{variant.name}: transfer(…, mesh, {variant.name}) would be right"
            )


def _check(field: Any, needed: Iterable[Floats], what: str, scene: Scene, variant: Variant) -> None:
    known = points_of(field)
    if known is None or all(are_same(known, points) for points in needed):
        return
    like = [
        each.name
        for each in suited(scene.mesh.cell_name)
        if isinstance(each.density, AtPoints) and are_same(known, each.integration_points(scene.mesh.cell_name))
    ]
    owners = f", as {' and '.join(like)} {'has' if len(like) == 1 else 'have'} them" if like else ""
    instead = f", or {' or '.join(like)} for the variant," if like else ""
    raise InputError(
        f"{what} has its values at {len(known)} integration points of a cell alone{owners}, and {variant.name} needs "
        f"it at others: a function of position or a field of values per cell or at nodes{instead} would be right"
    )
