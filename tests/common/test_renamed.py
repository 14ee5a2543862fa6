"""Old names of arguments: scripts of last year still run, and say what to change."""

import warnings

import numpy as np
import pytest

import growthx as gx
from growthx.common.renamed import renamed


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
    assert np.array_equal(before.mesh.domain.geometry.x, now.mesh.domain.geometry.x)


def test_a_stem_by_old_names_is_the_same():
    """Its head had the name of the femur's, which is a circle and no radius."""
    with pytest.warns(DeprecationWarning, match="'head' is called 'head_radius'"):
        before = gx.scenes.stem_mesh(head=15.0, size=6.0)
    now = gx.scenes.stem_mesh(head_radius=15.0, size=6.0)
    assert np.array_equal(before.domain.geometry.x, now.domain.geometry.x)


def test_the_bar_takes_the_words_of_the_command_line():
    """And says which there are."""
    assert gx.scenes.bar("continuous", 10).name == gx.scenes.bar(gx.scenes.CONTINUOUS, 10).name
    with pytest.raises(gx.InputError, match="there is no bar problem 'other': one of discontinuous, continuous"):
        gx.scenes.bar("other")
