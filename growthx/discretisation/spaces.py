"""Function spaces of a scene on a variant, and what is measured in them once: nothing here changes with time."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
import ufl

from growthx.common.arrays import selection
from growthx.common.checks import require_each
from growthx.common.errors import InputError
from growthx.discretisation.checks.point_fields import check_fields
from growthx.discretisation.variants import AtPoints, right_ones
from growthx.fem import compat
from growthx.fem.assembly import Compiler, assemble, values_at_points
from growthx.meshing.sampling import dof_positions

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices
    from growthx.discretisation.variants import Variant
    from growthx.model.scene import Scene


class Spaces:
    """Spaces of the displacement and of the density, the cells that grow and those that rest, and their volumes.

    growing_dofs: owned densities of cells that grow, rising; growing: the same as a selection.
    volumes: ∫ N dV over what grows, for each owned density.
    whole_volume, growing_volume, resting_volume: measures with the points of the balance of momentum; the last is None
    if everything grows.
    """

    def __init__(self, scene: Scene, variant: Variant) -> None:
        """Raises InputError if the variant is not made for the scene."""
        mesh = scene.mesh
        variant.check(mesh.cell_name)
        _check_lumping(scene, variant)
        self.scene, self.variant, self.comm, self.compile = scene, variant, mesh.comm, Compiler()
        self.cases = scene.load_cases
        self.displacement_space = dolfinx.fem.functionspace(
            mesh.domain, variant.displacement_element(mesh.cell_name, mesh.dim)
        )
        self.density_space = dolfinx.fem.functionspace(mesh.domain, variant.density_element(mesh.cell_name))
        check_fields(scene, variant, self.density_points)
        self._split_cells()
        self.growing_dofs = self._growing_densities()
        self.growing = selection(self.growing_dofs)
        self.volumes: Floats = assemble(self.compile.form(ufl.TestFunction(self.density_space) * self.growing_volume))

    def _split_cells(self) -> None:
        mesh, growing = self.scene.mesh, self.scene.growing
        metadata = {"quadrature_degree": self.variant.momentum_degree}
        self.whole_volume = ufl.Measure("dx", domain=mesh.domain, metadata=metadata)
        self.growing_cells, self.growing_volume, self.resting_volume = mesh.owned_cells, self.whole_volume, None
        self.resting_cells: Indices = np.zeros(0, dtype=np.int32)
        if growing is None:
            return
        marks = np.zeros_like(mesh.local_cells)
        for region in growing:
            marks[mesh.region(region)] = 1
        tags = dolfinx.mesh.meshtags(mesh.domain, mesh.dim, mesh.local_cells, marks)
        volume = ufl.Measure("dx", domain=mesh.domain, subdomain_data=tags, metadata=metadata)
        self.growing_cells, resting = (
            np.flatnonzero(marks[: len(mesh.owned_cells)] == mark).astype(np.int32) for mark in (1, 0)
        )
        self.growing_volume = volume(1)
        if self.comm.allreduce(len(resting)):
            self.resting_cells, self.resting_volume = resting, volume(0)

    def _growing_densities(self) -> Indices:
        dofmap = self.density_space.dofmap
        marks = dolfinx.la.vector(dofmap.index_map, 1)
        marks.array[dofmap.list[self.growing_cells]] = 1.0
        marks.scatter_reverse(dolfinx.la.InsertMode.add)
        return np.flatnonzero(marks.array[: dofmap.index_map.size_local]).astype(np.int32)

    @property
    def rests(self) -> bool:
        """Whether a part of the body does not grow."""
        return self.resting_volume is not None

    @cached_property
    def grows(self) -> dolfinx.fem.Function:
        """One in the cells that grow, zero in the others."""
        found = dolfinx.fem.Function(dolfinx.fem.functionspace(self.scene.mesh.domain, ("DG", 0)), name="grows")
        found.x.array[self.growing_cells] = 1.0
        found.x.scatter_forward()
        return found

    def everywhere(self, growing: Any, resting: Any) -> Any:
        """UFL expressions for what grows and for the rest as one for the whole body."""
        return self.grows * growing + (1 - self.grows) * resting if self.rests else growing

    @property
    def density_points(self) -> Floats:
        """Where in a cell the density takes values of functions, (points, dim)."""
        return np.asarray(compat.interpolation_points(self.density_space.element))

    def evaluate(self, value: Any, X: Floats) -> Floats:
        """A scalar in UFL at points X of the reference cell, (points, dim), shape (owned cells, points)."""
        cells = self.scene.mesh.owned_cells
        values = values_at_points(self.compile.expression(value, X), self.scene.mesh.domain, cells)
        return np.reshape(values, (len(cells), len(X)))

    def cells_of(self, regions: str | tuple[str, ...] | None) -> Indices:
        """Owned cells of one named region or of several, each once; None: those that grow."""
        if regions is None:
            return self.growing_cells
        names = (regions,) if isinstance(regions, str) else require_each(regions, str, "the regions", "region's name")
        if not names:
            raise InputError("no region is named: one at least, or None for what grows, would be right")
        mesh = self.scene.mesh
        cells = np.unique(np.concatenate([mesh.region(name) for name in names]))
        return np.asarray(cells[cells < len(mesh.owned_cells)])

    def growing_size(self) -> float:
        """Volume of what grows (in two dimensions, area)."""
        return self.comm.allreduce(float(self.volumes.sum()))

    def density_positions(self) -> Floats:
        """Where the densities are, in the order of `density.x.array`, shape (densities, 3)."""
        return dof_positions(self.density_space, self.scene.mesh)

    @property
    def points(self) -> int:
        """Number of integration points on all ranks."""
        return self.scene.mesh.cell_count * self.variant.points_per_cell(self.scene.mesh.cell_name)


def _check_lumping(scene: Scene, variant: Variant) -> None:
    """Raise InputError where masses at the corners of the cells make no sense."""
    if scene.inertia is None or not scene.inertia.lumped:
        return

    def at_corners_alone(variant: Variant) -> bool:
        return variant.displacement.degree == 1 and not isinstance(variant.density, AtPoints)

    if not at_corners_alone(variant):
        raise InputError(
            f"{variant.name} has unknowns or densities beside the corners of the cells, where lumped inertia has its "
            f"masses: {right_ones(scene.mesh.cell_name, at_corners_alone)}"
        )
