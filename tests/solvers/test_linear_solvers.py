"""Linear solvers: chosen by kind and size, all of them with the answer of a direct one, and open to PETSc's options."""

import dolfinx
import numpy as np
import pytest
from blocks import COMM, block, cube, densities, gathered, run, square
from dolfinx.fem import petsc
from petsc4py import PETSc

import growthx as gx
from growthx.discretisation.variants import CATALOGUE
from growthx.fem.lumping import owned
from growthx.solvers import linear_solvers
from growthx.solvers.tangent import assemble_tangent

PREFIX = "test_linear_solvers_"
CASES = (
    gx.LoadCase("pull", 0.7, (gx.Traction("right", (0.1, 0.0)),)),
    gx.LoadCase("bend", 0.3, (gx.Traction("right", (0.0, 0.05)),)),
)


class Solved:
    """The tangent of a problem in its first step, its solver, and what that makes of the load."""

    def __init__(self, scene, variant):
        self.problem = gx.discretise(scene, variant)
        self.problem.system.begin_step(0.1, 0.5)
        self.problem.system.out_of_balance()
        self.matrix = petsc.create_matrix(self.problem.system.coupling)
        self.ksp = PETSc.KSP().create(COMM)
        self.ksp.setOptionsPrefix(PREFIX)
        self.solver = linear_solvers.set_up(self.ksp, self.problem.system, self.matrix)
        self.ksp.setFromOptions()
        self.assemble(1.0)

    def assemble(self, factor):
        """The tangent by a factor, and what the solver makes of it."""
        assemble_tangent(self.problem.system, self.matrix)
        self.matrix.scale(factor)
        self.solver.refresh()

    def error(self):
        """Solve for random forces, none where the body is held; ‖A x − b‖ / ‖b‖ of the solution."""
        b, x = self.matrix.createVecLeft(), self.matrix.createVecRight()
        b.array_w[:] = np.random.default_rng(COMM.rank).normal(size=b.local_size)
        for condition in self.problem.system.conditions:
            b.array_w[owned(condition)] = 0.0
        self.ksp.solve(b, x)
        assert self.ksp.getConvergedReason() > 0
        return (self.matrix * x - b).norm() / b.norm()


def use_no_factors(monkeypatch, largest_part=0):
    """Let no system be small; of one with several parts, those up to a size are."""
    for limit, size in (("LARGEST_CONDENSED", largest_part), ("LARGEST_MONOLITHIC", 0)):
        monkeypatch.setattr(linear_solvers, limit, dict.fromkeys(getattr(linear_solvers, limit), size))


@pytest.mark.parametrize(
    ("variant", "serial", "parallel"),
    [
        (gx.Q1P0, "Cholesky (CHOLMOD)", "Cholesky (MUMPS)"),
        (gx.Q1sri, "LU (MUMPS)", "LU (MUMPS)"),
        (gx.Q1Q1, "LU (MUMPS)", "LU (MUMPS)"),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_small_systems_are_factorised(variant, serial, parallel):
    """By Cholesky's method where the tangent is symmetric: half the work; in serial CHOLMOD's solutions are fast."""
    solved = Solved(block(), variant)
    assert solved.solver.direct
    assert solved.solver.description == (serial if COMM.size == 1 else parallel)
    assert solved.error() < 1e-10


@pytest.mark.parametrize(
    ("variant", "changes", "description"),
    [
        (gx.Q1P0, {}, "conjugate gradients with GAMG"),
        (gx.Q1sri, {}, "GMRES with GAMG"),
        (gx.Q1, {"inertia": gx.Inertia()}, "GMRES with GAMG"),
        (
            gx.Q1,
            {"loads": (), "cases": CASES},
            "conjugate gradients with field split (displacement_1: GAMG, displacement_2: GAMG)",
        ),
        (
            gx.Q1Q1,
            {},
            "flexible GMRES with field split (density: Chebyshev with Jacobi, displacement: GAMG)",
        ),
    ],
    ids=["symmetric", "not symmetric", "inertia", "two load cases", "monolithic"],
)
def test_large_systems_are_iterated(variant, changes, description, monkeypatch):
    """Conjugate gradients where the tangent is symmetric; multigrid for each displacement on its own."""
    use_no_factors(monkeypatch)
    solved = Solved(block(**changes), variant)
    assert not solved.solver.direct
    assert solved.solver.description == description
    condensed = variant.density.local
    tolerance = linear_solvers.TOLERANCE if condensed else linear_solvers.TOLERANCE_MONOLITHIC
    assert solved.error() < 1.01 * tolerance


def test_displacements_of_a_large_monolithic_system_may_be_small(monkeypatch):
    """A factor of theirs alone, symmetric, is a fraction of the whole's."""
    use_no_factors(monkeypatch, largest_part=10**6)
    solved = Solved(block(), gx.Q1Q1)
    assert f"displacement: Cholesky ({'CHOLMOD' if COMM.size == 1 else 'MUMPS'})" in solved.solver.description
    assert solved.error() < 1.01 * linear_solvers.TOLERANCE_MONOLITHIC


@pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
def test_the_solver_does_not_show_in_the_solution(variant, monkeypatch):
    """Newton's tolerance is that of the balances, whoever solves the linear systems on the way."""
    scene = block(square(4, 0.05, shape=variant.cells[0]))
    _compare(scene, variant, monkeypatch)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_nor_in_space(variant, monkeypatch):
    """Six rigid motions."""
    _compare(block(cube(3, 0.05)), variant, monkeypatch)


@pytest.mark.parametrize(
    ("variant", "changes"),
    [
        (gx.Q1, {"loads": (), "cases": CASES}),
        (gx.Q1Q1, {"loads": (), "cases": CASES}),
        (gx.Q1Q1, {"flux": gx.MassFlux(0.1), "prescribed_densities": (gx.PrescribedDensity("right", 1.3),)}),
        (gx.Q1Q1, {"growing": ("bone",)}),
        (gx.Q1Q1, {"supports": (gx.Support("left", (0.0, None)), gx.PointSupport((0.0, 0.0), (None, 0.0)))}),
    ],
    ids=["two cases, condensed", "two cases, monolithic", "flux", "resting", "roller"],
)
def test_nor_with_more_in_the_scene(variant, changes, monkeypatch):
    """Rows of what is held, or rests, have a 1 on the diagonal and nothing else, in each of the parts."""
    _compare(block(square(4), **changes), variant, monkeypatch)


def _compare(scene, variant, monkeypatch):
    steps, direct = run(scene, variant)
    use_no_factors(monkeypatch)
    others, iterated = run(scene, variant)
    assert len(others) == len(steps)
    for held in iterated.system.supports.held:  # to the last bit: no residual would bring it back
        assert np.array_equal(iterated.system.unknown.x.array[held.dofs], iterated.amplitude * held.values)
    assert densities(iterated) == pytest.approx(densities(direct), rel=1e-8)


def test_an_indefinite_tangent_is_solved():
    """CHOLMOD gives up on it, if it is not small; a later tangent, definite, must not find the solver broken."""
    solved = Solved(block(square(32)), gx.Q1)
    solved.assemble(-1.0)
    assert solved.solver.description == "Cholesky (MUMPS)"
    assert solved.error() < 1e-10
    solved.assemble(1.0)
    assert solved.error() < 1e-10


@pytest.mark.parametrize("factors", [True, False])
def test_a_new_tangent_is_what_is_solved(factors, monkeypatch):
    """PETSc does not look at a matrix again after a solution unless it is told to."""
    if not factors:
        use_no_factors(monkeypatch)
    solved = Solved(block(), gx.Q1)
    solved.error()
    solved.assemble(5.0)
    factor = solved.ksp.getPC()
    b, x = solved.matrix.createVecLeft(), solved.matrix.createVecRight()
    b.set(1.0)
    factor.apply(b, x)
    solved.assemble(10.0)
    y = x.duplicate()
    factor.apply(b, y)
    assert gathered(y.array_r) == pytest.approx(gathered(x.array_r) / 2, rel=1e-6)


@pytest.mark.parametrize("shape", ["quadrilateral", "hexahedron"])
@pytest.mark.parametrize("variant", [gx.Q1, gx.S2fri], ids=lambda variant: variant.name)
def test_multigrid_knows_the_rigid_motions(shape, variant, monkeypatch):
    """They take no force at rest, nor do serendipity's, whose unknowns are not all displacements of nodes."""
    use_no_factors(monkeypatch)
    solved = Solved(block(square(3) if shape == "quadrilateral" else cube(2)), variant)
    problem, matrix = solved.problem, solved.matrix
    problem.system.unknown.x.array[:] = 0.0
    problem.system.out_of_balance()
    problem.system.conditions.clear()
    assemble_tangent(problem.system, matrix)
    motions = matrix.getNearNullSpace().getVecs()
    assert len(motions) == (3 if shape == "quadrilateral" else 6)
    assert [[motion.dot(other) for other in motions] for motion in motions] == pytest.approx(np.eye(len(motions)))
    for motion in motions:
        assert (matrix * motion).norm() < 1e-12 * matrix.norm()


def test_iterations_do_not_grow_with_the_mesh(monkeypatch):
    """What multigrid is for: eight times the cells cost eight times the work."""
    use_no_factors(monkeypatch)
    iterations = []
    for cells in (5, 10):
        solved = Solved(block(cube(cells)), gx.Q1P0)
        solved.ksp.setTolerances(rtol=1e-8)
        solved.error()
        iterations.append(solved.ksp.getIterationNumber())
    assert iterations[1] < 1.5 * iterations[0]


def test_bounds_in_the_plane_keep_to_factors(monkeypatch):
    """SNES takes the densities at bounds out of the system, others each time; a factor there is cheap at any size."""
    use_no_factors(monkeypatch)
    growth = gx.EnergyDrivenGrowth(attractor=0.01, rate=5.0, bounds=(1.19, 1.21))
    steps, _ = run(block(growth=growth), gx.Q1Q1)
    low, high = steps[-1].min_density, steps[-1].max_density
    assert (low, high) == pytest.approx((1.19, 1.21))
    assert Solved(block(growth=growth), gx.Q1Q1).solver.direct


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)
def test_a_full_newton_method_factorises_at_any_size(variant, monkeypatch):
    """It stands for the paper's: its steps must be exact."""
    use_no_factors(monkeypatch)
    steps, _ = run(block(), variant, full_newton=True)
    assert steps[0].newton.linear_solver.startswith(("Cholesky", "LU"))


def test_petsc_options_override(monkeypatch):
    """Under the prefix of the KSP; the log tells what has come of them."""
    use_no_factors(monkeypatch)
    options = {"ksp_type": "gmres", "fieldsplit_displacement_pc_type": "jacobi", "pc_fieldsplit_type": "additive"}
    database = PETSc.Options(PREFIX)
    for name, value in options.items():
        database[name] = value
    solved = Solved(block(), gx.Q1Q1)
    for name in options:
        database.delValue(name)
    assert solved.solver.description == (
        "GMRES with field split (density: Chebyshev with Jacobi, displacement: Jacobi)"
    )


@pytest.mark.parametrize("factors", ["one sweep", "two, as the user has it"])
def test_multigrid_is_as_chosen_or_as_the_user_has_it(factors, monkeypatch):
    """What GAMG knows by options alone is not left to PETSc's defaults, which change, and is gone afterwards."""
    use_no_factors(monkeypatch)
    database, name = PETSc.Options(PREFIX), "mg_levels_ksp_max_it"
    mine = factors != "one sweep"
    if mine:
        database[name] = 2
    solved = Solved(block(square(16)), gx.Q1P0)
    hierarchy = solved.ksp.getPC()
    assert hierarchy.getMGLevels() > 1
    assert hierarchy.getMGSmoother(1).getTolerances()[3] == (2 if mine else 1)
    assert database.hasName(name) == mine
    database.delValue(name)
    assert solved.error() < 1.01 * linear_solvers.TOLERANCE


def contrasts(cells, shape):
    """A block of two by one by one: densities 0.02 and 2 in turn, in cubes of an eighth, about a stiff pin.

    By the square of the density neighbours differ 1e4 times in stiffness; the pin is 1000 times as stiff as bone of 1.
    """
    counts, kind = [2 * cells, cells, cells], getattr(dolfinx.mesh.CellType, shape)
    domain = dolfinx.mesh.create_box(COMM, [np.zeros(3), np.array([2.0, 1.0, 1.0])], counts, kind)

    def pin(x, within):
        across = np.all(np.abs(x[1:] - 0.5) <= 0.125 + within, axis=0)
        return across & (x[0] >= 1.0 - within)

    return block(
        gx.Mesh.with_names(
            domain,
            {"left": lambda x: np.isclose(x[0], 0.0), "right": lambda x: np.isclose(x[0], 2.0)},
            {"pin": lambda x: pin(x, 1e-9), "bone": lambda x: ~pin(x, -1e-9)},
        ),
        material=gx.Material({"bone": 1.0, "pin": 1000.0}, 0.3, 1.0),
        growing=("bone",),
    )


@pytest.mark.parametrize(
    "cells", [8, pytest.param(16, marks=pytest.mark.slow), pytest.param(24, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize(
    ("variant", "shape"), [(gx.Q1P0, "hexahedron"), (gx.P1P0, "tetrahedron")], ids=["hexahedra", "tetrahedra"]
)
def test_multigrid_bears_what_bones_and_implants_contrast_by(cells, variant, shape, monkeypatch):
    """Thirty iterations to 1e-8 at any size: Chebyshev's sweeps end without a solution on these tetrahedra."""
    use_no_factors(monkeypatch)
    problem = gx.discretise(contrasts(cells, shape), variant)
    dense = np.sum(np.floor(8 * problem.density_positions() + 1e-9), axis=1) % 2 == 0
    problem.system.set_density(np.where(dense, 2.0, 0.02))
    problem.system.begin_step(1e-6, 1e-3)
    problem.system.out_of_balance()
    matrix = petsc.create_matrix(problem.system.coupling)
    assemble_tangent(problem.system, matrix)
    ksp = PETSc.KSP().create(COMM)
    ksp.setOptionsPrefix(PREFIX)
    linear_solvers.set_up(ksp, problem.system, matrix, single=False).refresh()
    ksp.setTolerances(rtol=1e-8)
    load, found = matrix.createVecRight(), matrix.createVecRight()
    load.array_w[:] = problem.system.loads.at(problem.system.state)
    load.array_w[problem.system.layout.held] = 0.0
    ksp.solve(load, found)
    assert ksp.getConvergedReason() > 0 and ksp.getIterationNumber() <= 30
    rest = (load - matrix * found).array_r.copy()
    rest[problem.system.layout.held] = 0.0
    assert np.linalg.norm(gathered(rest)) <= 1.01e-8 * load.norm()
