"""The command line given anything: a scene that could be run, or one sentence and status 2; on many ranks, on all."""

import contextlib
import io
import signal
import subprocess
import sys

import pytest
from blocks import COMM, fuzz
from hypothesis import given
from hypothesis import strategies as st

import growthx.run
from growthx import meshing
from growthx.cli import program
from growthx.common.errors import EndedEarly, OutputError

# Sizes are small or impossible: those in between would only take their time.
COUNTS = ["10", "20", "0", "-3", "1e3", "x", "", "9" * 30, "9" * 5000, "nan", "2.5", "١٠", "0x10", " 10 ", "1_0"]
NUMBERS = ["0", "-1", "1", "0.5", "nan", "inf", "-inf", "1e400", "1e-400", "1e300", "-0.0", "1e-9", "", "x", "1,5", "٣"]
WORDS = [
    *(
        "",
        " ",
        "-",
        "--",
        "%s",
        "{0}",
        "line\nbreak",
        "nul\0l",
        "\udcff",
        "Ψ₀",
        "x" * 2000,
        "--no-such",
        "-h",
        "--help",
        "--out",
        "--relative",
    ),
    *("Q1", "q1p0", "Q7", "P1", "triangle", "quadrilateral", "hexahedron", "average", "superposed", "stimulus", "all"),
    *("discontinuous", "continuous", "tr-bdf2", "implicit-euler", "euler", "missing.msh", "/", "/dev/null", "bar.geo"),
]
OPTIONS = {
    **dict.fromkeys(("--elements", "--refine", "--checkpoint", "--every", "--frames"), st.sampled_from(COUNTS)),
    **dict.fromkeys(
        ("--step", "--until", "--n", "--m", "--thickness", "--adaptive", "--equilibrium"), st.sampled_from(NUMBERS)
    ),
    "--size": st.sampled_from(["8", "9", "1e9", *(number for number in NUMBERS if number not in ("1", "0.5"))]),
    **dict.fromkeys(
        (
            "--kind",
            "--shape",
            "--combination",
            "--mesh",
            "--zones",
            "--variant",
            "--scheme",
            "--picture",
            "--movie",
            "--ct",
            "--hu",
            "--ct-by",
        ),
        st.sampled_from(WORDS),
    ),
    "--times": st.sampled_from(NUMBERS),
}
PAIRS = st.sampled_from(sorted(OPTIONS)).flatmap(lambda name: st.tuples(st.just(name), OPTIONS[name]))
ARGUMENTS = st.tuples(
    st.sampled_from([("bar", "--elements", "10"), ("femur", "--size", "9"), ("plate", "--elements", "2"), ()]),
    st.lists(st.one_of(PAIRS, st.tuples(st.sampled_from(WORDS)), st.tuples(st.text(max_size=4))), max_size=3),
).map(lambda parts: [*parts[0], *(word for words in parts[1] for word in words)])


def cut_off(scene, variant, **options):
    """In place of the run: the scene has been built."""
    variant.check(scene.mesh.cell_name)
    raise EndedEarly("cut off")


def run(arguments):
    """Status, stdout and stderr of the command in this process."""
    out, err, before = io.StringIO(), io.StringIO(), signal.getsignal(signal.SIGTERM)
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = program.main(arguments)
        except SystemExit as ended:  # --help and --version
            status = ended.code or 0
        finally:
            signal.signal(signal.SIGTERM, before)
    return status, out.getvalue(), err.getvalue()


def test_anything_as_arguments(monkeypatch):
    """No traceback, no warning, no other status, and the same on all ranks, which would else wait for each other."""
    monkeypatch.setattr(growthx.run, "solve", cut_off)
    seen = set()

    @fuzz(250)
    @given(ARGUMENTS)
    def given_arguments(arguments):
        status, out, err = run(arguments)
        seen.add(status)
        assert status in (0, 2, 3), err
        assert len(set(COMM.allgather(status))) == 1
        if status != 0:
            assert out == ""
            assert err.count("\n") == (1 if COMM.rank == 0 else 0)
            assert err.startswith("growthx: " if COMM.rank == 0 else "")
            assert len(err) < 6000

    given_arguments()
    assert seen == {0, 2, 3}, "some must be refused, and some not"


# The femur, and a block beside it that nothing holds.
TWO_BODIES = (
    meshing.locate("femur.geo")
    .read_text()
    .replace(
        'Physical Surface("bone", 1) = {1};',
        "Point(101) = {100, 0, 0}; Point(102) = {120, 0, 0}; Point(103) = {120, 20, 0}; Point(104) = {100, 20, 0};\n"
        "Line(101) = {101, 102}; Line(102) = {102, 103}; Line(103) = {103, 104}; Line(104) = {104, 101};\n"
        "Curve Loop(2) = {101, 102, 103, 104}; Plane Surface(2) = {2}; Recombine Surface {2};\n"
        'Physical Surface("bone", 1) = {1, 2};',
    )
)


@pytest.mark.serial
@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["bar", "--step", "nan"], "the time step Δt is nan"),
        (["femur", "--mesh", "missing.msh"], "there is no file missing.msh"),
        (["femur", "--mesh", "syntax.geo"], "gmsh cannot make a mesh of syntax.geo"),
        (["femur", "--mesh", "two.geo"], "of the scene 'femur'"),
        (["plate", "--elements", "4", "--out", "full"], "the folder full is not empty"),
        (["plate", "--elements", "4", "--out", "full/file"], "the folder full/file cannot be made"),
    ],
)
def test_two_ranks_end_together(arguments, sentence, tmp_path):
    """One sentence, status 2, and no rank left waiting for another: a hang costs a cluster's night."""
    (tmp_path / "syntax.geo").write_text("Point(1) = {0, 0, 0}\nLine(1) = {1, 2};\n")
    (tmp_path / "two.geo").write_text(TWO_BODIES)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").write_text("mine")
    ended = on_two_ranks(["-m", "growthx", *arguments], tmp_path)
    assert ended.returncode == 2
    *notices, said = (line for line in ended.stderr.splitlines() if line.startswith("growthx: "))
    assert all("islands" in notice for notice in notices) and len(notices) == ("two.geo" in arguments)
    assert sentence in said and "Traceback" not in ended.stderr
    assert (tmp_path / "full" / "file").read_text() == "mine"


@pytest.mark.serial
def test_two_ranks_end_together_when_the_disk_is_full(tmp_path):
    """The disk of one rank's node is full: both hear of it, and the folder is left without a half of the results."""
    program = (
        "import resource, sys; from mpi4py import MPI; from growthx.cli import main; import growthx.results\n"
        "start = growthx.results.FieldWriter.__init__\n"
        "def limited(*arguments):\n"
        "    if MPI.COMM_WORLD.rank == 1: resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))\n"
        "    start(*arguments)\n"
        "growthx.results.FieldWriter.__init__ = limited\n"
        "sys.exit(main(['plate', '--elements', '8', '--json', '--out', 'out']))"
    )
    ended = on_two_ranks(["-c", program], tmp_path)
    assert ended.returncode == OutputError.exit_status
    (said,) = [line for line in ended.stderr.splitlines() if line.startswith("growthx: ")]
    assert said.startswith("growthx: the results cannot be written to out (File too large)")
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["history.csv"]


def on_two_ranks(arguments, folder):
    """How a Python program ended that was started on two ranks."""
    command = ["mpirun", "-n", "2", sys.executable, *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120)
