"""Old names of arguments: scripts of last year still run, and say what to change."""

import subprocess
import sys
import warnings
from dataclasses import dataclass, fields, replace

import dolfinx  # noqa: F401  # with FFCx, which has warnings logged from then on: before they are looked for
import numpy as np
import pytest
from blocks import gathered

import growthx as gx
from growthx.common.renamed import renamed, renamed_fields


@renamed(cells="elements")
def grid(elements=1, *, size=1.0):
    """Something that had another argument once."""
    return elements, size


def test_the_old_name_has_its_full_effect_and_a_notice():
    """At the caller's line; the new one is silent."""
    with pytest.warns(DeprecationWarning, match=r"^grid: 'cells' is called 'elements' now, and the old name") as found:
        assert grid(cells=3, size=2.0) == (3, 2.0)
    assert found[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert grid(3, size=2.0) == grid(elements=3, size=2.0) == (3, 2.0)


def test_both_names_are_refused():
    """One of them would be without effect."""
    with pytest.raises(gx.InputError, match="grid has cells=3 and elements=4, which are the same: elements alone"):
        grid(cells=3, elements=4)


def nodes_of(mesh):
    """Of the whole body, in an order of their own: one and the same mesh is cut in other pieces each time."""
    return np.unique(gathered(mesh.domain.geometry.x), axis=0)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (lambda: gx.scenes.plate(cells=3), lambda: gx.scenes.plate(elements=3)),
        (lambda: gx.scenes.block(cells=1), lambda: gx.scenes.block(elements=1)),
        (lambda: gx.scenes.bone_plate(cells=2), lambda: gx.scenes.bone_plate(elements=2)),
        (lambda: gx.scenes.weinans_plate(cells=3), lambda: gx.scenes.weinans_plate(elements=3)),
        (
            lambda: gx.scenes.bar(problem=gx.scenes.CONTINUOUS, elements=10, cells="triangle"),
            lambda: gx.scenes.bar(kind="continuous", elements=10, shape="triangle"),
        ),
        (lambda: gx.scenes.femur(cells="triangle", size=9.0), lambda: gx.scenes.femur(shape="triangle", size=9.0)),
    ],
)
def test_scenes_by_old_names_are_the_same(old, new):
    """With the same mesh, loads and law."""
    with pytest.warns(DeprecationWarning):
        before = old()
    now = new()
    assert str(before) == str(now)
    assert np.array_equal(nodes_of(before.mesh), nodes_of(now.mesh))


def test_a_stem_by_old_names_is_the_same():
    """Its head had the name of the femur's, which is a circle and no radius."""
    with pytest.warns(DeprecationWarning, match="'head' is called 'head_radius'"):
        before = gx.scenes.stem_mesh(head=15.0, size=6.0)
    now = gx.scenes.stem_mesh(head_radius=15.0, size=6.0)
    assert np.array_equal(nodes_of(before), nodes_of(now))


@renamed_fields(cells="elements")
@dataclass(frozen=True)
class Grid:
    """Something that had another field once."""

    elements: int = 1


def test_a_field_by_its_old_name():
    """When it is made and when it is read, each with a notice at the caller's line; both names are refused."""
    with pytest.warns(DeprecationWarning, match=r"^Grid: 'cells' is called 'elements' now") as found:
        assert Grid(cells=3) == Grid(3)
    with pytest.warns(DeprecationWarning, match=r"^Grid: 'cells' is called 'elements' now") as read:
        assert Grid(elements=3).cells == 3
    assert found[0].filename == read[0].filename == __file__
    with pytest.raises(gx.InputError, match="Grid has cells=3 and elements=4, which are the same: elements alone"):
        Grid(cells=3, elements=4)
    with pytest.raises(gx.InputError, match="elements alone would be right"):
        replace(Grid(3), cells=4)
    with pytest.raises(AttributeError, match="Grid has no 'cells'"):
        _ = Grid.cells
    assert [each.name for each in fields(Grid)] == ["elements"]


@pytest.mark.serial
@pytest.mark.parametrize("log", ["", "import logging; logging.basicConfig()"])
def test_a_script_shows_the_notice_once(log, tmp_path):
    """FFCx has warnings logged, and a program that does not set its log up would show none."""
    script = tmp_path / "last_year.py"
    script.write_text(f"{log}\nimport dolfinx\nimport growthx as gx\ngx.MartinSurface(unit=1.0)\n")
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True)
    assert done.stderr.count("MartinSurface: 'unit' is called 'length_unit' now") == 1, done.stderr
    assert f"{script}:4" in done.stderr


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (lambda: gx.Foundation("bottom", normal=2.0, tangential=1.0), lambda: gx.Foundation("bottom", 2.0, 1.0)),
        (lambda: gx.MartinSurface(unit=1000.0), lambda: gx.MartinSurface(length_unit=1000.0)),
        (lambda: gx.Q1Q1.lumped(source=True), lambda: gx.Q1Q1.lumped(with_source=True)),
        (lambda: gx.functions.positive_part(0.05, width=0.1), lambda: gx.functions.positive_part(0.05, rounding=0.1)),
    ],
)
def test_words_that_had_two_meanings_are_still_understood(old, new):
    """The same object or number, with a notice."""
    with pytest.warns(DeprecationWarning, match="and the old name will go"):
        assert old() == new()


def test_the_bar_takes_the_words_of_the_command_line():
    """And says which there are."""
    assert gx.scenes.bar("continuous", 10).name == gx.scenes.bar(gx.scenes.CONTINUOUS, 10).name
    with pytest.raises(gx.InputError, match="there is no bar problem 'other': one of discontinuous, continuous"):
        gx.scenes.bar("other")
