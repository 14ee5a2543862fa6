"""Options by their old names: commands in scripts of last year still run, and say on stderr what to change."""

import argparse

import pytest
from mpi4py import MPI

from growthx.cli.command import _Former
from growthx.cli.program import _parser, main

COMM = MPI.COMM_WORLD
(WORDS,) = (each for each in _parser()._actions if isinstance(each, argparse._SubParsersAction))
FORMER = [
    (name, action.option_strings[0], action.now.option_strings[0])
    for name, own in WORDS.choices.items()
    for action in own._actions
    if isinstance(action, _Former)
]
VALUES = {"--dt": "0.5", "--n": "7", "--version": "12"}


def test_there_are_some():
    """Those that had two meanings, or a second word for one."""
    assert {old for _, old, _ in FORMER} == {"--n", "--cells", "--dt", "--loads", "--problem", "--trust", "--version"}


@pytest.mark.parametrize(("name", "old", "new"), FORMER)
def test_an_old_option_is_the_new_one(name, old, new, capsys):
    """All of its effect, one line, and not in the help."""
    value = [] if old == "--trust" else [VALUES.get(old, "word")]
    more = ["mesh.msh"] if name == "mesh" else []
    now = WORDS.choices[name].parse_args([*more, new, *value])
    assert capsys.readouterr().err == ""
    before = WORDS.choices[name].parse_args([*more, old, *value])
    assert vars(before) == vars(now)
    notice = f"growthx: {old} is called {new} now, and the old name will go\n"
    assert capsys.readouterr() == ("", notice if COMM.rank == 0 else "")
    assert f" {old} " not in WORDS.choices[name].format_help()


def test_a_misspelt_option_names_the_command_and_what_is_near(capsys):
    """Whose help tells what there is; the program's does not."""
    assert main(["plate", "--elemnts", "4", "--verbose"]) == 2
    said = (
        "unrecognized arguments: --elemnts 4 --verbose, --elements is near (growthx plate --help tells what there is)"
    )
    assert capsys.readouterr().err == (f"growthx: {said}\n" if COMM.rank == 0 else "")


@pytest.mark.parametrize(("word", "meant"), [("--time", "--times is near"), ("--energ", "--energy is near")])
def test_the_beginning_of_an_option_is_none(word, meant, capsys):
    """Python's parser would take --time for --times, and for something else once another option begins so."""
    assert main(["bar", word, "3"]) == 2
    said = f"growthx: unrecognized arguments: {word} 3, {meant} (growthx bar --help tells what there is)\n"
    assert capsys.readouterr().err == (said if COMM.rank == 0 else "")
