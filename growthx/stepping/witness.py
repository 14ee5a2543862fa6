"""What the record of a run says against it: balances of mass and of forces that do not hold as the tolerance promises.

Mass: what the body gained against what its source and boundaries gave.  Forces, and their moments about the middle of
the body as it is deformed: what the supports bear against the loads, which are known from the scene – a resultant, or a
traction times the area of its facets – and not only from the nodal forces that were solved with.  A law that one part
of the program obeys and another does not, or a load that is lost on its way to the nodes, shows here.
"""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Any

import basix
import dolfinx
import numpy as np
from mpi4py import MPI

from growthx.common.errors import GrowthxError
from growthx.discretisation.constraints.rigid_faces import is_of_a_rigid_face
from growthx.fem.assembly import integral
from growthx.meshing.sampling import volume_ratios
from growthx.model.actions.concentrated import NodalLoad
from growthx.model.actions.faces import FLAT, Face, Moment
from growthx.model.loads import BodyForce, Traction

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation
    from growthx.meshing.mesh import Mesh
    from growthx.stepping.record import Step

EXACT = 1e-9  # of all that is summed: what is exact but for round-off
SPREAD = 100.0  # times the tolerance of a norm: what a sum over all nodes may make of it


class Witness:
    """Looks at each accepted step of one run."""

    def __init__(self, problem: Discretisation, tolerance: float) -> None:
        """tolerance: of Newton's method.

        Raises GrowthxError, on all ranks, if the nodal forces are not those of the scene's loads.
        """
        self._problem, self._tolerance = problem, tolerance
        self._scale, self._spoken = problem.system.force_scale(), False
        self._share = 1.0  # of that scale in the forces of the last step, where these are less
        self._turning_share = 1.0  # … times a length, in their moments
        self._middle, self._arm = _middle(problem.scene.mesh)
        self._tells_moments = not problem.scene.open_loads and problem.scene.inertia is None
        self._open = _OpenResultants(problem)
        _check_loads(problem)

    def defects(self, reactions: dict[str, Floats]) -> tuple[float, float]:
        """Those of forces and of moments, the largest of the load cases each; no unit.

        Forces: ‖Σ reactions + Σ loads‖ over the sum of their sizes.  Moments: the same, over the sum of their sizes and
        that of the forces times half of the longest side; NaN with loads that depend on the state, or inertia, of which
        no moments are known.  At the running iterate, to which the reactions belong.
        """
        loads = self._problem.system.loads
        forces = loads.at(self._problem.state)
        dead = loads.resultants(forces)
        of_cases = [
            # A name may be that of a boundary alone, where there is one case.
            [name for name in reactions if not case.name or name.startswith(f"{case.name}: ")]
            for case in self._problem.spaces.cases
        ]
        borne = [[*(reactions[name] for name in names), force] for names, force in zip(of_cases, dead, strict=True)]
        moment_defect = self._moment_defect(forces, borne, of_cases) if self._tells_moments else math.nan
        return self._force_defect(borne), moment_defect

    def _force_defect(self, borne: list[list[Floats]]) -> float:
        """borne: reactions and dead loads of each case."""
        worst, self._share = 0.0, 1.0
        for number, (case, known) in enumerate(zip(self._problem.spaces.cases, borne, strict=True)):
            forces = [*known, self._open.of_case(number)]
            size = _sizes(forces)
            if size > EXACT * self._scale:
                worst = max(worst, float(np.linalg.norm(sum(forces))) / size)
                self._share = min(self._share, case.weight * size / self._scale)
        return worst

    def _moment_defect(self, forces: Floats, borne: list[list[Floats]], of_cases: list[list[str]]) -> float:
        """forces: the nodal ones.  borne: reactions and dead loads of each case.  of_cases: names of the former."""
        problem, scale = self._problem, self._scale * self._arm
        # Of the iterate that the forces belong to, which the state has not become yet.
        displaced = problem.system.unknowns.displacement_arrays()
        turning = problem.system.loads.moments(forces, self._middle, displaced)
        rigid = problem.system.rigid
        for face, moment in zip(rigid.faces, rigid.turning(problem.state), strict=True):
            turning[face.case] += moment
        assert problem.system.borne is not None
        turned = problem.system.supports.moments(problem.system.borne, self._middle, displaced)
        worst, self._turning_share = 0.0, 1.0
        for number, case in enumerate(problem.spaces.cases):
            moments = [*(turned[name] for name in of_cases[number]), turning[number]]
            size = self._arm * _sizes(borne[number]) + _sizes(moments)
            if size > EXACT * scale:
                worst = max(worst, float(np.linalg.norm(sum(moments))) / size)
                self._turning_share = min(self._turning_share, case.weight * size / scale)
        return worst

    def hear(self, step: Step) -> None:
        """Say once, on rank 0, if a balance does not hold as it should."""
        if self._spoken:
            return
        for what, defect, allowed in (
            ("the mass gained is not what source and boundaries gave", step.mass_defect, self._mass_allowed(step)),
            ("the reactions do not balance the loads", step.force_defect, self._force_allowed(step, self._share)),
            (
                "the moments of the reactions do not balance those of the loads",
                step.moment_defect,
                self._force_allowed(step, self._turning_share),
            ),
        ):
            if defect > allowed:
                self._spoken = True
                self._say(f"at t = {step.time:g} {what}: off by {defect:.1g}, where {allowed:.1g} is explained")

    def _say(self, sentence: str) -> None:
        if self._problem.comm.rank == 0:
            logging.getLogger("growthx").warning(
                "growthx: %s; a law, a load or a support does not act in all parts of the model as it should: "
                "these results are not to be trusted",
                sentence,
            )

    def _mass_allowed(self, step: Step) -> float:
        """Of |Δm − Δt ṁ| over the mass: densities found cell by cell balance to round-off, nodal ones to tolerance."""
        problem = self._problem
        share = EXACT + (0.0 if problem.variant.density.local else SPREAD * self._newton_error(step))
        return share * (1 + step.time_step * problem.system.densities.unloaded_resorption() / step.mass)

    def _force_allowed(self, step: Step, share: float) -> float:
        """Residuals of the free nodes add up to what the supports do not bear; they are measured by the full loads."""
        return EXACT + SPREAD * self._newton_error(step) / share

    def _newton_error(self, step: Step) -> float:
        return max(self._tolerance, step.newton.round_off)


class _OpenResultants:
    """Resultants of what acts on the body beside dead loads and supports: open loads and inertia.

    The balance of momentum with a translation for a test function, to which stress contributes nothing.
    """

    def __init__(self, problem: Discretisation) -> None:
        scene = problem.scene
        self._problem = problem
        self._forms: list[dolfinx.fem.Form] = []
        if scene.open_loads or scene.inertia:
            still = np.zeros(scene.mesh.dim)
            self._moves = [dolfinx.fem.Constant(scene.mesh.domain, still) for _ in problem.spaces.cases]
            forms = [form for form in problem.system.densities.momentum_forms(self._moves) if form.integrals()]
            self._forms = [problem.compile.form(form) for form in forms]

    def of_case(self, number: int) -> Floats:
        """Force on the body (per thickness in two dimensions), shape (dim,)."""
        dim = self._problem.scene.mesh.dim
        force = np.zeros(dim)
        if self._forms:
            move = self._moves[number]
            for direction in range(dim):
                move.value[direction] = 1.0
                force[direction] = -sum(integral(form) for form in self._forms)
                move.value[direction] = 0.0
        return np.array(self._problem.comm.allreduce(force)) / self._problem.spaces.cases[number].weight


def _check_loads(problem: Discretisation) -> None:
    """Compare the nodal forces of full dead loads with what the scene says of them, where it tells their resultants."""
    scene, loads = problem.scene, problem.system.loads
    middle, arm = _middle(scene.mesh)
    full = loads.full()
    for case, found, turned in zip(
        problem.spaces.cases, loads.resultants(full), loads.moments(full, middle), strict=True
    ):
        dead = [load for load in case.loads if load in scene.dead_loads and not is_of_a_rigid_face(load, scene)]
        degree = 2 * problem.displacement_space.element.basix_element.degree
        known = [force for load in dead if (force := _resultant(load, scene.mesh, degree)) is not None]
        if not known or len(known) < len(dead):
            continue
        meant = np.sum(known, axis=0)
        size = _sizes(known)
        if size and np.linalg.norm(meant - found) > EXACT * size:
            raise GrowthxError(
                f"the dead loads of the scene '{scene.name}' sum to {meant} and their nodal forces to {found}: "
                "a load is lost, which is a defect of growthx: a report of it would be right"
            )
        moments = [moment for load in dead if (moment := _moment(load, scene.mesh, middle, degree)) is not None]
        if len(moments) < len(dead):
            continue
        turning = np.sum(moments, axis=0)
        if np.linalg.norm(turning - turned) > EXACT * (_sizes(moments) + size * arm):
            raise GrowthxError(
                f"the dead loads of the scene '{scene.name}' have the moment {turning} about {middle} and their nodal "
                f"forces {turned}: a load is lost, which is a defect of growthx: a report of it would be right"
            )


def _resultant(load: Any, mesh: Mesh, degree: int) -> Floats | None:
    """The resulting force of a dead load from the scene and the mesh's geometry; None where it is not as plain.

    degree: of the rule that loads on boundaries are integrated by.
    """
    if isinstance(load, NodalLoad):
        return load.total(mesh)
    if isinstance(load, Moment):
        return np.zeros(mesh.dim)
    if load.resultant is not None:
        return np.array(load.resultant)
    # Exactly these: a class of the user's own may have another intensity.
    if type(load) is Traction and not callable(load.value):
        return np.array(load.value) * _area(mesh, load.on, degree)
    if type(load) is BodyForce and not callable(load.value):
        return np.array(load.value) * _volume(mesh, load.region)
    return None


def _moment(load: Any, mesh: Mesh, about: Floats, degree: int) -> Floats | None:
    """The resulting moment of a dead load about a place, at rest, as `_resultant`; None where it is not as plain."""
    if isinstance(load, NodalLoad) and load.within == 0:
        places, forces = load.points(mesh)
        return np.sum([_cross(place - about, force) for place, force in zip(places, forces, strict=True)], axis=0)
    if isinstance(load, Moment):
        # On warped sides it is met but for the error of its rule.
        flat = mesh.cell_name != "hexahedron" or _is_flat(Face.of(mesh, load.on))
        return np.atleast_1d(np.array(load.moment, dtype=float)) if flat else None
    if type(load) is Traction and not callable(load.value):
        face = Face.of(mesh, load.on)
        flat = mesh.cell_name != "hexahedron" or _is_flat(face)
        return _cross(face.middle - about, face.area * np.array(load.value)) if flat else None
    return None


def _is_flat(face: Face) -> bool:
    """Whether a boundary lies in a plane."""
    sizes = np.linalg.eigvalsh(face.second)
    return bool(sizes[0] <= FLAT * sizes[-1])


def _sizes(vectors: list[Floats]) -> float:
    return sum(float(np.linalg.norm(vector)) for vector in vectors)


def _cross(arm: Floats, force: Floats) -> Floats:
    """Arm × force, shape (1,) in the plane, or (3,)."""
    if len(arm) == 2:
        return np.array([arm[0] * force[1] - arm[1] * force[0]])
    return np.asarray(np.cross(arm, force))


def _middle(mesh: Mesh) -> tuple[Floats, float]:
    """The middle of the box around the body, shape (dim,), and half of its longest side (collective)."""
    x = mesh.domain.geometry.x[:, : mesh.dim]
    ends = np.concatenate([x, -x], axis=1).max(axis=0, initial=-np.inf)
    mesh.comm.Allreduce(MPI.IN_PLACE, ends, MPI.MAX)
    high, low = ends[: mesh.dim], -ends[mesh.dim :]
    return (high + low) / 2, float((high - low).max() / 2)


def _area(mesh: Mesh, boundary: str, degree: int) -> float:
    """Area (in two dimensions, length) of a boundary, from the corners of its facets.

    degree: of the rule, which makes a difference of warped sides of hexahedra: their area is no polynomial.
    """
    dim, domain = mesh.dim, mesh.domain
    facets = mesh.owned_facets(boundary)
    shape = basix.cell.subentity_types(basix.CellType[mesh.cell_name])[dim - 1][0]
    X, weights = map(np.asarray, basix.make_quadrature(shape, degree))
    slopes = np.asarray(basix.create_element(basix.ElementFamily.P, shape, 1).tabulate(1, X))[1:, :, :, 0]
    area = 0.0
    if len(facets):
        corners = domain.geometry.x[dolfinx.mesh.entities_to_geometry(domain, dim - 1, facets)]
        tangents = np.einsum("dpn,fni->fpdi", slopes, corners)
        metric = np.einsum("fpdi,fpei->fpde", tangents, tangents)
        area = float(np.sqrt(np.linalg.det(metric)).sum(axis=0) @ weights)
    return float(mesh.comm.allreduce(area))


def _volume(mesh: Mesh, region: str | None) -> float:
    """Volume (in two dimensions, area) of a region, or of the body, from the corners of its cells."""
    X, weights = map(np.asarray, basix.make_quadrature(basix.CellType[mesh.cell_name], 3))
    of_cells = volume_ratios(mesh, X) @ weights
    cells = mesh.owned_cells if region is None else mesh.region(region)
    return float(mesh.comm.allreduce(float(of_cells[cells[cells < len(of_cells)]].sum())))
