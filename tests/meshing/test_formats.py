"""A format of meshes is one module, or one object of the user's: what all formats share is not said in it again."""

import importlib
import subprocess
import sys
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from blocks import COMM, block

import growthx as gx
from growthx import meshing
from growthx.common.errors import InputError
from growthx.meshing import formats
from growthx.meshing.parts import no_parameters


class Grids:
    """A toy format: a file says how many squares there are each way, such as "4 3"."""

    SUFFIXES: ClassVar = {".grid": "a grid of squares"}

    def read(self, path, values):
        no_parameters(path, values)
        try:
            across, up = map(int, path.read_text().split())
        except ValueError as error:
            raise InputError(f"{path} is no grid ({error}): two numbers would be right") from error
        y, x = (grid.ravel() for grid in np.mgrid[: up + 1, : across + 1])
        first = np.flatnonzero((x < across) & (y < up))
        ends = {"left": np.flatnonzero(x == 0), "right": np.flatnonzero(x == across)}
        return meshing.Parts(
            "quadrilateral",
            np.column_stack([x / across, y / up]),
            np.add.outer(first, [0, 1, across + 1, across + 2]),
            {name: np.column_stack([nodes[:-1], nodes[1:]]) for name, nodes in ends.items()},
            {"all": np.arange(len(first)), "low": np.flatnonzero(y[first] == 0)},
        )


class Changed(Grids):
    """The same with other parts than it should have."""

    def __init__(self, **changes):
        self.changes = changes

    def read(self, path, values):
        return replace(super().read(path, values), **self.changes)


class Failing(Grids):
    """A format that fails in some way."""

    def __init__(self, failure):
        self.failure = failure

    def read(self, path, values):
        raise self.failure


@pytest.fixture
def register(monkeypatch):
    """What registers formats for one test."""
    monkeypatch.setattr(formats, "_registered", [])
    return formats.register


def own(name):
    """Suffixes of a format of growthx's own."""
    return importlib.import_module(f"growthx.meshing.formats.{name}").SUFFIXES


def put(path, text):
    if COMM.rank == 0:
        path.write_text(text)
    return path


def refusal(path, kind=InputError, **arguments):
    """The sentence with which every rank refuses a file."""
    with pytest.raises(kind) as caught:
        meshing.read(path, **arguments)
    (sentence,) = set(COMM.allgather(str(caught.value)))
    assert "\n" not in sentence
    return sentence


@pytest.mark.parametrize("refine", [1, 3])
def test_a_format_of_ones_own_is_read_split_and_spread(refine, register, shared_folder):
    """With its boundaries and regions, and good for a run."""
    register(Grids())
    mesh = meshing.read(put(shared_folder / "small.grid", "4 3"), refine=refine)
    assert (mesh.cell_name, mesh.cell_count) == ("quadrilateral", 12 * refine**2)
    assert (set(mesh.boundaries), set(mesh.regions)) == ({"left", "right"}, {"all", "low"})
    assert mesh.facet_counts("left") == (0, 3 * refine)
    low = mesh.region("low")
    assert COMM.allreduce(np.count_nonzero(low < len(mesh.owned_cells))) == 4 * refine**2
    result = gx.solve(block(mesh, growing=("low",)), gx.Q1)
    assert result.problem.spaces.growing_size() == pytest.approx(1 / 3)


def test_a_file_of_no_known_format_hears_of_all(register, shared_folder):
    """Those that were registered, too."""
    path = put(shared_folder / "mesh.off", "<VTKFile/>")
    *others, last = formats.in_words()
    assert len(others) > 10 and refusal(path) == f"{path} is neither {', '.join(others)} nor {last}"
    register(Grids())
    assert refusal(path).endswith(f"{last} nor a grid of squares (.grid)")
    assert f"{last} or a grid of squares (.grid) would be right" in refusal(shared_folder / "none.grid")


def test_what_a_format_refuses_is_one_sentence(register, shared_folder):
    """On all ranks, of which the first alone reads."""
    register(Grids())
    assert "is no grid" in refusal(put(shared_folder / "bad.grid", "4 many"))
    path = put(shared_folder / "good.grid", "1 1")
    assert refusal(path, size=2).endswith("is a mesh and takes no parameters ('size'): none would be right")
    assert "refine" in refusal(path, refine=0)


@pytest.mark.parametrize(
    ("failure", "kind", "sentence"),
    [
        (OSError("a cable is loose"), InputError, "cannot be read (a cable is loose)"),
        (ZeroDivisionError("it has\nno end"), RuntimeError, "failed: ZeroDivisionError('it has\\nno end')"),
        (MemoryError(), InputError, "does not fit into memory"),
    ],
    ids=["system", "mistake", "memory"],
)
def test_a_format_that_fails_leaves_no_rank_waiting(failure, kind, sentence, register, shared_folder):
    """A mistake in it is told as what it is."""
    register(Failing(failure))
    assert sentence in refusal(put(shared_folder / "good.grid", "2 2"), kind)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"shape": "pyramid"}, "shape 'pyramid': one of triangle"),
        ({"points": np.zeros((4, 3))}, "2 finite coordinates of each"),
        ({"points": np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [np.nan, 1.0]])}, "2 finite coordinates of each"),
        ({"points": np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.4, 0.4]])}, "1 of the 1 cells"),
        ({"cells": np.array([[0, 1, 2, 4]])}, "below 4, 4 in each row, would be right"),
        ({"cells": np.array([[0, 1, 2]])}, "below 4, 4 in each row, would be right"),
        ({"cells": np.empty((0, 4), dtype=int)}, "has no cells"),
        ({"boundaries": {"left": np.array([[0, 7]])}}, "of the nodes of 'left'"),
        ({"boundaries": {"across": np.array([[0, 3]])}}, "'across' of .* is not made of sides of cells"),
        ({"boundaries": {"none": np.empty((0, 2), dtype=int)}}, "'none' of .* has no elements"),
        ({"regions": {"all": np.array([1])}}, "of the cells of 'all' .* below 1 would be right"),
    ],
    ids=lambda value: "" if isinstance(value, str) else next(iter(value)),
)
def test_what_every_format_is_looked_at_for(changes, sentence, register, shared_folder):
    """Whoever writes a format need not think of it: nothing of no use goes on to DOLFINx, which would crash."""
    register(Changed(**changes))
    path = put(shared_folder / "one.grid", "1 1")
    with pytest.raises(InputError, match=sentence):
        meshing.read(path)


def test_what_was_read_may_not_be_anything(register, shared_folder):
    """A format that returns DOLFINx's own mesh, perhaps."""

    class Nothing(Grids):
        def read(self, path, values):
            return None

    register(Nothing())
    assert "what was read of" in refusal(put(shared_folder / "one.grid", "1 1"))


class Meshes(Grids):
    SUFFIXES: ClassVar = {".msh": "a mesh of mine"}


@pytest.mark.parametrize(
    ("form", "sentence"),
    [
        (5, "SUFFIXES, of a format"),
        (type("Bare", (), {"SUFFIXES": {".a": "a file"}})(), "read, of a format"),
        (type("Odd", (Grids,), {"SUFFIXES": {"grid": "a grid"}})(), "such as '.msh', and what such a file is"),
        (type("Mute", (Grids,), {"SUFFIXES": {".grid": None}})(), "such as '.msh', and what such a file is"),
        (Meshes(), "the suffix .msh are those of another format"),
    ],
)
def test_what_is_no_format_is_refused(form, sentence, register):
    """When it is registered, not when a file is read."""
    with pytest.raises(InputError, match=sentence):
        register(form)
    assert list(formats.known()) == [suffix for name in formats.OURS for suffix in own(name)]


def test_a_format_may_be_registered_again(register):
    """As a cell of a notebook does that is run once more; another one of that suffix may not."""
    toy = Grids()
    register(toy)
    register(toy)
    assert list(formats.known()) == [*(suffix for name in formats.OURS for suffix in own(name)), ".grid"]
    with pytest.raises(InputError, match=r"suffix .grid are those of another"):
        register(Grids())


@pytest.mark.serial
def test_other_formats_need_no_gmsh():
    """Nor does a scene without a file."""
    program = (
        "import sys; from growthx.cli import main; main(['plate', '--elements', '2', '--json'])\n"
        "from growthx.meshing import formats; assert '.msh' in formats.known(); assert 'gmsh' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
