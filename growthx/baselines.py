"""Baselines of the literature, to compare with: the density is updated after equilibrium, not together with it.

    for each time step:
        solve the balance of momentum at frozen density       u of ρₙ
        ρₙ₊₁ = ρₙ + Δt R₀(ρₙ, u)                              explicit Euler, ρₙ₊₁ not below a floor

The variant says where: Q1P0 is the element-based update (Huiskes et al. 1987, Weinans et al. 1992, J. Biomech. 25,
1425), Q1Q1 the node-based one (Jacobs et al. 1995, J. Biomech. 28, 449), Q1 is explicit Euler at the integration
points.  What suppresses checkerboards is an `Averaging`, of the source before the update or of the density after it.

The update is stable for Δt < 2/|∂R₀/∂ρ| only.  With (6) at equilibrium, |∂R₀/∂ρ| = k c Ψ₀*/ρ; k is m − n where the
strain does not follow the density and, at small strains, m + n where the stress does not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import basix
import dolfinx
import numpy as np
import ufl
from mpi4py import MPI
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from growthx import balances
from growthx.assembly import assemble, sum_cells
from growthx.compat import interpolation_points
from growthx.errors import EndedEarly, InputError, require_number
from growthx.fields import is_uniform, law_as_ufl
from growthx.marching import Step, discretise, take_back
from growthx.newton import Newton, NewtonReport
from growthx.sampling import positions
from growthx.smoothing import corner_functions, smoothed_density
from growthx.variants import equal_sided, right_ones

if TYPE_CHECKING:
    from growthx.arrays import Floats, Indices
    from growthx.discretisation import Discretisation
    from growthx.scene import Scene
    from growthx.variants import Variant

FLOOR = 0.01  # g/cm³, the literature's density of what is resorbed
FAR = 5.0  # radii beyond which a neighbour does not count: its weight is below 1 %
FLAT = 1e-9  # width over length, squared, below which cells or nodes lie on a line


class Averaging(Protocol):
    """A way to average values that belong to densities."""

    def on(self, problem: Discretisation) -> Callable[[Floats], Floats]:
        """The average on a problem: of values of this rank's growing densities, (densities,), to values of the same."""
        ...


@dataclass(frozen=True)
class NonLocal:
    """Mean over the neighbourhood by volume and by exp(−distance/radius) (Mullender et al. 1994, J. Biomech. 27, 1389).

    There the sensors' excess over the attractor is averaged, which is what the mass source is in proportion to; for a
    uniform attractor this is the average of the stimulus.  radius: length over which the influence falls to 1/e.
    """

    radius: float

    def __post_init__(self) -> None:
        require_number(self.radius, "the radius of the average", "a positive number", lambda r: r > 0)

    def weights(self, problem: Discretisation) -> csr_array:
        """Shares of all ranks' densities in the means of this one's, shape (densities, all densities); rows sum to one.

        Times volume and the row's sum of influences, they are symmetric.
        """
        here = problem.density_positions()[problem.density_dofs]
        everywhere = np.concatenate(problem.comm.allgather(here))
        volumes = np.concatenate(problem.comm.allgather(problem.volumes[problem.density_dofs]))
        near = KDTree(here).sparse_distance_matrix(KDTree(everywhere), FAR * self.radius, output_type="ndarray")
        influence = np.exp(-near["v"] / self.radius) * volumes[near["j"]]
        total = np.bincount(near["i"], influence, minlength=len(here))
        shares = influence / total[near["i"]]
        return csr_array((shares, (near["i"], near["j"])), shape=(len(here), len(everywhere)))

    def on(self, problem: Discretisation) -> Callable[[Floats], Floats]:
        """The average on a problem."""
        weights, comm = self.weights(problem), problem.comm
        return lambda values: np.asarray(weights @ np.concatenate(comm.allgather(values)))


@dataclass(frozen=True)
class Smoothed:
    """Extrapolated to the corners of the cells, averaged there over the cells, and put back into the cells."""

    def on(self, problem: Discretisation) -> Callable[[Floats], Floats]:
        """The average on a problem, whose density it changes; InputError if densities are at nodes, smooth already."""
        variant, space = problem.variant, problem.density_space
        if not variant.density.local:
            right = right_ones(problem.scene.mesh.cell_name, lambda other: other.density.local)
            raise InputError(f"{variant.name} has densities at nodes, which smoothing leaves as they are: {right}")
        cells, shares = problem.scene.mesh.owned_cells, corner_functions(problem)

        def smooth(values: Floats) -> Floats:
            problem.density.x.array[problem.density_dofs] = values
            corners = smoothed_density(problem)
            back = np.empty_like(problem.density.x.array)
            of_cells = corners.x.array[corners.function_space.dofmap.list[: len(cells)]]
            back[space.dofmap.list[: len(cells)]] = of_cells @ shares.T
            return back[problem.density_dofs]

        return smooth


def frozen(scene: Scene, variant: Variant) -> Discretisation:
    """The discretisation of a scene whose density does not change by itself, for `update`.

    Raises InputError where mass moves, which the baselines do not know.
    """
    if scene.moves_mass:
        raise InputError(
            f"the scene '{scene.name}' moves mass, which an update after equilibrium does not know: "
            "one without flux, influx and prescribed densities would be right"
        )
    return discretise(replace(scene, growth=replace(scene.growth, rate=0.0, bounds=(None, None))), variant)


def update(
    scene: Scene,
    variant: Variant,
    problem: Discretisation | None = None,
    *,
    source_average: Averaging | None = None,
    density_average: Averaging | None = None,
    floor: float = FLOOR,
    tolerance: float = 1e-10,
) -> Iterator[Step]:
    """Advance a scene through its program by updates after equilibrium, yielding each step; time steps are never cut.

    problem: from `frozen`, when the caller wants to look at it between steps; its displacement is in balance with the
    density before the update.  source_average: of the mass source before the update.  density_average: of the density
    after it.  floor: lowest density; the law's bounds hold as well.  tolerance: see `newton.Newton`.
    `mass_defect` of a step is the mass that averages, floor and bounds have made or lost, over the mass.
    Raises InputError for nodes without a volume (P2P2) and for a problem that is not frozen, and EndedEarly
    where no equilibrium is found.
    """
    require_number(floor, "the lowest density", "a positive number", lambda rho: rho > 0)
    problem = frozen(scene, variant) if problem is None else problem
    if not (is_uniform(problem.scene.growth.rate) and problem.scene.growth.rate == 0):
        raise InputError("the problem to be updated grows by itself: one from `baselines.frozen` would be right")
    dofs, program = problem.density_dofs, scene.program
    source = _source(scene, problem)
    of_source, of_density = (
        average.on(problem) if average else _as_it_is for average in (source_average, density_average)
    )
    low, high = max(floor, scene.growth.limits[0]), scene.growth.limits[1]
    newton, time, mass = Newton(problem, tolerance), 0.0, problem.mass()
    try:
        for end in map(float, program.times()):
            time_step = end - time
            problem.begin_step(time_step, program.amplitude(end), end)
            report, reactions = _equilibrium(problem, newton, time, program.until)
            rate, old_density = source(), problem.density.x.array[dofs]
            density = np.clip(old_density + time_step * of_source(rate), low, high)
            _set_density(problem, np.clip(of_density(density), low, high))
            gain = problem.comm.allreduce(float(problem.volumes[dofs] @ rate))
            time, old_mass, mass = end, mass, problem.mass()
            defect = abs(mass - old_mass - time_step * gain) / mass
            yield Step(
                end, time_step, problem.amplitude, 0, report, np.nan, mass, defect, *problem.density_range(), reactions
            )
    finally:
        newton.destroy()


def _equilibrium(
    problem: Discretisation, newton: Newton, time: float, until: float
) -> tuple[NewtonReport, dict[str, Floats]]:
    """Solve the balance of momentum, accept it and return how that went and the reactions; EndedEarly if it failed."""
    report = newton.solve()
    if not report.converged:
        raise EndedEarly(f"the run ended at t = {time:g} of {until:g}: {take_back(problem, report)}")
    reactions = problem.reactions()
    problem.accept_step()
    return report, reactions


def _as_it_is(values: Floats) -> Floats:
    return values


def _source(scene: Scene, problem: Discretisation) -> Callable[[], Floats]:
    """R₀ of the state at each growing density, (densities,): the mean over what belongs to it, weighted by its test."""
    variant, growth = problem.variant, law_as_ufl(scene.growth, scene.mesh)
    test = ufl.TestFunction(problem.density_space)
    dV = problem.growing_volume.reconstruct(metadata={"quadrature_degree": variant.mass_degree})
    shares = assemble(problem.compile.form(test * dV))[problem.density_dofs]
    least = problem.comm.allreduce(float(shares.min(initial=np.inf)), MPI.MIN)
    if least < 1e-9 * problem.comm.allreduce(float(shares.max(initial=0.0)), MPI.MAX):
        raise InputError(
            f"{variant.name} has nodes to which no volume belongs, over which the source has no mean: "
            "densities of degree 1, or of cells or points, would be right"
        )
    energy = problem.mean_energy()
    form = problem.compile.form(balances.source(problem.density, energy, test, growth, problem.material, dV))
    return lambda: assemble(form)[problem.density_dofs] / shares


def _set_density(problem: Discretisation, density: Floats) -> None:
    """Make densities of this rank's growing ones the state, and the start of the next step."""
    problem.density.x.array[problem.density_dofs] = density
    problem.density.x.scatter_forward()
    problem.set_density(problem.density.x.array)


def checkerboard_index(problem: Discretisation) -> float:
    """Mean jump of density from one neighbour to the next, over the mean of the two; no unit, global.

    Neighbours are cells that share a facet, with their mean densities, or nodes next to one another in a cell.
    Slopes of a smooth density count as well, in proportion to the size of cells: not in `high_frequency_index`.
    """
    density, pairs = _compared(problem)
    return _mean_jump(problem, density, density, pairs)


def high_frequency_index(problem: Discretisation) -> float:
    """The part of the checkerboard index that a density which is linear around each neighbour does not explain.

    From each density is taken the linear function nearest to those around it: to cells by the number of corners they
    share, to nodes by the number of cells.  A checkerboard keeps all of its index inside the body, a linear density has
    none.
    """
    density, pairs = _compared(problem)
    return _mean_jump(problem, _without_slopes(problem, density), density, pairs)


def _compared(problem: Discretisation) -> tuple[dolfinx.fem.Function, Indices]:
    """Densities of cells or nodes, and the pairs of neighbours among them, shape (pairs, 2)."""
    problem.density.x.scatter_forward()
    if problem.variant.density.local:
        cells = dolfinx.fem.Function(dolfinx.fem.functionspace(problem.scene.mesh.domain, ("DG", 0)))
        places = cells.function_space.dofmap.list[:, 0]
        cells.x.array[places] = problem.density.x.array[problem.density_space.dofmap.list].mean(axis=1)
        return cells, places[_beside_facets(problem)]
    owned = problem.density_space.dofmap.list[: len(problem.scene.mesh.owned_cells)]
    return problem.density, owned[:, _beside_nodes(problem)].reshape(-1, 2)


def _mean_jump(
    problem: Discretisation, values: dolfinx.fem.Function, density: dolfinx.fem.Function, pairs: Indices
) -> float:
    """Mean over all ranks' pairs of the jump of values over the mean density of the two."""
    jumps = np.abs(np.diff(values.x.array[pairs], axis=1)[:, 0]) / density.x.array[pairs].mean(axis=1)
    total, count = problem.comm.allreduce(np.array([jumps.sum(), jumps.size]))
    return float(total / count)


def _without_slopes(problem: Discretisation, density: dolfinx.fem.Function) -> dolfinx.fem.Function:
    """Densities of cells or nodes less the linear functions nearest to those around them."""
    mesh, space = problem.scene.mesh, density.function_space
    of_cells = space.dofmap.list[: len(mesh.owned_cells)]
    x = positions(mesh, interpolation_points(space.element))[:, :, : mesh.dim]
    at = density.x.array[of_cells][:, :, np.newaxis]
    squares = (x[:, :, :, np.newaxis] * x[:, :, np.newaxis, :]).reshape(*x.shape[:2], -1)
    moments = np.concatenate([np.ones_like(at), x, at, squares, x * at], axis=2)
    around, places = _sums_around(problem, space, moments), np.full((len(density.x.array), mesh.dim), np.nan)
    places[of_cells] = x
    rest = dolfinx.fem.Function(space)
    own = slice(space.dofmap.index_map.size_local)
    rest.x.array[own] = density.x.array[own] - _linear_fit(around[own], places[own])
    rest.x.scatter_forward()
    return rest


def _sums_around(problem: Discretisation, space: dolfinx.fem.FunctionSpace, moments: Floats) -> Floats:
    """Sums of moments, (owned cells, densities of a cell, moments), over the cells, or nodes, around each of them."""
    of_cells = space.dofmap.list[: len(moments)]
    if not problem.variant.density.local:
        return sum_cells(space, np.broadcast_to(moments.sum(axis=1, keepdims=True), moments.shape))
    corners = dolfinx.fem.functionspace(space.mesh, ("Lagrange", 1))
    shape = (*corners.dofmap.list[: len(moments)].shape, moments.shape[2])
    at_corners = sum_cells(corners, np.broadcast_to(moments, shape))
    sums = np.zeros((len(space.dofmap.list), moments.shape[2]))
    sums[of_cells[:, 0]] = at_corners[corners.dofmap.list[: len(moments)]].sum(axis=1)
    return sums


def _linear_fit(sums: Floats, x: Floats) -> Floats:
    """Values at x, (places, dim), of the linear functions of least squares with these sums of moments.

    The moments are 1, x, ρ, x ⊗ x and x ρ.  Where all that count lie on a line, as in a row of cells, the slope does.
    """
    dim = x.shape[1]
    first = sums / sums[:, :1]
    middle, mean = first[:, 1 : 1 + dim], first[:, 1 + dim]
    spread = first[:, 2 + dim : -dim].reshape(-1, dim, dim) - middle[:, :, np.newaxis] * middle[:, np.newaxis, :]
    common = first[:, -dim:] - middle * mean[:, np.newaxis]
    slope = np.einsum("pij,pj->pi", np.linalg.pinv(spread, rcond=FLAT, hermitian=True), common)
    return np.asarray(mean + np.einsum("pi,pi->p", slope, x - middle))


def _beside_nodes(problem: Discretisation) -> Indices:
    """Pairs of densities of a cell whose nodes have no other between them along an edge, shape (pairs, 2)."""
    cell = problem.scene.mesh.cell_name
    X = equal_sided(basix.CellType[cell], interpolation_points(problem.density_space.element))
    distance = np.abs(X[:, np.newaxis] - X).sum(axis=2)
    nearest = distance[distance > 0].min()
    return np.argwhere(np.triu(np.isclose(distance, nearest)))


def _beside_facets(problem: Discretisation) -> Indices:
    """The two cells beside each facet inside the body that this rank owns, shape (facets, 2)."""
    topology, dim = problem.scene.mesh.domain.topology, problem.scene.mesh.dim
    topology.create_connectivity(dim - 1, dim)
    beside = topology.connectivity(dim - 1, dim)
    starts = beside.offsets[: topology.index_map(dim - 1).size_local + 1]
    inside = np.flatnonzero(np.diff(starts) == 2)
    return np.asarray(beside.array[starts[inside, np.newaxis] + np.arange(2)])
