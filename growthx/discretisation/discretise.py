"""From a scene and a variant to a discretisation that is ready to march."""

from __future__ import annotations

from typing import TYPE_CHECKING

from growthx.discretisation.checks.arguments import check_scene
from growthx.discretisation.checks.magnitudes import warn_if_out_of_scale
from growthx.discretisation.checks.start_bounds import warn_if_beyond_bounds
from growthx.discretisation.discretisation import Discretisation
from growthx.meshing.corners import check_cells
from growthx.model.exponents import warn_if_ill_posed
from growthx.model.rigid_motions import check_held
from growthx.solvers import abandoned

if TYPE_CHECKING:
    from growthx.discretisation.variants import Variant
    from growthx.model.scene import Scene


def discretise(scene: Scene, variant: Variant) -> Discretisation:
    """The discretisation of a scene by a variant, ready to march.

    Warns of a model that is not well posed, of numbers whose orders of magnitude do not belong together, and of a
    density that begins beyond its bounds.

    Raises InputError if a cell of the mesh is not convex, if a part of the body is free to move, if the variant is
    not made for the scene, or if these are no scene and no variant.

    Example:
        >>> problem = gx.discretise(gx.scenes.plate(2), gx.Q1P0)
        >>> round(problem.mass(), 6)
        2.0
    """
    check_scene(scene, variant)
    abandoned.free(scene.mesh.comm)
    check_cells(scene.mesh)
    check_held(scene)
    warn_if_ill_posed(scene)
    problem = Discretisation(scene, variant)
    warn_if_out_of_scale(problem)
    warn_if_beyond_bounds(problem)
    return problem
