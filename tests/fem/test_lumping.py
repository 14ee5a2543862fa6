"""The lumped density matrix (the paper's Remark 4.3): what it is, what it keeps and what it is good for."""

from dataclasses import replace

import dolfinx
import numpy as np
import pytest
import ufl
from blocks import (
    COMM,
    ROLLERS,
    assert_tangent_matches_differences,
    block,
    cube,
    densities,
    displacements,
    gathered,
    run,
    set_iterate,
    square,
    tangent,
)
from scipy.optimize import root

import growthx as gx
from growthx.common.errors import InputError
from growthx.constitutive.homogeneous import uniaxial_equilibrium
from growthx.discretisation.variants import CATALOGUE
from growthx.fem import kernels
from growthx.fem.assembly import assemble
from growthx.fem.lumping import at_nodes, node_shares
from growthx.scenes.bar import ATTRACTOR_LEVELS, DISCONTINUOUS, bar
from growthx.scenes.plate import plate

LINEAR = (gx.Q1Q1, gx.S2Q1, gx.P1P1, gx.P2P1)
linear = pytest.mark.parametrize("variant", LINEAR, ids=lambda variant: variant.name)
sources = pytest.mark.parametrize("source", [False, True], ids=["", "with its source"])


def density_matrix(problem):
    """∫ Nᵢ Nₖ dV of all ranks from the tangent of a scene that does not grow, rows and columns alike ordered."""
    problem.system.begin_step(0.1, 0.0)
    rows = tangent(problem)
    first = COMM.exscan(problem.system.owned) or 0
    own = first + problem.system.unknowns.density_part[: len(problem.volumes)]
    dofs = gathered(own).astype(int)
    return 0.1 / problem.system.densities.constants[0].value * rows[np.ix_(dofs, dofs)]


@linear
@pytest.mark.parametrize("distortion", [0.0, 0.06], ids=["regular", "distorted"])
def test_the_matrix_is_diagonal_and_keeps_the_mass(variant, distortion):
    """Lumping moves mass within a cell and makes none: the sum of all entries is the area, and none is negative."""
    scene = block(square(3, distortion, shape=variant.cells[0]), growth=gx.EnergyDrivenGrowth(0.01, rate=0.0))
    full, lumped = (density_matrix(gx.discretise(scene, v)) for v in (variant, variant.lumped()))
    assert np.abs(lumped - np.diag(np.diag(lumped))).max() < 1e-15
    assert np.abs(full - np.diag(np.diag(full))).max() > 1e-3
    assert np.diag(lumped).min() > 0
    assert [full.sum(), lumped.sum()] == pytest.approx([1.0, 1.0], rel=1e-12)
    if not distortion:  # on parallelograms, each node gets its row's sum
        assert np.diag(lumped) == pytest.approx(full.sum(axis=1), rel=1e-12)


@linear
def test_initial_mass_is_that_of_the_body(variant):
    """With nodal masses in place of shape functions, mass() must still be ∫ρ dV: 1.2 on the unit square."""
    problem = gx.discretise(block(square(3, 0.06, shape=variant.cells[0])), variant.lumped())
    assert problem.mass() == pytest.approx(1.2, rel=1e-13)


@linear
@sources
def test_mass_is_balanced_on_distorted_meshes(variant, source):
    """What is stored is what the source gives, at whatever points either is integrated."""
    steps, _ = run(block(square(3, 0.06, shape=variant.cells[0])), variant.lumped(with_source=source))
    assert max(step.mass_defect for step in steps) < 1e-11
    assert abs(steps[-1].mass / 1.2 - 1) > 1e-3


@linear
@sources
def test_tangent_is_the_derivative_of_the_forces(variant, source):
    """The lumped terms are forms of their own: one that is left out of the tangent costs Newton its speed."""
    scene = block(square(2, 0.06, shape=variant.cells[0]), flux=gx.MassFlux(0.05))
    problem = gx.discretise(scene, variant.lumped(with_source=source))
    problem.system.begin_step(0.1, 0.7)
    set_iterate(
        problem,
        lambda x: np.stack([0.3 * np.sin(2 * x[0]) + 0.1 * x[1], 0.2 * x[0] * x[1] - 0.15 * x[1]]),
        lambda x: 1.0 + 0.3 * np.cos(3 * x[0] + x[1]),
    )
    assert_tangent_matches_differences(problem, tangent(problem))


@pytest.mark.parametrize(
    ("variant", "source", "distortion"),
    # Row sums: the corners of a distorted quadrilateral store what they gain, whether the source is lumped or not.
    [(variant, source, 0.08) for variant in LINEAR for source in (False, True)],
    ids=lambda value: getattr(value, "name", None),
)
def test_a_homogeneous_block_does_not_feel_it(variant, source, distortion):
    """Where the density is uniform, lumping has nothing to move: the run is the same."""
    material, growth = gx.Material(3.0, 0.3, 1.2), gx.EnergyDrivenGrowth(0.05, 4.0)
    scene = block(
        square(2, distortion, shape=variant.cells[0]),
        material=material,
        growth=growth,
        supports=ROLLERS,
        loads=(gx.Traction("right", (0.9, 0.0)),),
        program=gx.Program(step=0.25, until=1.5, ramp=0.5),
    )
    plain, lumped = (run(scene, v, tolerance=1e-12)[1] for v in (variant, variant.lumped(with_source=source)))
    assert densities(lumped) == pytest.approx(densities(plain), rel=1e-9)
    assert displacements(lumped) == pytest.approx(displacements(plain), abs=1e-9)
    assert np.ptp(densities(lumped)[:, 2]) < 1e-9 and abs(densities(lumped)[0, 2] - 1.2) > 0.05
    rho = uniaxial_equilibrium(material, growth, 0.9).density
    at_rest = gx.homeostasis(scene, variant.lumped(with_source=source), tolerance=1e-12)
    assert densities(at_rest)[:, 2] == pytest.approx(rho, rel=1e-9)


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.P2P1], ids=lambda variant: variant.name)
def test_at_equilibrium_only_the_source_matters(variant):
    """Storage is a rate, which has vanished by then; a source at the corners is another discretisation."""
    scene = plate(6, shape=variant.cells[0])
    plain, storage, source = (
        densities(gx.homeostasis(scene, v))[:, 2] for v in (variant, variant.lumped(), variant.lumped(with_source=True))
    )
    assert storage == pytest.approx(plain, abs=1e-8)
    assert np.abs(source - plain).max() > 1e-2


def test_a_long_march_forgets_the_lumping_of_storage():
    """The same by marching, which takes another way there."""
    scene = replace(plate(4), program=gx.Program(step=20.0, until=4000.0, ramp=200.0))
    plain, lumped = (densities(gx.solve(scene, v).problem)[:, 2] for v in (gx.Q1Q1, gx.Q1Q1.lumped()))
    assert lumped == pytest.approx(plain, abs=1e-8)


# -- overshoots at the fronts of the discontinuous bar -----------------------------------------------------------------


def plateaux(scene):
    """Densities of the five levels at each step, (levels, steps): uniaxial plane strain under implicit Euler."""
    lam, mu = 0.2 / (1.2 * 0.6), 1 / 2.4  # E = 1, ν = 0.2
    program, rows = scene.program, []
    for level in ATTRACTOR_LEVELS:
        state, row = np.array([1.0, 1.0, 1.0]), []
        for share in map(program.amplitude, program.times()):

            def balances(at, old=state[2], traction=2 * share, level=level):
                a, b, rho = at
                log, weight = np.log(a * b), rho**2
                energy = lam / 2 * log**2 + mu / 2 * (a**2 + b**2 - 2 - 2 * log)
                return [
                    weight * (mu * a + (lam * log - mu) / a) - traction,
                    weight * (mu * b + (lam * log - mu) / b),
                    rho - old - program.step * (energy / rho - level),
                ]

            found = root(balances, state, tol=1e-13)
            assert np.abs(found.fun).max() < 1e-12
            state = found.x
            row.append(state[2])
        rows.append(row)
    return np.array(rows)


def overshoots(variant):
    """By how much nodal densities exceed the plateaux beside them, at each step, away from the clamped end."""
    scene = bar(DISCONTINUOUS, 40)
    levels, problem = plateaux(scene), gx.discretise(scene, variant)
    x = problem.density_positions()[:, 0]
    beside = [np.minimum((10 * np.minimum(x, 1 - x) + shift).astype(int), 4) for shift in (1e-6, -1e-6)]
    inner = (x > 0.25) & (x < 0.75)
    found = []
    for k, _ in enumerate(gx.march(scene, variant, problem)):
        excess = problem.density.x.array - np.maximum(levels[beside[0], k], levels[beside[1], k])
        found.append(max(COMM.allgather(excess[inner].max(initial=-np.inf))))
    return np.array(found)


def test_lumping_damps_overshoots_while_they_arise():
    """What Remark 4.3 promises: a first step almost without them.  With time they come back, as they belong to the
    equilibrium of the consistent source; at the corners, too, it has less of them."""
    full, lumped, with_source = (overshoots(v) for v in (gx.Q1Q1, gx.Q1Q1.lumped(), gx.Q1Q1.lumped(with_source=True)))
    assert full[0] > 3e-3
    assert lumped[0] < full[0] / 30  # t = 0.1
    assert lumped[2] < full[2] / 2  # t = 0.3
    assert np.all(lumped < full)
    assert lumped[-1] > 0.85 * full[-1]  # t = 6
    assert np.all(with_source < lumped)
    assert with_source[-1] < 0.65 * full[-1]


# -- masses at the nodes of quadratic cells ----------------------------------------------------------------------------


def node_masses(mesh, degree):
    """Masses at the nodes of each cell, as the rule there with its shares has them, shape (owned cells, nodes)."""
    space = dolfinx.fem.functionspace(mesh.domain, ("DG", degree))
    rule = at_nodes(ufl.Measure("dx", domain=mesh.domain), degree)
    masses = assemble(kernels.form(node_shares(mesh.domain, degree) * ufl.TestFunction(space) * rule))
    return masses.reshape(-1, space.dofmap.dof_layout.num_dofs)


@pytest.mark.parametrize("shape", ["quadrilateral", "hexahedron", "triangle", "tetrahedron"])
@pytest.mark.parametrize("degree", [1, 2])
def test_masses_at_nodes_are_positive_and_keep_the_volume(shape, degree):
    """Also on distorted cells, and on quadratic simplices, whose row sums are zero or negative at the corners."""
    mesh = square(12, 0.01, shape=shape) if shape in ("quadrilateral", "triangle") else cube(2, 0.05, shape=shape)
    masses = node_masses(mesh, degree)
    assert np.all(masses.min(axis=1) > 0.002 * masses.sum(axis=1))  # round-off of zero may be positive, too
    volumes = assemble(
        kernels.form(
            ufl.TestFunction(dolfinx.fem.functionspace(mesh.domain, ("DG", 0)))
            * ufl.dx(mesh.domain, metadata={"quadrature_degree": 5})
        )
    )
    assert masses.sum(axis=1) == pytest.approx(volumes, rel=1e-12)


def test_masses_at_nodes_are_those_of_textbooks():
    """Simpson's rule on a square; on a triangle and a tetrahedron, in proportion to ∫ N² (Hinton et al. 1976)."""
    of_square = node_masses(square(1), 2)
    expected = np.sort([1 / 36] * 4 + [4 / 36] * 4 + [16 / 36])
    assert np.sort(of_square) == pytest.approx(np.tile(expected, (len(of_square), 1)))
    of_triangle = node_masses(square(1, shape="triangle"), 2)
    expected = np.sort([3 / 57] * 3 + [16 / 57] * 3)
    assert np.sort(2 * of_triangle) == pytest.approx(np.tile(expected, (len(of_triangle), 1)))


# -- refusals ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
@sources
def test_what_has_no_positive_shares_at_corners_is_refused(variant, source):
    """Quadratic shares vanish there or have no positive mean, and local densities need no matrix: four are left."""
    if variant in LINEAR:
        lumped = variant.lumped(with_source=source)
        assert (lumped.storage_at_corners, lumped.source_at_corners) == (True, source)
        assert lumped.name == variant.name + (" lumped with its source" if source else " lumped")
        assert replace(lumped, name=variant.name, storage_at_corners=False, source_at_corners=False) == variant
        return
    with pytest.raises(InputError, match=r"cannot lump .*: Q1Q1, S2Q1, P1P1, P2P1 could") as caught:
        variant.lumped(with_source=source)
    assert variant.name in str(caught.value)
