"""The docstrings of what users call: each has a short example, and what it prints is what the example says."""

import doctest
import inspect
import signal

import pytest

import growthx as gx

# What has no example yet.  The list may only become shorter: a name in it that has one fails, too.
WITHOUT_EXAMPLE: set[str] = {
    "baselines.Averaging",
    "baselines.Smoothed",
    "baselines.frozen",
    "baselines.update",
    "ct.ScanDensity",
    "ct.read",
    "ct.write",
    "meshing.Parts",
    "meshing.load_gmsh",
    "meshing.read",
    "plots.along_length",
    "plots.cutaway",
    "plots.densities",
    "plots.density",
    "plots.movie",
    "plots.slices",
    "plots.threshold",
    "report.numbers",
    "report.progress",
    "report.rows",
    "report.say",
    "report.steps",
    "report.table",
    "report.times",
    "results.DerivedField",
    "results.FieldWriter",
    "results.register",
    "scenes.Femur",
    "scenes.Femur3d",
    "scenes.femur",
    "scenes.femur3d",
    "scenes.stem",
    "scenes.stem_mesh",
    "variants.DensitySpace",
    "variants.right_ones",
}


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
    """An empty folder to write to, and the signals of the tests afterwards: `guarded` has its own."""
    monkeypatch.chdir(shared_folder)
    before = signal.getsignal(signal.SIGTERM)
    yield
    signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize("name", DOCUMENTED)
def test_the_example_in_a_docstring_runs(name, elsewhere):
    """What users copy from the reference works and prints what it says there; a new name has an example, too."""
    text = inspect.getdoc(DOCUMENTED[name]) or ""
    example = doctest.DocTestParser().get_doctest(text, {"gx": gx}, name, None, 0)
    assert bool(example.examples) != (name in WITHOUT_EXAMPLE), f"growthx.{name} has no example, or is still listed"
    said = []
    doctest.DocTestRunner(verbose=False).run(example, out=said.append)
    assert not said, "".join(said)
