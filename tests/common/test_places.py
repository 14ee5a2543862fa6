"""Where an error comes from: the word that a message ends with leads to what was refused, not to who looked at it."""

import pytest

import growthx as gx
from growthx.common.places import place_of


@pytest.mark.parametrize(
    ("wrong", "place"),
    [
        (lambda: gx.Material(young=-1.0), "constitutive.material.Material"),  # by a check that all call, in a base
        (lambda: gx.scenes.bar("other"), "scenes.bar.bar"),  # in a function of the module's own
        (lambda: gx.scenes.plate(0), "scenes.plate.plate"),
        (lambda: gx.Q1.check("triangle"), "discretisation.variants.Variant.check"),
        (lambda: gx.meshing.read("missing.msh"), "meshing.files.read"),
    ],
)
def test_the_place_is_that_of_what_is_refused(wrong, place):
    """A public function or class, or its module."""
    with pytest.raises(gx.InputError) as caught:
        wrong()
    assert place_of(caught.value) == place


def test_a_user_has_places_of_their_own():
    """An error that a script of the user's raises is no matter of growthx's, whoever has called it."""

    def watch(result):
        raise gx.InputError("seen enough: a user would be right")

    with pytest.raises(gx.InputError, match="seen enough") as caught:
        gx.solve(gx.scenes.plate(2), gx.Q1P0, watch=watch)
    assert place_of(caught.value) == ""
    assert place_of(gx.InputError("never raised")) == ""
