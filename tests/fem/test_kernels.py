"""Kernels are compiled for this CPU, once, and kept so that no other CPU, no crash and no second run can spoil them."""

import errno
import sysconfig

import dolfinx
import numpy as np
import pytest
import ufl
from mpi4py import MPI

import growthx as gx
from growthx.common.errors import InputError
from growthx.constitutive.kinematics import displacement_gradient, volume_change
from growthx.fem import kernels
from growthx.fem.assembly import assemble
from growthx.solvers.tangent import assemble_tangent

COMM = MPI.COMM_WORLD


@pytest.fixture
def caches(monkeypatch, shared_folder):
    """An empty cache folder, that of all ranks."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(shared_folder))
    return shared_folder


@pytest.fixture
def square():
    """A mesh of some cells."""
    return dolfinx.mesh.create_unit_square(COMM, 3, 3)


def area(square, factor=1.0):
    """A mesh's area times a factor, by a compiled form whose source has the factor."""
    compiled = kernels.form(factor * ufl.dx(domain=square))
    return COMM.allreduce(dolfinx.fem.assemble_scalar(compiled))


def homes(caches):
    """The folders of the kinds of CPUs and compilers."""
    COMM.barrier()
    found = sorted((caches / "growthx" / "kernels").glob("*"))
    COMM.barrier()
    return found


def kept(home):
    """Names of what is kept in one of them."""
    return sorted(path.name for path in home.iterdir())


def refuse(*arguments, **options):
    """Stand in for a compiler that must not be needed."""
    raise AssertionError("compiled again")


def test_a_kernel_is_compiled_once(caches, square, monkeypatch):
    """Later runs, and the other ranks, take what is there: also from a cache that they may not write to."""
    assert area(square) == pytest.approx(1)
    (home,) = homes(caches)
    found = kept(home)
    assert all(len(list(folder.glob("*.so"))) == 1 for folder in home.glob("form_*"))
    monkeypatch.setattr(kernels, "_compile", refuse)
    assert area(square) == pytest.approx(1)
    assert kept(home) == found


def test_another_cpu_takes_none_of_this_ones_kernels(caches, square, monkeypatch):
    """Machines may share a cache folder: code for another CPU would end a run by an illegal instruction."""
    area(square)
    monkeypatch.setattr(kernels, "_cpu", lambda: "another one")
    with monkeypatch.context() as patch, pytest.raises(RuntimeError, match="compiled again"):
        patch.setattr(kernels, "_compile", refuse)
        area(square)
    assert area(square) == pytest.approx(1)
    first, second = homes(caches)
    assert kept(first) == kept(second)


def test_another_compiler_makes_its_own(caches, square, monkeypatch):
    """What one compiler made says nothing of the flags that another takes."""
    area(square)
    compiler = write_compiler(caches / "cc", 'exec {cc} "$@"')
    monkeypatch.setenv("CC", str(compiler))
    assert area(square) == pytest.approx(1)
    assert len(homes(caches)) == 2


def write_compiler(path, script):
    """A compiler as a shell script."""
    if COMM.rank == 0:
        path.write_text("#!/bin/sh\n" + script.format(cc=sysconfig.get_config_var("CC")) + "\n")
        path.chmod(0o755)
    COMM.barrier()
    return path


def test_a_compiler_without_the_fast_flags_does(caches, square, monkeypatch):
    """Compilers do not agree on flags: one that refuses ours still compiles the forms."""
    compiler = write_compiler(caches / "cc", 'case "$*" in *march=native*) exit 1 ;; esac\nexec {cc} "$@"')
    monkeypatch.setenv("CC", str(compiler))
    assert area(square) == pytest.approx(1)


@pytest.mark.parametrize(("script", "told"), [(None, "no C compiler"), ("exit 1", "could not compile")])
def test_a_compiler_that_fails_is_told(caches, square, monkeypatch, script, told):
    """The user, who has set CC or has none, reads a sentence and not a traceback, on all ranks."""
    compiler = caches / "cc" if script is None else write_compiler(caches / "cc", script)
    monkeypatch.setenv("CC", str(compiler))
    with pytest.raises(InputError, match=told):
        area(square)


def test_an_unusable_cache_folder_is_told(caches, square, monkeypatch):
    """A cache that cannot be made, or is full, is no traceback either: a sentence names the folder and the way out."""
    (caches / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(caches / "file"))
    with pytest.raises(InputError, match=r"file.*Not a directory.*XDG_CACHE_HOME"):
        area(square)

    def full(*arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setenv("XDG_CACHE_HOME", str(caches))
    monkeypatch.setattr(kernels, "_compile", full)
    with pytest.raises(InputError, match=r"No space left on device.*XDG_CACHE_HOME"):
        area(square)


def test_a_run_that_dies_while_it_compiles_leaves_nothing_in_the_way(caches, square, monkeypatch):
    """FFCx alone would find its begun source there, wait for somebody to finish it, and give up."""

    def die(source, options, where):
        (where["cache_dir"] / "libffcx_begun.c").touch()
        raise MemoryError

    with monkeypatch.context() as patch, pytest.raises(RuntimeError):
        patch.setattr(kernels, "_compile", die)
        area(square)
    (home,) = homes(caches)
    assert kept(home) == ["flags"]
    assert area(square) == pytest.approx(1)


def test_two_that_make_the_same_kernel_at_once(tmp_path):
    """The second to finish takes what the first has put in its place."""

    def build(folder):
        if not (tmp_path / "kernel").exists():
            kernels._make(tmp_path, "kernel", lambda other: (other / "by").write_text("the faster"))
        (folder / "by").write_text("the slower")

    assert (kernels._make(tmp_path, "kernel", build) / "by").read_text() == "the faster"
    assert kept(tmp_path) == ["kernel"]


# -- what they compute -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1sri, gx.Q1Q1, gx.S2fri], ids=lambda variant: variant.name)
def test_fast_flags_change_the_last_digits_only(variant, monkeypatch):
    """Sums in another order, divisions as products and logarithms of vectors are the same to round-off."""
    fast = forces_and_tangent(variant)
    monkeypatch.setattr(kernels, "FAST", kernels.PLAIN)
    plain = forces_and_tangent(variant)
    for ours, theirs in zip(fast, plain, strict=True):
        assert np.abs(ours - theirs).max(initial=0) <= 1e-12 * COMM.allreduce(np.abs(theirs).max(initial=0), MPI.MAX)


def forces_and_tangent(variant):
    """Out-of-balance forces, and entries of the tangent, of a deformed plate."""
    from dolfinx.fem import petsc

    problem = gx.discretise(gx.scenes.plate(4), variant)
    problem.system.begin_step(0.1, 1.0)
    unknown = problem.system.unknown.x.array
    unknown += 1e-3 * np.sin(np.arange(len(unknown)))
    forces = problem.system.out_of_balance()
    matrix = petsc.create_matrix(problem.system.coupling)
    assemble_tangent(problem.system, matrix)
    entries = matrix.getValuesCSR()[2].copy()
    matrix.destroy()
    return forces, entries


@pytest.mark.parametrize("variant", [gx.Q1, gx.P2], ids=lambda variant: variant.name)
def test_what_is_inverted_is_not_a_number(variant):
    """NaN is how det F ≤ 0 shows: no flag, and no logarithm of four points at once, may give a number instead."""
    scene = gx.scenes.plate(4, shape="quadrilateral" if variant is gx.Q1 else "triangle")
    problem = gx.discretise(scene, variant)
    random = np.random.default_rng(COMM.rank)
    problem.system.unknown.x.array[:] = 0.1 * random.standard_normal(len(problem.system.unknown.x.array))
    problem.system.unknown.x.scatter_forward()
    points = variant.integration_points(scene.mesh.cell_name)
    J = 1 + problem.evaluate(volume_change(displacement_gradient(problem.displacement)), points)
    space = problem.density_space
    energy = assemble(
        kernels.form(problem.expressions.energy() * ufl.TestFunction(space) * problem.spaces.whole_volume)
    )
    wrong = np.isnan(energy[space.dofmap.list[: len(J)]])
    assert 0 < COMM.allreduce(int(np.sum(J < 0))) < COMM.allreduce(J.size)
    assert np.all(wrong[J <= 0])
    assert np.array_equal(wrong.any(axis=1), np.any(J <= 0, axis=1))  # the others in the cell may catch it: 0 · NaN
