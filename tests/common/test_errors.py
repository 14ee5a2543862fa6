"""`require`, through which every parameter goes: what passes, what is refused, and the sentence it is refused with."""

import dolfinx
import numpy as np
import pytest
from mpi4py import MPI

from growthx.common.checks import require, require_vector
from growthx.common.errors import EndedEarly, GrowthxError, InputError, OutputError, raise_on_all

COMM = MPI.COMM_WORLD


def check(value):
    """Ask for a positive number."""
    require(value, "the length", "a positive number", lambda x: x > 0)


@pytest.fixture
def field():
    """A Function of one value per cell, two cells per rank."""
    domain = dolfinx.mesh.create_interval(COMM, 2 * COMM.size, (0.0, 1.0))
    return dolfinx.fem.Function(dolfinx.fem.functionspace(domain, ("DG", 0)))


@pytest.mark.parametrize("value", [1, 0.5, np.float32(2), np.int64(3), np.float64(1e-300)], ids=repr)
def test_numbers_of_every_kind_pass(value):
    """Values come from Python, NumPy and the command line: none of these types may be mistaken for a wrong one."""
    check(value)


def test_fields_pass():
    """A field has no number to check yet: functions of position, arrays and mappings of good values must go through."""
    for value in (lambda x: x[0], np.ones(3), {"bone": 1.0, "implant": lambda x: x[0]}):
        check(value)


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (-1.5, "-1.5"),
        (0, "0"),
        (float("nan"), "nan"),
        (float("inf"), "inf"),
        (np.float64("nan"), "nan"),
        (None, "None"),
        (True, "True"),
        (np.True_, repr(np.True_)),
        ("2.0", "'2.0'"),
        (1 + 0j, r"\(1\+0j\)"),
        ([1.0], r"\[1.0\]"),
        ({"bone": 1.0, "implant": -2.0}, "-2"),
        ({"bone": None}, "None"),
    ],
)
def test_wrong_values_are_refused_by_value(value, shown):
    """The message is all a user gets: it must show the value and the remedy; NaN and None must never pass."""
    with pytest.raises(InputError, match=rf"^the length.* is {shown}: a positive number would be right$"):
        check(value)


def test_a_mapping_names_the_region():
    """With values for ten regions, "is -2" alone would leave the user searching."""
    with pytest.raises(InputError, match=r"^the length of 'implant' is -2: "):
        check({"bone": 1.0, "implant": -2.0})


@pytest.mark.parametrize("wrong", [-3.0, 0.0, np.nan, np.inf])
def test_one_wrong_value_on_one_rank_is_refused_on_all(field, wrong):
    """A rank that raised alone would leave the others waiting in the next collective call."""
    field.x.array[:] = 1.0
    check(field)
    if COMM.rank == COMM.size - 1:
        field.x.array[0] = wrong
    with pytest.raises(InputError, match=f"^the length is {wrong:g} somewhere: a positive number would be right$"):
        check(field)


@pytest.mark.parametrize("value", [10**400, -(10**400), 1e101])
def test_numbers_beyond_all_units_are_refused(value):
    """Their squares overflow to infinity somewhere inside, where nobody could tell why."""
    with pytest.raises(
        InputError, match=r"^the length is .*: (a positive number|one of at most 1e\+100, .*) would be "
    ):
        check(value)


def test_a_message_is_one_line_however_long_the_value():
    """An array's own text has line breaks and no end; so may names that a message quotes."""
    for wrong in (np.ones((50, 50)), ["line\nbreak"] * 99):
        with pytest.raises(InputError) as caught:
            require_vector(wrong, "the\nforce")
        assert "\n" not in str(caught.value) and len(str(caught.value)) < 200


def test_what_one_rank_finds_is_raised_on_all():
    """A rank that raised alone would leave the others waiting; nothing found is nothing raised."""
    raise_on_all(COMM, "")
    with pytest.raises(OutputError, match=r"^found by the last$"):
        raise_on_all(COMM, "found by the last" if COMM.rank == COMM.size - 1 else "", OutputError)


def test_exit_statuses():
    """Scripts tell bad input (2) from a run that ended early (3) by these numbers."""
    assert [kind.exit_status for kind in (GrowthxError, OutputError, InputError, EndedEarly)] == [1, 1, 2, 3]
    assert issubclass(InputError, GrowthxError) and issubclass(EndedEarly, GrowthxError)
