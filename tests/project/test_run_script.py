"""The script ./run where things go wrong: it ends with one sentence, and nothing is left half made, mounted or running.

A stand-in for mmdebstrap makes a tree of a few programs at once, in a copy of the checkout that holds little more than
the script, with a cache folder of its own.
"""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.serial

REPO = Path(__file__).parents[2]
PROGRESS = ("growthx: making a Debian 13 tree", "growthx: waiting for another ./run")
MMDEBSTRAP = """#!/bin/bash
for word; do tree=$word; done
echo made >>"$XDG_CACHE_HOME/made"
mkdir -p "$tree/usr/bin" "$tree/usr/lib" "$tree/usr/lib64" "$tree/tmp"
for folder in bin lib lib64; do ln -s "usr/$folder" "$tree/$folder"; done
for program in bash cat env sh sleep; do
    file=$(command -v $program)
    cp -L --parents "$file" $(ldd "$file" | grep -o '/[^ ]*') "$tree"
done
touch "$tree/begun"
"""
DF = "#!/bin/sh\necho Avail; echo %d\n"

# A tree has no mount program, and these tests may themselves run in one.
MOUNT = f"""#!{sys.executable} -I
import ctypes, os, sys
BIND, RECURSIVE = 4096, 16384
*options, source, target = sys.argv[1:]
kind = options[1].encode() if options[0] == "-t" else None
size = options[3].encode() if kind else None
flags = {{"--bind": BIND, "--rbind": BIND | RECURSIVE}}.get(options[0], 0)
libc = ctypes.CDLL(None, use_errno=True)
if libc.mount(os.fsencode(source), os.fsencode(target), kind, flags, size) != 0:
    sys.exit(f"mount: {{target}}: {{os.strerror(ctypes.get_errno())}}")
"""


class Checkout:
    """A copy of the script with a few packages, its cache folder and programs that stand in for others."""

    def __init__(self, folder):
        self.cache, self.programs, self.script = folder / "cache", folder / "programs", folder / "checkout" / "run"
        for each in (self.cache, self.programs, self.script.parent):
            each.mkdir()
        shutil.copy(REPO / "run", self.script)
        (self.script.parent / "packages.txt").write_text("python3 # a comment\n")
        self.stand_in("mmdebstrap", MMDEBSTRAP)
        self.stand_in("df", DF % 9000)
        self.stand_in("mount", MOUNT)
        self.environment = {
            **{name: value for name, value in os.environ.items() if not re.match("PMIX|OMPI|PRTE", name)},
            "XDG_CACHE_HOME": str(self.cache),
            "GROWTHX_ENVIRONMENT": "tree",
            "PATH": f"{self.programs}:{os.environ['PATH']}",
        }

    def stand_in(self, name, script):
        """Let a script take the place of a program."""
        file = self.programs / name
        file.unlink(missing_ok=True)
        file.write_text(script)
        file.chmod(0o755)

    def start(self, *command, before=()):
        """The script as a process of its own session, as on a terminal of its own."""
        return subprocess.Popen(
            [*before, str(self.script), *command],
            env=self.environment,
            cwd=self.script.parent,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            restore_signals=True,
        )

    def run(self, *command, before=()):
        """Exit status, output and messages of the script."""
        process = self.start(*command, before=before)
        output, messages = process.communicate(timeout=60)
        return process.returncode, output, messages

    def processes(self):
        """Numbers of all running processes that work with this cache folder."""
        found = []
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                if str(self.cache).encode() in (folder / "environ").read_bytes():
                    found.append(int(folder.name))
            except OSError:
                continue
        return found

    def assert_nothing_left(self):
        """No part of a tree, no mount and, after a moment, no process."""
        assert not list(self.cache.glob("growthx/unfinished.*"))
        assert str(self.cache) not in Path("/proc/self/mountinfo").read_text(encoding="utf-8")
        wait_until(lambda: not self.processes())

    def assert_refused(self, *command, says, before=()):
        """The script ends with one sentence, and leaves nothing behind."""
        status, output, messages = self.run(*(command or ("true",)), before=before)
        assert status == 1 and output == ""
        assert_one_sentence(messages, says)
        self.assert_nothing_left()


def assert_one_sentence(messages, says):
    """One line besides those that tell of progress, and it is the script's own."""
    lines = [line for line in messages.splitlines() if not line.startswith(PROGRESS)]
    assert len(lines) == 1 and lines[0].startswith("growthx: ")
    assert re.search(says, lines[0])


def wait_until(condition, seconds=20):
    """Wait for what happens soon."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.fixture
def checkout(tmp_path):
    made = Checkout(tmp_path)
    yield made
    for process in made.processes():
        os.kill(process, signal.SIGKILL)


@pytest.fixture
def machine(checkout):
    """A checkout on a machine where trees can be made and entered."""
    if os.geteuid() != 0:
        pytest.skip("only root makes trees without a package that maps its ids")
    if subprocess.run(["unshare", "--mount", "true"], capture_output=True).returncode != 0:
        pytest.skip("nothing may be mounted here, as in a container")
    return checkout


def test_a_tree_is_made_once_and_commands_run_in_it(machine):
    """The way that all others leave: words, exit status and environment arrive, and no mount stays."""
    for _ in range(2):
        status, output, messages = machine.run("sh", "-c", 'echo "$PYTHONPATH" "$1"; exit 7', "sh", "two words")
        assert (status, output) == (7, f"{machine.script.parent} two words\n")
        machine.assert_nothing_left()
    assert messages == "" and (machine.cache / "made").read_text(encoding="utf-8") == "made\n"


@pytest.mark.parametrize(("name", "status"), [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)])
def test_an_interrupted_set_up_leaves_nothing(machine, name, status):
    """It takes minutes, so people stop it: the next one must begin anew."""
    machine.stand_in("mmdebstrap", MMDEBSTRAP + "sleep 60\n")
    process = machine.start("true")
    wait_until(lambda: list(machine.cache.glob("growthx/unfinished.*/tree/begun")))
    process.send_signal(getattr(signal, name))
    messages = process.communicate(timeout=20)[1]
    assert process.returncode == status
    assert_one_sentence(messages, "interrupted: nothing is kept of the tree")
    machine.assert_nothing_left()
    machine.stand_in("mmdebstrap", MMDEBSTRAP)
    assert machine.run("sh", "-c", "exit 7")[0] == 7


def test_the_next_one_clears_up_after_a_killed_set_up(machine):
    """Who is killed cannot clear up, but what it has started must not go on."""
    machine.stand_in("mmdebstrap", MMDEBSTRAP + "sleep 60\n")
    process = machine.start("true")
    wait_until(lambda: list(machine.cache.glob("growthx/unfinished.*/tree/begun")))
    process.kill()
    process.communicate(timeout=20)
    wait_until(lambda: not machine.processes())
    machine.stand_in("mmdebstrap", MMDEBSTRAP)
    assert machine.run("sh", "-c", "exit 7")[0] == 7
    machine.assert_nothing_left()


def test_two_at_once_make_one_tree(machine):
    """The second one waits for the first, and both run."""
    machine.stand_in("mmdebstrap", MMDEBSTRAP + "sleep 1\n")
    both = [machine.start("sh", "-c", "echo here") for _ in range(2)]
    ends = [process.communicate(timeout=60) for process in both]
    assert [process.returncode for process in both] == [0, 0]
    assert [output for output, _ in ends] == ["here\n"] * 2
    assert sorted(messages[:16] for _, messages in ends) == ["growthx: making ", "growthx: waiting"]
    assert (machine.cache / "made").read_text(encoding="utf-8") == "made\n"
    machine.assert_nothing_left()


def test_little_space_is_told_before_anything_is_made(machine):
    """Three gigabytes do not fit everywhere."""
    machine.stand_in("df", DF % 700)
    machine.assert_refused(
        says=r"cache/growthx has 700 MB free: the Debian tree needs 5000 MB \(XDG_CACHE_HOME moves it"
    )
    assert not (machine.cache / "made").exists()


def test_space_that_runs_out_is_told_as_such(machine):
    """Others write to the disk as well; a log on a full disk is empty, and the network is not to blame."""
    fill = 'dd if=/dev/zero of="$tree/more" bs=1M || exit 1\n'
    machine.stand_in("mmdebstrap", MMDEBSTRAP + fill)
    machine.stand_in("df", f'#!/bin/sh\n[ -e "$XDG_CACHE_HOME/made" ] && exec {shutil.which("df")} "$@"\n' + DF % 9000)
    small = ["unshare", "--mount", "sh", "-c", f'mount -t tmpfs -o size=64m none "{machine.cache}"; exec "$@"', "sh"]
    look = ["sh", "-c", f'"$@"; status=$?; ls -d "{machine.cache}/growthx"/unfinished.* 2>&-; exit $status', "sh"]
    machine.assert_refused(before=[*small, *look], says="cache/growthx ran out of space: the Debian tree needs 5000 MB")


def test_without_a_network_its_error_is_told(machine):
    """What the maker of the tree has said last is seldom what was wrong."""
    failing = (
        'echo "I: trying"; echo "E: Failed to fetch http://deb" >&2; echo "E: mmdebstrap failed to run" >&2; exit 1\n'
    )
    machine.stand_in("mmdebstrap", MMDEBSTRAP + failing)
    machine.assert_refused(says=r"could not be made \(is there a network\?\): E: Failed to fetch http://deb \[log: ")


@pytest.mark.parametrize("program", ["sha256sum", "flock", "mount", "unshare", "df", "mktemp", "setpriv"])
def test_a_missing_program_is_named(checkout, program):
    """Small systems lack some of them, and the shell's own message names a line of the script."""
    for folder in ("/usr/bin", "/bin"):
        for file in Path(folder).iterdir():
            if not (checkout.programs / file.name).exists():
                (checkout.programs / file.name).symlink_to(file)
    (checkout.programs / program).unlink()
    checkout.environment["PATH"] = str(checkout.programs)
    if any((Path(folder) / program).exists() for folder in ("/usr/sbin", "/sbin")):
        pytest.skip(f"{program} is where the script looks by itself")
    checkout.assert_refused(says=f"the program {program} is not on the PATH")


def test_users_that_cannot_make_a_tree_are_told_what_to_install(checkout):
    """Neither namespaces nor subordinate ids nor mmdebstrap go without saying on machines of others."""
    checkout.stand_in("id", "#!/bin/sh\ncase $1 in -un) echo ada ;; *) echo 1000 ;; esac\n")
    checkout.stand_in("unshare", "#!/bin/sh\nexit 1\n")
    checkout.assert_refused(says="user ada may make no namespaces on this machine: run as root, or install Docker")
    checkout.stand_in("unshare", '#!/bin/sh\ncase "$*" in *--map-auto*) exit 1 ;; esac\n')
    checkout.assert_refused(says="user ada has no subordinate ids: install uidmap")
    checkout.stand_in("unshare", "#!/bin/sh\n")
    (checkout.programs / "mmdebstrap").unlink()
    if shutil.which("mmdebstrap") is None:
        checkout.assert_refused(says="mmdebstrap is not installed: install it and uidmap, or Docker or DOLFINx")


def test_a_cache_that_cannot_be_written_is_named(checkout):
    """As with a home on a disk that is mounted read-only."""
    checkout.environment["XDG_CACHE_HOME"] = "/dev/null"
    checkout.assert_refused(says=r"the cache folder /dev/null/growthx cannot be written \(XDG_CACHE_HOME moves it\)")


def test_a_home_that_is_not_set_is_asked_for(checkout):
    """Services have none."""
    del checkout.environment["HOME"]
    checkout.assert_refused(says="the variable HOME is not set: it must name your home folder")


def test_an_unknown_environment_is_refused(checkout):
    """A slip must not be taken for a wish."""
    checkout.environment["GROWTHX_ENVIRONMENT"] = "conda"
    checkout.assert_refused(says="GROWTHX_ENVIRONMENT is 'conda': python, docker or tree would be right")


def test_a_container_has_what_the_user_has_set(checkout):
    """PETSc's options, or where the cache is, would be lost without a word; what the script sets itself comes last."""
    checkout.stand_in("docker", '#!/bin/bash\n[ "$1" != run ] || printf "%s\\n" "$@"\n')
    checkout.environment |= {"GROWTHX_ENVIRONMENT": "docker", "PETSC_OPTIONS": "-malloc no", "GROWTHX_PIP": "a b"}
    status, output, messages = checkout.run("python", "script.py")
    words = output.splitlines()
    assert status == 0 and messages == ""
    set_inside = [words[at + 1] for at, word in enumerate(words) if word == "--env"]
    assert {"PETSC_OPTIONS", "GROWTHX_PIP", "XDG_CACHE_HOME"} <= set(set_inside)
    assert "GROWTHX_ENVIRONMENT" not in set_inside and "--env=GROWTHX_ENVIRONMENT=python" in words
    assert words[-2:] == ["python3", "script.py"] and f"{checkout.script}" in words


def test_another_release_has_a_tree_of_its_own(machine):
    """What runs with sid's DOLFINx must neither take nor sweep away the tree that everything else runs in."""
    machine.environment["GROWTHX_ENVIRONMENT"] = ""
    machine.environment["GROWTHX_DEBIAN"] = "sid"
    machine.stand_in("mmdebstrap", MMDEBSTRAP + 'echo "$*" >"$tree/asked"\n')
    (machine.cache / "growthx" / "debian13-older").mkdir(parents=True)
    status, asked, messages = machine.run("cat", "/asked")
    assert status == 0, messages
    assert "making a Debian sid tree" in messages and " sid " in asked and "Check-Valid-Until false" in asked
    trees = sorted(path.name.rpartition("-")[0] for path in (machine.cache / "growthx").glob("debian*"))
    assert trees == ["debian-sid", "debian13"]
    machine.environment["GROWTHX_ENVIRONMENT"] = "python"
    machine.assert_refused(says="another release needs the environment tree")


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGKILL"])
def test_a_signal_ends_the_command_itself(machine, name):
    """The command takes the script's place, also for those who send the signal: no process stays."""
    process = machine.start("sleep", "60")
    wait_until(lambda: any(_words(each)[0].endswith(b"sleep") for each in machine.processes()))  # not "./run sleep 60"
    process.send_signal(getattr(signal, name))
    process.communicate(timeout=20)
    assert process.returncode == -getattr(signal, name)
    machine.assert_nothing_left()


@pytest.mark.skipif(shutil.which("setpriv") is None, reason="ranks are bound to mpirun by setpriv")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGKILL"])
def test_no_rank_outlives_mpirun(checkout, name):
    """A scheduler that kills mpirun leaves it no time to end its ranks, which would go on for hours."""
    checkout.environment["GROWTHX_ENVIRONMENT"] = "python"
    process = checkout.start("mpirun", "-n", "2", "python", "-c", "import time; time.sleep(60)")
    wait_until(lambda: sum(b"time.sleep" in _words(each)[-1] for each in checkout.processes()) >= 3)
    process.send_signal(getattr(signal, name))
    process.communicate(timeout=20)
    assert process.returncode != 0
    checkout.assert_nothing_left()


def _words(process):
    """The command line of a process, its last word last; one empty word if it has ended."""
    try:
        return Path(f"/proc/{process}/cmdline").read_bytes().rstrip(b"\0").split(b"\0")
    except OSError:
        return [b""]
