"""Factors in single precision steer Newton's method as well as those in double precision, and give way where not."""

import numpy as np
import pytest
from blocks import COMM, block, cube, displacements, run, square
from petsc4py import PETSc

import growthx as gx
from growthx.solvers import linear_solvers, single_factor
from growthx.solvers.newton import Newton
from growthx.solvers.single_factor import SingleFactor

DOUBLE = f"Cholesky ({'CHOLMOD' if COMM.size == 1 else 'MUMPS'})"


@pytest.fixture(autouse=True)
def of_any_size(monkeypatch):
    """Small systems, which take the double factor by default, are enough to try it on."""
    monkeypatch.setattr(single_factor, "SMALLEST", 1)


def matrix_of(entries):
    """A sparse matrix of PETSc's."""
    size = len(entries)
    matrix = PETSc.Mat().createAIJ((size, size), nnz=size, comm=PETSc.COMM_SELF)
    for row, column in np.argwhere(entries):
        matrix.setValue(row, column, entries[row, column])
    matrix.assemble()
    return matrix


def definite(size=40, condition=1e3, scale=1.0):
    """A symmetric positive definite matrix."""
    random = np.random.default_rng(1)
    orthogonal = np.linalg.qr(random.normal(size=(size, size)))[0]
    return scale * orthogonal @ np.diag(np.geomspace(1, condition, size)) @ orthogonal.T


def applied(entries):
    """The context, and the error of a solution with it."""
    matrix = matrix_of(entries)
    pc, context = PETSc.PC().create(PETSc.COMM_SELF), SingleFactor(single_factor.load(COMM), 3)
    pc.setType(PETSc.PC.Type.PYTHON)
    pc.setPythonContext(context)
    pc.setOperators(matrix)
    pc.setUp()
    b, x = matrix.createVecs()
    exact = np.random.default_rng(2).normal(size=len(entries))
    b.array_w[:] = entries @ exact
    pc.apply(b, x)
    return context, np.linalg.norm(x.array_r - exact) / np.linalg.norm(exact)


@pytest.mark.parametrize("scale", [1.0, 1e-30, 1e30, 1e60])
def test_it_solves_to_single_precision_in_any_units(scale):
    """Forces in newtons or in anything else: the matrix and the right-hand side are scaled before they are rounded."""
    context, error = applied(definite(scale=scale))
    assert 1e-12 < error < 1e-3
    assert not context.is_poor


def test_rows_of_held_unknowns_and_of_other_sizes():
    """Ones on the diagonal beside stiffnesses of 1e8, as conditions leave them."""
    entries = definite(scale=1e8)
    entries[:5, :], entries[:, :5] = 0, 0
    entries[range(5), range(5)] = 1.0
    context, error = applied(entries)
    assert error < 1e-3 and not context.is_poor


def test_entries_that_fade_leave_the_processor_as_it_was():
    """A mass matrix's entries fade below what single precision says well; zero there, they are numbers elsewhere."""
    random = np.random.default_rng(3)
    faint = np.triu(10.0 ** random.uniform(-44, -18, size=(40, 40)), 1)
    context, error = applied(definite() + faint + faint.T)
    assert error < 1e-3 and not context.is_poor
    least = np.array([np.finfo(float).smallest_subnormal]), np.array([np.finfo(np.float32).smallest_subnormal])
    assert all((each * np.ones(1, each.dtype) > 0).all() for each in least)


def test_a_matrix_that_is_not_definite_has_none():
    """Negative on the diagonal or, worse, only where the elimination comes to it."""
    one, other = np.diag([1.0, -1.0, 2.0]), np.array([[1.0, 2.0], [2.0, 1.0]])
    assert applied(one)[0].is_poor
    assert applied(other)[0].is_poor


def test_a_poor_factor_is_told_and_still_solves(monkeypatch):
    """Conjugate gradients make the first solution a good one; the next factor is double."""
    _, poor = applied(definite(condition=1e5))
    monkeypatch.setattr(single_factor, "POOR", 1e-9)
    context, error = applied(definite(condition=1e5))
    assert context.is_poor
    assert error < 1e-2 * poor


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.Q2, gx.S2fri, gx.P1P0, gx.Q1Q1, gx.P2P1], ids=lambda v: v.name)
@pytest.mark.parametrize("dim", [2, 3])
def test_it_does_not_show_in_the_solution(variant, dim, monkeypatch):
    """Newton's tolerance is that of the balances: about as many iterations, and the same digits."""
    if not variant.density.local:  # their displacements alone are factorised
        monkeypatch.setattr(linear_solvers, "LARGEST_MONOLITHIC", dict.fromkeys(linear_solvers.LARGEST_MONOLITHIC, 0))
    scene = block((square if dim == 2 else cube)(2, 0.04, shape=variant.cells[dim - 2]))
    steps, problem = run(scene, variant)
    assert "single precision" in steps[-1].newton.linear_solver
    monkeypatch.setattr(single_factor, "SMALLEST", 10**9)
    others, other = run(scene, variant)
    assert "single precision" not in others[-1].newton.linear_solver
    assert displacements(problem) == pytest.approx(displacements(other), rel=1e-8, abs=1e-10)
    assert sum(step.newton_iterations for step in steps) <= 1.3 * sum(step.newton_iterations for step in others)


def test_it_gives_way_where_single_precision_is_not_enough(monkeypatch):
    """From the first factor that is poor on factors are double, and the run is what it is with those alone."""
    monkeypatch.setattr(single_factor, "POOR", 0.0)
    steps, problem = run(block(), gx.Q1P0)
    assert steps[-1].newton.linear_solver == DOUBLE
    monkeypatch.setattr(single_factor, "SMALLEST", 10**9)
    _, other = run(block(), gx.Q1P0)
    assert displacements(problem) == pytest.approx(displacements(other), rel=1e-8, abs=1e-10)


def test_without_cholmod_petsc_factorises(monkeypatch):
    """Where no header of SuiteSparse's is, runs are slower and say by what they are solved."""
    monkeypatch.setattr(single_factor, "load", lambda comm: None)
    steps, _ = run(block(), gx.Q1P0)
    assert steps[-1].newton.linear_solver == DOUBLE


def test_full_newton_is_double():
    """Its convergence is to be seen to the last digit."""
    problem = gx.discretise(block(), gx.Q1P0)
    with Newton(problem.system, gx_settings()) as newton:
        assert newton.linear_solver.description == DOUBLE


def gx_settings():
    from growthx.solvers.settings import NewtonSettings

    return NewtonSettings(full=True)


def test_a_factor_that_memory_does_not_hold_is_not_made(monkeypatch):
    """In space a factor grows faster than the body: multigrid takes its place."""
    monkeypatch.setattr(single_factor, "BYTES_IN_SPACE", 1e20)
    monkeypatch.setattr(linear_solvers, "LARGEST_CONDENSED", dict.fromkeys(linear_solvers.LARGEST_CONDENSED, 0))
    steps, _ = run(block(cube(2)), gx.Q1P0)
    assert steps[-1].newton.linear_solver == "conjugate gradients with GAMG"
