"""The docstrings of what users call: each has a short example, and what it prints is what the example says."""

import doctest
import inspect
import signal

import pytest
from mpi4py import MPI

import growthx as gx

COMM = MPI.COMM_WORLD

# What prints on rank 0 alone.
BY_THE_FIRST = {f"report.{name}" for name in ("numbers", "say", "steps", "table", "times")}
NEEDS = {"ct.read": "nibabel", "ct.write": "nibabel"}  # of the extra [ct]


def public(module):
    """The classes and functions of a public module: those it lists, or else those that are written in it."""
    own = [name for name, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__]
    names = getattr(module, "__all__", [name for name in own if not name.startswith("_")])
    return [name for name in names if has_docstring(getattr(module, name))]


def has_docstring(value):
    """Whether it is a class or a function: other values have the docstring of their class."""
    return inspect.isclass(value) or inspect.isroutine(value)


def documented():
    """The objects with docstrings by their public names: a variant or a scheme has that of its class."""
    found = {}
    for name in gx.__all__:
        value = getattr(gx, name)
        if inspect.ismodule(value):
            found |= {f"{name}.{part}": getattr(value, part) for part in public(value)}
        elif not isinstance(value, str):  # the version, which is plain text
            found[name] = value if has_docstring(value) else type(value)
    return found


DOCUMENTED = documented()


@pytest.fixture
def elsewhere(shared_folder, monkeypatch):
    """An empty folder to write to; afterwards the signals of the tests, not of `guarded`, and no more fields."""
    monkeypatch.chdir(shared_folder)
    before, fields = signal.getsignal(signal.SIGTERM), dict(gx.results.FIELDS)
    yield
    signal.signal(signal.SIGTERM, before)
    for name in gx.results.FIELDS.keys() - fields.keys():
        del gx.results.FIELDS[name]


@pytest.mark.parametrize("name", DOCUMENTED)
def test_the_example_in_a_docstring_runs(name, elsewhere):
    """What users copy from the reference works and prints what it says there; a new name has an example, too."""
    if name in NEEDS:
        pytest.importorskip(NEEDS[name])
    text = inspect.getdoc(DOCUMENTED[name]) or ""
    example = doctest.DocTestParser().get_doctest(text, {"gx": gx}, name, None, 0)
    assert example.examples, f"growthx.{name} has no example"
    for each in example.examples if name in BY_THE_FIRST and COMM.rank > 0 else ():
        each.want = ""
    said = []
    runner = doctest.DocTestRunner(verbose=False, optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    runner.run(example, out=said.append)
    assert not said, "".join(said)
