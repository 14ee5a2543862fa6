"""Small bodies for tests, the unit square and cube, distorted or not, and what the tests ask of their discretisations.

A variant's own cells are `variant.cells[0]` in the plane and `variant.cells[1]` in space.
"""

from dataclasses import replace

import basix
import dolfinx
import numpy as np
import pytest
import ufl
from hypothesis import HealthCheck, Phase, settings
from mpi4py import MPI

import growthx as gx
from growthx.fem import kernels
from growthx.fem.assembly import assemble
from growthx.fem.cells import SIMPLICES
from growthx.fem.lumping import owned
from growthx.solvers.newton import Newton

COMM = MPI.COMM_WORLD


def fuzz(examples):
    """Settings of hypothesis for input that nobody would think of: as many examples, the same ones each time."""
    return settings(
        derandomize=True,
        deadline=None,
        database=None,
        max_examples=examples,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )


SIDES = {  # name: direction, position
    "left": (0, 0.0),
    "right": (0, 1.0),
    "bottom": (1, 0.0),
    "top": (1, 1.0),
    "front": (2, 0.0),
    "back": (2, 1.0),
}

# A body on them is free to become thinner: pulled, it is in a homogeneous uniaxial state.
ROLLERS = (gx.Support("left", (0.0, None)), gx.Support("bottom", (None, 0.0)))


def square(cells=3, distortion=0.0, length=1.0, shape="quadrilateral"):
    """[0, 1]² times `length` in cells × cells quadrilaterals, or twice as many right-angled triangles.

    Its regions are "bone" (left half) and "implant".  Distorted, the nodes inside have moved.
    """
    mesh = _named(dolfinx.mesh.create_unit_square(COMM, cells, cells, getattr(dolfinx.mesh.CellType, shape)))
    x = mesh.domain.geometry.x
    shift = distortion * np.sin(np.pi * x[:, 0]) * np.sin(np.pi * x[:, 1])
    x[:, 0] = length * (x[:, 0] + shift)
    x[:, 1] = length * (x[:, 1] - 0.7 * shift)
    return mesh


def cube(cells=2, distortion=0.0, shape="hexahedron"):
    """[0, 1]³ in cells × cells × cells hexahedra, or six times as many tetrahedra; regions as in `square`.

    Distorted, the nodes inside have moved, and those on the sides within the sides.
    """
    mesh = _named(dolfinx.mesh.create_unit_cube(COMM, cells, cells, cells, getattr(dolfinx.mesh.CellType, shape)))
    x = mesh.domain.geometry.x
    waves = np.sin(np.pi * x)
    x[:] += distortion * waves * (np.roll(x, 1, axis=1) - 0.7 * np.roll(x, -1, axis=1))
    return mesh


def _named(domain):
    """The mesh with its sides, and its halves to the left and right of the middle, named."""
    dim = domain.topology.dim
    sides = {name: (i, at) for name, (i, at) in SIDES.items() if i < dim}
    return gx.Mesh.with_names(
        domain,
        {name: lambda x, i=i, at=at: np.isclose(x[i], at) for name, (i, at) in sides.items()},
        {"bone": lambda x: x[0] <= 0.5 + 1e-6, "implant": lambda x: x[0] >= 0.5 - 1e-6},
    )


def block(mesh=None, **changes):
    """A clamped block bent and stretched by a traction, over four steps, the first two of them ramping."""
    mesh = square() if mesh is None else mesh
    scene = gx.Scene(
        name="block",
        mesh=mesh,
        material=gx.Material(young=1.0, poisson=0.25, reference_density=1.2),
        growth=gx.EnergyDrivenGrowth(attractor=0.01, rate=5.0),
        supports=(gx.Support("left"),),
        loads=(gx.Traction("right", (0.1, -0.02, 0.01)[: mesh.dim]),),
        program=gx.Program(step=0.1, until=0.4, ramp=0.2),
    )
    return replace(scene, **changes)


def region_size(mesh, name=None):
    """Area or volume of a region, or of the whole body, over all ranks."""
    return _integral(mesh, mesh.volume_measure(name, 3))


def boundary_size(mesh, name):
    """Length or area of a boundary, over all ranks."""
    return _integral(mesh, mesh.boundary_measure(name, 2))


def _integral(mesh, measure):
    one = dolfinx.fem.Constant(mesh.domain, 1.0)
    return COMM.allreduce(dolfinx.fem.assemble_scalar(kernels.form(one * measure)))


def file_refusal(path, **parameters):
    """The one sentence, naming the file, with which every rank refuses the file of a mesh."""
    with pytest.raises(gx.InputError) as caught:
        gx.meshing.read(path, **parameters)
    (sentence,) = set(COMM.allgather(str(caught.value)))
    assert "\n" not in sentence and path.name in sentence
    return sentence


def strip(mesh, soft="soft", stiff="stiff", variant=gx.Q1):
    """Displacement of the right end and reaction of the left of two unit squares, pulled with 0.1.

    Without Poisson's effect: P = E (l − 1/l)/2 in each square, of E = 1 and of E = 10; l = 1.1049876 and 1.0100500.
    """
    scene = gx.Scene(
        name="strip",
        mesh=mesh,
        material=gx.Material(young={soft: 1.0, stiff: 10.0}, poisson=0.0),
        growth=gx.EnergyDrivenGrowth(attractor=0.0, rate=0.0),
        supports=(gx.Support("left", (0.0, None)), gx.PointSupport((0.0, 0.0), (None, 0.0))),
        loads=(gx.Traction("right", (0.1, 0.0)),),
        program=gx.Program(step=1.0, until=1.0),
    )
    result = gx.solve(scene, variant)
    u = result.problem.sample_displacement(np.array([[2.0, 0.5]]))[0, 0]
    return float(u), float(result.steps[-1].reactions["left"][0])


def run(scene, variant, **options):
    """The steps of a run and the discretised scene at its end."""
    problem = gx.discretise(scene, variant)
    return list(gx.march(scene, variant, problem, **options)), problem


def gathered(local):
    """The owned entries of all ranks, one after another."""
    return np.concatenate(COMM.allgather(np.asarray(local)))


def densities(problem):
    """(x, y, ρ), or (x, y, z, ρ), of all densities of all ranks, sorted by place."""
    dim, count = problem.scene.mesh.dim, problem.density_space.dofmap.index_map.size_local
    rows = np.column_stack([problem.density_positions()[:count, :dim], problem.density.x.array[:count]])
    return _sorted_by_place(gathered(rows), dim)


def mass_residual(problem):
    """What the balance of mass of each owned density is out by in the last step, as a weak form has it."""
    test = ufl.TestFunction(problem.density_space)
    degree = problem.variant.mass_degree
    dV = problem.spaces.growing_volume.reconstruct(metadata={"quadrature_degree": degree})
    source = problem.growth.mass_source(problem.density, problem.expressions.energy(), problem.material)
    change = (problem.density - problem.state.old_density) / problem.state.time_step
    return assemble(problem.compile.form((change - source) * test * dV))


def displacements(problem):
    """(x, y, u_x, u_y), or (x, y, z, u_x, u_y, u_z), of all corners of cells of all ranks, sorted by place."""
    dim = problem.scene.mesh.dim
    space = dolfinx.fem.functionspace(problem.scene.mesh.domain, ("Lagrange", 1, (dim,)))
    corners = dolfinx.fem.Function(space)
    corners.interpolate(problem.displacement)
    count = space.dofmap.index_map.size_local
    u = corners.x.array[: dim * count].reshape(-1, dim)
    return _sorted_by_place(gathered(np.column_stack([space.tabulate_dof_coordinates()[:count, :dim], u])), dim)


def _sorted_by_place(rows, dim):
    return rows[np.lexsort(np.round(rows[:, :dim].T, 9))]


def inside(cell, count=200):
    """Points of the reference cell, shape (count, dim), the same ones at each call."""
    dim = len(basix.topology(basix.CellType[cell])) - 1
    generator = np.random.default_rng(0)
    if cell in SIMPLICES:
        return generator.dirichlet(np.ones(dim + 1), size=count)[:, :dim]
    return generator.uniform(size=(count, dim))


def elastic_energy(material, H):
    """Ψ₀ⁿᵉᵒ at displacement gradients H, shape (…, dim, dim), by NumPy and of numbers near one."""
    F = np.eye(H.shape[-1]) + H
    J = np.linalg.det(F)
    return material.elastic_energy(np.sum(F**2, axis=(-2, -1)) - H.shape[-1] - 2 * (J - 1), J - 1)


def set_iterate(problem, displacement, density):
    """Put functions of position on the running iterate (the density only where it is an unknown)."""
    if problem.system.unknown is problem.displacement:
        problem.system.unknown.interpolate(displacement)
    else:
        problem.system.unknown.sub(0).interpolate(displacement)
        problem.system.unknown.sub(1).interpolate(density)
    for held in problem.system.supports.held:
        problem.system.unknown.x.array[held.dofs] = problem.amplitude * held.values
    problem.system.unknown.x.scatter_forward()


def tangent(problem):
    """The matrix that Newton's method gets from PETSc at the running iterate, all of it, as an array."""
    newton = Newton(problem.system)
    newton._snes.setUp()
    solution = newton._solution
    solution.array_w[:] = problem.system.unknown.x.array[: solution.local_size]
    problem.system.out_of_balance()
    newton._snes.computeJacobian(solution, newton._tangent.matrix)
    first, last = newton._tangent.matrix.getOwnershipRange()
    rows = gathered(newton._tangent.matrix.getValues(range(first, last), range(newton._tangent.matrix.size[1])))
    newton.destroy()
    return rows


def differences(problem, step=1e-6):
    """The same matrix by central differences of the out-of-balance forces; held unknowns get unit rows and columns."""
    size, held = COMM.allreduce(problem.system.owned), _held(problem)
    units = np.eye(size)
    columns = [units[j] if j in held else difference_along(problem, units[j], step) for j in range(size)]
    return np.array(columns).T


def difference_along(problem, direction, step=1e-6):
    """Central difference of the out-of-balance forces along a direction in all unknowns of all ranks."""
    unknown, size = problem.system.unknown.x.array, problem.system.owned
    first = COMM.exscan(size) or 0
    start, forces = unknown.copy(), []
    for sign in (1, -1):
        unknown[:] = start
        unknown[:size] += sign * step * direction[first : first + size]
        forces.append(problem.system.out_of_balance())
    unknown[:] = start
    problem.system.unknown.x.scatter_forward()
    problem.system.densities.update()
    return gathered((forces[0] - forces[1]) / (2 * step))


def assert_tangent_matches_differences(problem, exact, count=5):
    """Along random directions, in which any wrong entry shows, at the cost of a few differences."""
    for direction in free_directions(problem, count):
        difference = difference_along(problem, direction)
        assert exact @ direction == pytest.approx(difference, rel=1e-6, abs=1e-8 * np.abs(difference).max())


def free_directions(problem, count):
    """Random directions in all unknowns of all ranks, zero where they are held, shape (count, unknowns)."""
    directions = np.random.default_rng(0).normal(size=(count, COMM.allreduce(problem.system.owned)))
    directions[:, sorted(_held(problem))] = 0.0
    return directions


def _held(problem):
    """Numbers of the held unknowns, over all ranks."""
    first = COMM.exscan(problem.system.owned) or 0
    own = {int(first + dof) for condition in problem.system.conditions for dof in owned(condition)}
    return set().union(*COMM.allgather(own))
