"""No exception hangs the program: nothing of ours talks in lower case on a communicator that is freed with a mesh."""

import ast
import subprocess
import sys
import textwrap
from dataclasses import replace
from pathlib import Path

import dolfinx
import numpy as np
import pytest
from blocks import COMM, block, cube, square
from mpi4py import MPI

import growthx as gx
from growthx import plots
from growthx.common.communicators import require_same_on_all, steady
from growthx.discretisation.variants import CATALOGUE
from growthx.solvers import abandoned
from growthx.solvers.newton import Newton

PACKAGE = Path(gx.__file__).parent
PROGRAMS = [file for folder in ("demos", "benchmarks") for file in (PACKAGE.parent / folder).rglob("*.py")]
LIMIT = 240  # seconds, most of which compile forms where the cache is empty

# Each function leaves something that refers to a mesh in a frame that an exception unwinds.
PROGRAM = """
import sys, tempfile
from dataclasses import replace
from pathlib import Path
import growthx as gx

SQUARE = dict(left=lambda x: x[0] < 1e-9)

def scenes():
    for scene in (gx.scenes.plate(2), gx.scenes.plate(2)):
        raise ValueError(scene.name)

def a_femur():
    scene = gx.scenes.femur()
    raise ValueError(scene.name)

def constructor():
    scene = gx.scenes.plate(2)
    replace(scene, supports=(gx.Support("nowhere"),))

def problems():
    for variant in (gx.Q1, gx.Q1P0, gx.Q1Q1):
        problem = gx.discretise(gx.scenes.plate(2), variant)
        problem.mass(), problem.density_range(), problem.sample_density([[0.5, 0.5]])
        raise ValueError(problem.dofs)

def ended_early():
    for load in (-5.0, -6.0):
        scene = gx.scenes.plate(2)
        loads = (gx.Traction("right", (load, 0.0)),)
        program = gx.Program(step=1.0, until=1.0)
        growth = gx.EnergyDrivenGrowth(attractor=1e3, rate=1e3, exponent=0.0)
        result = gx.solve(replace(scene, loads=loads, program=program, growth=growth), gx.Q1)

def watched():
    def watch(result):
        raise KeyboardInterrupt
    gx.solve(gx.scenes.plate(2), gx.Q1Q1, watch=watch)

def results():
    folder = Path(FOLDER)
    scene = replace(gx.scenes.plate(2), program=gx.Program(step=0.5, until=1.0, ramp=0.5))
    result = gx.solve(scene, gx.Q1, out=folder / "one", checkpoint=1)
    again = gx.solve(scene, gx.Q1, out=folder / "two", resume=folder / "one")
    gx.wellposedness.check(result.problem)
    raise ValueError(result.time)

def in_a_generator():
    for step in gx.march(gx.scenes.plate(2), gx.Q1P0):
        raise ValueError(step.time)

def main():
    for function in (scenes, a_femur, constructor, problems, ended_early, watched, results, in_a_generator):
        try:
            function()
            print(f"no exception in {function.__name__}\\n", end="", flush=True)
        except (ValueError, gx.GrowthxError, KeyboardInterrupt):
            print(f"survived {function.__name__}\\n", end="", flush=True)
"""
NAMES = ["scenes", "a_femur", "constructor", "problems", "ended_early", "watched", "results", "in_a_generator"]


def run(program, folder, *launcher):
    """The program's output and exit status; it fails the test when it hangs."""
    file = folder / "program.py"
    file.write_text(f"FOLDER = {str(folder)!r}\n" + PROGRAM + textwrap.dedent(program))
    command = [*launcher, sys.executable, str(file)]
    found = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT, check=False)
    return found.stdout, found.returncode


@pytest.mark.serial
@pytest.mark.parametrize("ranks", [1, 2])
def test_what_is_caught_does_not_hang(ranks, tmp_path):
    """One rank, or each of two, goes on after exceptions in frames that hold scenes, problems, results, generators."""
    launcher = () if ranks == 1 else ("mpirun", "-n", "2")
    out, status = run("main()", tmp_path, *launcher)
    for name in NAMES:
        assert out.count(f"survived {name}\n") == ranks, out
    assert status == 0


@pytest.mark.serial
@pytest.mark.parametrize("name", ["scenes", "problems"])
def test_what_is_not_caught_ends_the_program(name, tmp_path):
    """A traceback and status 1, not a job that burns its allocation."""
    assert run(f"{name}()", tmp_path) == ("", 1)


# What one rank alone raises, and where it leaves the others.
ALONE = """
import sys
from dataclasses import replace
from mpi4py import MPI
import growthx as gx

ALONE = MPI.COMM_WORLD.rank == RANK

def fail(*_):
    if ALONE:
        raise ValueError("alone")
    return 1.0

def watched():
    gx.solve(gx.scenes.plate(2), gx.Q1, watch=fail)

def in_a_loop():
    for step in gx.march(gx.scenes.plate(2), gx.Q1):
        fail()

def in_a_loop_over_updates():
    for step in gx.baselines.update(gx.scenes.plate(2), gx.Q1):
        fail()

def after_a_solver_was_left():
    next(gx.march(gx.scenes.plate(2), gx.Q1))
    fail()
    gx.solve(gx.scenes.plate(2), gx.Q1)

def inside_a_step():
    scene = gx.scenes.plate(2)
    loads = (replace(scene.loads[0], history=lambda time: fail() if time > 0.3 else 1.0),)
    gx.solve(replace(scene, loads=loads), gx.Q1Q1)
"""


@pytest.mark.serial
@pytest.mark.parametrize("rank", [0, 1])
@pytest.mark.parametrize(
    "name", ["watched", "in_a_loop", "in_a_loop_over_updates", "after_a_solver_was_left", "inside_a_step"]
)
def test_what_one_rank_raises_alone_ends_all(name, rank, tmp_path):
    """It frees no solver on its way out, for which it would wait for the others, and they for its next word."""
    file = tmp_path / "program.py"
    file.write_text(f"RANK = {rank}\n{ALONE}\nraise SystemExit(gx.guarded({name}))")
    command = ["mpirun", "-n", "2", sys.executable, str(file)]
    found = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT, check=False)
    assert found.returncode == 1 and "ValueError: alone" in found.stderr, found.stderr


def test_what_watches_a_run_fails_on_all_ranks():
    """Those where it did not fail say where it did, and at what time; without a solver that is still to be freed."""

    def watch(result):
        if COMM.rank == COMM.size - 1:
            raise ValueError("mine")

    wanted = ValueError if COMM.rank == COMM.size - 1 else gx.GrowthxError
    with pytest.raises(wanted, match="mine") as caught:
        gx.solve(block(square(2)), gx.Q1, watch=watch)
    assert wanted is ValueError or f"at t = 0.1 on rank {COMM.size - 1}" in str(caught.value)


@pytest.fixture
def freed(monkeypatch):
    """Numbers of the solvers that were freed."""
    numbers, destroy = [], Newton.destroy
    monkeypatch.setattr(Newton, "destroy", lambda self: (numbers.append(self.number), destroy(self)))
    return numbers


def test_a_solver_that_is_left_is_freed_when_all_ranks_have_left_it(freed):
    """On one rank that is at once; on several never by some of them alone, and not for ever kept either."""
    scene = block(square(2))
    problem = gx.discretise(scene, gx.Q1)
    march = gx.march(scene, gx.Q1, problem)
    next(march)
    freed.clear()
    if COMM.rank == 0:
        march.leave()
    abandoned.free(problem.comm)
    assert len(freed) == (COMM.size == 1)
    march.leave()
    abandoned.free(problem.comm)
    assert len(freed) == 1 and not abandoned._left
    with pytest.raises(StopIteration):
        next(march)
    with pytest.raises(ValueError, match="out"):
        for _ in gx.march(scene, gx.Q1, problem):
            raise ValueError("out")
    gx.march(scene, gx.Q1, problem).close()
    assert len(freed) == 3 and len(set(freed)) == 3 and not abandoned._left


@pytest.fixture
def meshes(monkeypatch):
    """All meshes of DOLFINx that are made, growthx's own and the user's."""
    made, make = [], dolfinx.mesh.Mesh.__init__

    def keep(self, *arguments, **options):
        make(self, *arguments, **options)
        made.append(self)

    monkeypatch.setattr(dolfinx.mesh.Mesh, "__init__", keep)
    return made


# mpi4py keeps its locks in a table for each communicator, which this shows.
locks = getattr(MPI, "_comm_lock_table", None)
needs_locks = pytest.mark.skipif(locks is None, reason="this mpi4py has no locks on communicators")


@needs_locks
def test_no_lock_is_left_on_a_mesh(meshes, shared_folder):
    """A whole run that leaves all it can, and what is asked of its end: what hangs is a lock, and there is none."""
    scene = block(square(2), initial_density=lambda x: 1.0 + 0.1 * x[0], growing=("bone",))
    result = gx.solve(scene, gx.Q1, out=shared_folder / "one", every=2, checkpoint=2, watch=lambda result: None)
    gx.solve(scene, gx.Q1, out=shared_folder / "two", vtkhdf=True, resume=shared_folder / "one")
    gx.wellposedness.check(result.problem)
    result.problem.sample_density([[0.5, 0.5]])
    gx.zones.area_means(result.problem, {"all": [(0, 0), (1, 0), (1, 1), (0, 1)]})
    plots.density(result.problem, shared_folder / "density.png")
    with pytest.raises(gx.InputError):
        replace(scene, supports=(gx.Support("nowhere"),))
    assert meshes  # that of the scene, for one
    assert [locks(mesh.comm) for mesh in meshes] == [{}] * len(meshes)


@needs_locks
@pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
def test_no_lock_is_left_by_a_variant(variant, meshes):
    """Nor by a form of the user's; a call in lower case would leave one."""
    mesh = square(2, shape=variant.cells[0])
    march = gx.march(block(mesh), variant)
    next(march)
    march.close()
    dolfinx.fem.form(1.0 * mesh.volume_measure(None, 1))
    assert [locks(mesh.comm) for mesh in meshes] == [{}]
    mesh.domain.comm.allreduce(1)
    assert locks(mesh.domain.comm)


@needs_locks
def test_no_lock_is_left_in_space(meshes):
    """Nor by what is solved without a march, or by what replaces it."""
    scene = block(cube(1))
    gx.homeostasis(replace(scene, growth=replace(scene.growth, attractor=1e-3)), gx.Q1)
    next(gx.baselines.update(scene, gx.Q1))
    assert [locks(mesh.comm) for mesh in meshes] == [{}]


def owners_of_communicators(file):
    """Text of what a module reads a `comm` of without making it steady at once, with the line."""
    tree = ast.parse(file.read_text())
    safe = {
        id(argument)
        for call in ast.walk(tree)
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "steady"
        for argument in call.args
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr == "comm" and id(node) not in safe:
            yield ast.unparse(node.value), node.lineno


LOWER = {"allgather", "allreduce", "alltoall", "bcast", "exscan", "gather", "scan", "scatter", "send", "recv"}
OURS = (
    "self",
    "mesh",
    "spaces",
    "_spaces",
    "problem",
    "_problem",
    "discretisation",
    "first",
    "at",
)  # what has a steady `comm`
PETSCS = ("snes", "pc")  # asked for their size, or made steady


@pytest.mark.parametrize(
    "file", sorted([*PACKAGE.rglob("*.py"), *PROGRAMS]), ids=lambda file: f"{file.parent.name}/{file.stem}"
)
def test_communicators_of_dolfinx_are_not_talked_on(file):
    """A `comm` of a domain or a function space is passed to `steady` where it is read; all others are steady."""
    for owner, line in owners_of_communicators(file):
        last = owner.rpartition(".")[2]
        dolfinxs = owner.endswith(("space.mesh", "function_space.mesh", "V.mesh")) or last in ("domain", "ufl_cargo()")
        known = file in PROGRAMS or last in (*OURS, *PETSCS)
        assert known and not dolfinxs, f"{file.name}:{line}: {owner}.comm"
    text = file.read_text()
    steadied = sum(text.count(f"steady({name}.comm.tompi4py())") for name in PETSCS)
    assert text.count("tompi4py()") == text.count("comm.tompi4py())") == steadied


@pytest.mark.parametrize(
    "file", sorted([*PACKAGE.rglob("*.py"), *PROGRAMS]), ids=lambda file: f"{file.parent.name}/{file.stem}"
)
def test_nothing_is_said_in_lower_case_to_what_is_no_steady_communicator(file):
    """Each call has the name of a communicator before it, and those are looked at above."""
    names = ("comm", "_comm", "COMM", "MPI.COMM_WORLD")
    for call in ast.walk(ast.parse(file.read_text())):
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and call.func.attr in LOWER:
            owner = call.func.value
            known = isinstance(owner, ast.Call) and ast.unparse(owner.func) in ("steady", "self._numbering")
            assert known or ast.unparse(owner).endswith(names), f"{file.name}:{call.lineno}: {ast.unparse(call)}"


def test_a_steady_communicator_has_the_same_ranks():
    """It is MPI's own where there is one, and the same each time."""
    assert steady(MPI.COMM_WORLD.Dup()) in (MPI.COMM_WORLD, MPI.COMM_SELF)
    assert MPI.Comm.Compare(steady(MPI.COMM_SELF.Dup()), MPI.COMM_SELF) in (MPI.IDENT, MPI.CONGRUENT)
    backwards = MPI.COMM_WORLD.Split(0, -MPI.COMM_WORLD.rank)
    known = steady(backwards)
    assert known.rank == backwards.rank and steady(backwards) is known
    mine = MPI.COMM_WORLD.Split(COMM.rank, 0)
    mesh = gx.scenes.plate(1, comm=mine).mesh
    mine.Free()
    assert mesh.comm.size == 1 and mesh.comm.allreduce(3) == 3


@pytest.mark.parametrize(
    "wrong", [None, 2, MPI.COMM_NULL, COMM.Split(MPI.UNDEFINED)], ids=["none", "number", "null", "left"]
)
@pytest.mark.parametrize("make", [gx.scenes.plate, gx.scenes.bar, gx.scenes.femur])
def test_what_is_no_communicator_is_refused(make, wrong):
    """Such as that of a rank which its owner has left out."""
    with pytest.raises(gx.InputError, match=r"the communicator is (None|2|MPI\.COMM_NULL): one that this rank is in"):
        make(comm=wrong)


def on_rank_one(usual, other):
    """What a script that goes by what its own rank has of the mesh may come to."""
    return other if COMM.rank == 1 else usual


def different(scene):
    """Scenes, or runs, of which one rank is told something else, and what is said of it."""
    left, right, pulled = gx.Support("left"), gx.Support("right"), gx.Traction("right", (0.0, -0.02))
    there, more = (left,), (left, gx.PointSupport((1.0, 1.0)))
    yield "more supports", lambda: replace(scene, supports=on_rank_one(there, more)), r"len\(supports\) .*is 1 .* and 2"
    yield "another side", lambda: replace(scene, supports=(on_rank_one(left, right),)), "supports.0..on .*is 'left' on"
    kinds = on_rank_one(pulled, gx.Pressure("right", 0.02))
    yield "another load", lambda: replace(scene, loads=(kinds,)), r"type\(loads.0.\) .*'Traction' .*'Pressure'"
    force = gx.Traction("right", (0.0, on_rank_one(-0.02, -0.03)))
    yield "more of a load", lambda: replace(scene, loads=(force,)), "loads.0..*1. .*is -0.02 on rank 0 and -0.03"
    growing = on_rank_one(None, ("bone",))
    yield "another region", lambda: replace(scene, growing=growing), "growing of the scene 'plate' is 'None' on rank 0"
    young = {"bone": 1.0, on_rank_one("rest", "others"): 2.0}
    stiff = replace(scene.material, young=young)
    yield "other names", lambda: replace(scene, material=stiff), r"material.young\) .*'bone, rest' .* 'bone, others'"
    yield "a variant", lambda: gx.discretise(scene, on_rank_one(gx.Q1, gx.Q1P0)), "variant.name is 'Q1' .* 'Q1P0'"
    yield "a name", lambda: gx.discretise(scene, on_rank_one(gx.Q1, "Q1")), "type.variant. is 'Variant' on rank 0"
    yield "no supports", lambda: replace(scene, supports=on_rank_one(there, None)), r"len\(supports\) .*and 'None' on"
    yield "a tolerance", lambda: gx.march(scene, gx.Q1, tolerance=on_rank_one(1e-10, 1e-8)), "tolerance is 1e-10 on"
    row = on_rank_one(1.0, (1.0,))
    yield "a row", lambda: require_same_on_all(COMM, {"number": row}), "number is 1.0 on rank 0 and 1 on rank 1"
    times = np.array([1.0, on_rank_one(2.0, 2.5)])
    yield "times", lambda: gx.solve(scene, gx.Q1, out="a", times=times), r"times.1. is 2.0 on rank 0 and 2.5"
    nowhere = {"out": on_rank_one("a", None), "every": 2}
    yield "nowhere", lambda: gx.solve(scene, gx.Q1, **nowhere), "out is 'a' on rank 0 and 'None' on"
    yield "a folder", lambda: gx.solve(scene, gx.Q1, out=on_rank_one("a", None)), "out is 'a' on rank 0 and 'None' on"


CASES = [name for name, _, _ in different(gx.scenes.plate(2))]


@pytest.mark.skipif(COMM.size == 1, reason="one rank agrees with itself")
@pytest.mark.parametrize("case", CASES)
def test_what_ranks_are_told_differently_is_refused(case):
    """They would wait for each other, or solve something that nobody meant."""
    run, told = next((run, told) for name, run, told in different(gx.scenes.plate(2)) if name == case)
    with pytest.raises(gx.InputError, match=f"({told}).*: the same on all ranks would be right"):
        run()


def test_what_is_a_rank_s_own_may_differ():
    """Functions, arrays of its cells, and numbers by round-off."""
    scene = gx.scenes.plate(2)
    cells = len(scene.mesh.owned_cells)
    told = {
        "function": on_rank_one(np.sin, np.cos),
        "array": np.full(cells, COMM.rank),
        "number": 0.1 + 1e-15 * COMM.rank,
        "no number": float("nan"),
        "large": 10**400,
        "class": gx.Support,
        "mesh": scene.mesh,
    }
    require_same_on_all(COMM, told)
    require_same_on_all(MPI.COMM_SELF, {"anything": COMM.rank})
