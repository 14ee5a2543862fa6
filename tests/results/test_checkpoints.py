"""A run that is resumed from a checkpoint ends as the one that was not interrupted, and what is no checkpoint of it is
refused by name."""

import errno
import os
from dataclasses import replace

import numpy as np
import pytest
from blocks import COMM, block, cube, gathered, square

import growthx as gx
from growthx.common.errors import InputError, OutputError
from growthx.results import checkpoints
from growthx.stepping.time_schemes import SDIRK2

PROGRAM = gx.Program(step=0.1, until=0.9, ramp=0.3)
CASES = (
    gx.LoadCase("walking", 2.0, (gx.Traction("right", (0.1, -0.02)),)),
    gx.LoadCase("sitting", 1.0, (gx.Traction("top", (0.0, 0.05)),)),
)
NODAL_MASS = {"flux": gx.MassFlux(0.1), "prescribed_densities": (gx.PrescribedDensity("top", 1.3),)}
BOUNDS = gx.EnergyDrivenGrowth(attractor=0.01, rate=5.0, bounds=(1.19, 1.2))
ERROR = {"stepping": gx.AdaptiveSteps(1e-5)}

# What a run has besides displacement and density, each of which has a memory of its own.
SCENES = {
    "Q1P0": (gx.Q1P0, {}, {}),
    "Q1": (gx.Q1, {}, {}),
    "Q1sri": (gx.Q1sri, {}, {}),
    "S2fri": (gx.S2fri, {}, {}),
    "Q2Q2": (gx.Q2Q2, {}, {}),
    "S2Q1": (gx.S2Q1, {}, {}),
    "P2P1": (gx.P2P1, {}, {}),
    "P2, steps from error": (gx.P2, {}, ERROR),
    "Q1Q1, steps from error": (gx.Q1Q1, {}, ERROR),
    "Q1, SDIRK2": (gx.Q1, {}, {"stepping": gx.FixedSteps(scheme=SDIRK2)}),
    "Q1, full Newton": (gx.Q1, {}, {"full_newton": True}),
    "Q1P0, load cases": (gx.Q1P0, {"cases": CASES, "loads": ()}, {}),
    "Q1Q1, load cases": (gx.Q1Q1, {"cases": CASES, "loads": ()}, {}),
    "Q1, bounds": (gx.Q1, {"growth": BOUNDS}, {}),
    "Q1Q1, bounds": (gx.Q1Q1, {"growth": BOUNDS}, {}),
    "Q1, inertia": (gx.Q1, {"inertia": gx.Inertia()}, {}),
    "Q1Q1, inertia": (gx.Q1Q1, {"inertia": gx.Inertia()}, {}),
    "Q1Q1, flux": (gx.Q1Q1, NODAL_MASS, {}),
    "Q1, a region at rest": (gx.Q1, {"growing": ("bone",)}, {}),
    "Q1Q1, a region at rest": (gx.Q1Q1, {"growing": ("bone",)}, {}),
    "Q1, a pressure that follows": (gx.Q1, {"loads": (gx.Pressure("right", 0.02),)}, {}),
}


def scene_of(variant, **changes):
    """A bent block, four cells wide, distorted, for nine steps."""
    return block(square(4, 0.05, shape=variant.cells[0]), **{"program": PROGRAM, **changes})


def fields(result):
    """Unknowns and densities of all ranks at the end of a run."""
    problem = result.problem
    densities = problem.density_space.dofmap.index_map.size_local
    return np.concatenate(
        [
            gathered(problem.system.unknown.x.array[: problem.system.owned]),
            gathered(problem.density.x.array[:densities]),
        ]
    )


def history(result):
    """Every number that a run keeps of its steps, as text, in which no digit is lost."""
    return [
        repr(step) + repr({name: force.tolist() for name, force in step.reactions.items()}) for step in result.steps
    ]


@pytest.fixture
def keeping(shared_folder):
    """Runs the scene of one variant with a checkpoint every two steps."""

    def run(variant, changes, options, out, **resume):
        scene = scene_of(variant, **changes)
        return gx.solve(scene, variant, out=shared_folder / out, checkpoint=2, **options, **resume)

    return run


@pytest.mark.parametrize("name", SCENES)
def test_a_resumed_run_ends_to_the_bit_as_one_that_was_not_interrupted(name, keeping, shared_folder):
    """Whatever a part of the code remembers from step to step must be in the file, or be forgotten on both ways."""
    whole = keeping(*SCENES[name], "whole")
    first = sorted((shared_folder / "whole").glob("checkpoint-*.npz"))[0]
    assert 0 < int(first.stem.split("-")[1]) < len(whole.steps)
    resumed = keeping(*SCENES[name], "resumed", resume=first)
    if COMM.size == 1:
        assert np.array_equal(fields(resumed), fields(whole))
        assert history(resumed) == history(whole)
    assert fields(resumed) == pytest.approx(fields(whole), rel=1e-12, abs=1e-14)
    assert len(history(resumed)) == len(history(whole))


def test_the_beginning_is_a_checkpoint_too(keeping, shared_folder):
    """A run that is killed before its first planned checkpoint has one."""
    seen = []

    def watch(result):
        COMM.barrier()
        seen.append(sorted(file.name for file in (shared_folder / "whole").iterdir()))

    whole = keeping(gx.Q1, {}, {"watch": watch}, "whole")
    assert seen[0] == ["checkpoint-000000.npz", "history.csv"]
    assert seen[7] == ["checkpoint-000004.npz", "checkpoint-000006.npz", "history.csv"]
    assert len(whole.steps) == 9


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_keeping_checkpoints_changes_nothing_but_round_off(variant, keeping):
    """They begin the linear solver anew: the solution must not notice."""
    kept = keeping(variant, {}, {}, "whole")
    alone = gx.solve(scene_of(variant), variant)
    assert fields(kept) == pytest.approx(fields(alone), rel=1e-9, abs=1e-11)


def test_another_end_is_not_another_run(shared_folder):
    """To go on for longer is what finished runs are resumed for."""
    scene = scene_of(gx.Q1)
    early = replace(scene, program=replace(PROGRAM, until=0.6))
    gx.solve(early, gx.Q1, out=shared_folder / "early", checkpoint=6)
    later = gx.solve(scene, gx.Q1, out=shared_folder / "later", resume=shared_folder / "early")
    assert later.time == 0.9
    assert fields(later) == pytest.approx(fields(gx.solve(scene, gx.Q1)), rel=1e-9, abs=1e-11)
    assert {"history.csv", "fields.pvd"} <= set(os.listdir(shared_folder / "later"))
    nothing_to_do = gx.solve(early, gx.Q1, resume=shared_folder / "early")
    assert nothing_to_do.converged and len(nothing_to_do.steps) == 6


@pytest.mark.slow
def test_preconditioners_leave_nothing_behind(shared_folder):
    """Multigrid keeps more than a factor from one tangent to the next."""
    scene = block(cube(20), program=PROGRAM)
    whole = gx.solve(scene, gx.Q1P0, out=shared_folder / "whole", checkpoint=4)
    resumed = gx.solve(scene, gx.Q1P0, resume=shared_folder / "whole" / "checkpoint-000004.npz", checkpoint=None)
    assert "GAMG" in whole.linear_solver
    assert fields(resumed) == pytest.approx(fields(whole), rel=1e-9, abs=1e-11)


# -- what is refused ---------------------------------------------------------------------------------------------------


@pytest.fixture
def kept(shared_folder):
    """The folder of a short run that has left two checkpoints."""
    gx.solve(scene_of(gx.Q1), gx.Q1, out=shared_folder / "kept", checkpoint=4)
    return shared_folder / "kept"


OTHERS = {
    "variant": ("variant is Q1, here Q1P0", gx.Q1P0, {}, {}),
    "exponent": (r"scene\.growth\.exponent is 3\.0, here 2\.5", gx.Q1, {"growth": "exponent"}, {}),
    "field": (r"the field 'attractor' is .* somewhere, here", gx.Q1, {"growth": "field"}, {}),
    "load": (
        r"scene\.loads\[0\]\.value\[0\] is 0\.1, here 0\.11",
        gx.Q1,
        {"loads": (gx.Traction("right", (0.11, -0.02)),)},
        {},
    ),
    "support": (r"scene\.supports\[0\]\.on is left, here bottom", gx.Q1, {"supports": (gx.Support("bottom"),)}, {}),
    "step": (r"scene\.program\.step is 0\.1, here 0\.05", gx.Q1, {"program": gx.Program(0.05, 0.9, 0.3)}, {}),
    "stepping": (r"stepping is FixedSteps, here AdaptiveSteps", gx.Q1, {}, ERROR),
    "tolerance": ("tolerance is 1e-10, here 1e-08", gx.Q1, {}, {"tolerance": 1e-8}),
    "inertia": (r"scene\.inertia is None, here Inertia: ", gx.Q1, {"inertia": gx.Inertia()}, {}),
}
GROWTH = {
    "exponent": gx.EnergyDrivenGrowth(attractor=0.01, rate=5.0, exponent=2.5),
    "field": gx.EnergyDrivenGrowth(attractor=lambda x: 0.01 + 0.001 * x[0], rate=5.0),
}


@pytest.mark.parametrize("other", OTHERS)
def test_a_checkpoint_of_another_run_is_refused(other, kept):
    """Its numbers would go on under another law, load or time step, and look like a result."""
    sentence, variant, changes, options = OTHERS[other]
    growth = {"growth": GROWTH[changes["growth"]]} if "growth" in changes else {}
    if other == "field":  # the same law, and a field there too: values differ, not kinds
        first = {"growth": gx.EnergyDrivenGrowth(attractor=lambda x: 0.01 + 0.0 * x[0], rate=5.0)}
        kept = kept.with_name("field")
        gx.solve(scene_of(gx.Q1, **first), gx.Q1, out=kept, checkpoint=4)
    with pytest.raises(InputError, match=rf"^the checkpoint .*000008\.npz is of another run, where {sentence}"):
        gx.solve(scene_of(variant, **{**changes, **growth}), variant, resume=kept, **options)


def test_another_mesh_is_refused(kept):
    """Also one with as many cells."""
    for mesh in (square(5, 0.05), square(4, 0.04)):
        with pytest.raises(InputError, match="is of another run, where "):
            gx.solve(block(mesh, program=PROGRAM), gx.Q1, resume=kept)


def truncated(content):
    return content[: len(content) // 2]


def with_a_bit_turned(content):
    place = len(content) // 3
    return content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :]


def empty(content):
    return b""


def text(content):
    return b"time,density\n0,1\n"


@pytest.mark.parametrize("damage", [truncated, with_a_bit_turned, empty, text])
def test_a_damaged_checkpoint_is_refused_by_name_and_the_one_before_is_used_when_asked(damage, kept):
    """To take the one before without a word would hide the damage."""
    last, before = kept / "checkpoint-000008.npz", kept / "checkpoint-000004.npz"
    if COMM.rank == 0:
        last.write_bytes(damage(last.read_bytes()))
    COMM.barrier()
    with pytest.raises(InputError, match=f"^{last} is damaged .*: to resume {before} would be right$"):
        gx.solve(scene_of(gx.Q1), gx.Q1, resume=kept)
    assert gx.solve(scene_of(gx.Q1), gx.Q1, resume=before).time == 0.9


def rewritten(file, **changes):
    """Write a file again with other members, on rank 0."""
    if COMM.rank == 0:
        with np.load(file) as members:
            arrays = dict(members)
        np.savez(file, **{**arrays, **changes})
    COMM.barrier()


def test_values_that_the_checksum_does_not_know_are_refused(kept):
    """Whoever writes a density into the file has made another state of it."""
    last = kept / "checkpoint-000008.npz"
    with np.load(last) as members:
        density = members["state/densities/density"]
    COMM.barrier()
    rewritten(last, **{"state/densities/density": 1.01 * density})
    with pytest.raises(InputError, match=r"is damaged .its checksum is wrong.: to resume .*000004"):
        gx.solve(scene_of(gx.Q1), gx.Q1, resume=kept)


def test_another_format_and_foreign_files_are_refused(kept):
    """A later growthx may write what this one cannot read, and NumPy's files are of many programs."""
    header = np.frombuffer(b'{"format": 99}', dtype=np.uint8)
    last = kept / "checkpoint-000008.npz"
    rewritten(last, header=header)
    with pytest.raises(InputError, match=r"has format 99: this version of growthx reads format 2$"):
        gx.solve(scene_of(gx.Q1), gx.Q1, resume=last)
    foreign = kept.parent / "foreign.npz"
    if COMM.rank == 0:
        np.savez(foreign, a=np.ones(3))
    COMM.barrier()
    with pytest.raises(InputError, match=r"foreign.npz is damaged or no checkpoint"):
        gx.solve(scene_of(gx.Q1), gx.Q1, resume=foreign)


def test_there_must_be_one(shared_folder):
    """A folder without any, or no folder at all, must not begin a run from the start without a word."""
    for place in (shared_folder, shared_folder / "nowhere"):
        with pytest.raises(InputError, match=f"^there is no checkpoint in {place}: "):
            gx.solve(scene_of(gx.Q1), gx.Q1, resume=place)


@pytest.mark.parametrize("every", [0, -1, 2.5, True, "3"])
def test_a_plan_that_cannot_be_meant_is_refused(every, shared_folder):
    """Before anything is computed."""
    with pytest.raises(InputError, match=r"every .* steps: a whole number from 1 would be right"):
        gx.solve(scene_of(gx.Q1), gx.Q1, out=shared_folder / "out", checkpoint=every)
    with pytest.raises(InputError, match="every 3 steps, but nowhere"):
        gx.solve(scene_of(gx.Q1), gx.Q1, checkpoint=3)


def test_results_are_not_overwritten_by_a_resumed_run(kept):
    """A folder with results beside the checkpoints stays as it is."""
    before = {file.name: file.read_bytes() for file in kept.iterdir()}
    COMM.barrier()
    with pytest.raises(InputError, match=f"^the run in {kept} has ended, and its results stay as they are: "):
        gx.solve(scene_of(gx.Q1), gx.Q1, out=kept, checkpoint=4, resume=kept)
    assert {file.name: file.read_bytes() for file in kept.iterdir()} == before


def test_planned_checkpoints_go_before_those_of_interruptions(tmp_path):
    """Only from a planned one is a run repeated to the bit; an interruption's is used where there is no other."""
    names = ["interrupted-000009.npz", "checkpoint-000004.npz", "checkpoint-000008.npz", ".checkpoint-000012.npz.part"]
    for name, found in zip(names, ["interrupted-000009", "checkpoint-000004", *2 * ["checkpoint-000008"]], strict=True):
        (tmp_path / name).touch()
        assert checkpoints.find(tmp_path, COMM).stem == found if COMM.size == 1 else True


# -- disks that are full -----------------------------------------------------------------------------------------------


def full_disk(*arguments, **members):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_full_disk_at_the_start_is_said_at_once(shared_folder, monkeypatch):
    """Before hours are spent on what cannot be kept."""
    monkeypatch.setattr(np, "savez", full_disk)
    with pytest.raises(OutputError, match=r"000000\.npz cannot be written \(No space left on device\)"):
        gx.solve(scene_of(gx.Q1), gx.Q1, out=shared_folder / "out", checkpoint=3)
    assert not os.listdir(shared_folder / "out")


def test_a_full_disk_on_the_way_leaves_the_last_checkpoint_and_the_run_goes_on(shared_folder, monkeypatch, caplog):
    """The run may still reach its end, and what it had is not lost."""

    def watch(result):
        if len(result.steps) == 4:
            monkeypatch.setattr(np, "savez", full_disk)

    result = gx.solve(scene_of(gx.Q1), gx.Q1, out=shared_folder / "out", checkpoint=3, watch=watch)
    COMM.barrier()
    assert result.converged
    found = {name for name in os.listdir(shared_folder / "out") if "npz" in name}
    assert found == {"checkpoint-000000.npz", "checkpoint-000003.npz"}
    assert sum("000006.npz cannot be written" in text for text in caplog.messages) == (COMM.rank == 0)
