"""`growthx help`: what a message ends with, a name, a page and a command are about."""

import re

import pytest
from blocks import COMM

import growthx as gx
from docs.site import contents
from growthx.cli.machine import pages
from growthx.cli.program import _parser


def said(out):
    """What rank 0 alone has printed, on all ranks."""
    assert COMM.rank == 0 or out == ""
    return COMM.bcast(out)


@pytest.mark.parametrize(
    ("arguments", "place"),
    [
        (("bar", "--elements", "0"), "scenes.bar.bar"),
        (("bar", "--step", "-1"), "model.program.Program"),
        (("femur", "--mesh", "missing.msh"), "meshing.files.read"),
        (("plate", "--shape", "triangle", "--variant", "Q1sri"), "discretisation.variants.Variant.check"),
        (("plate", "--law", "nothing"), "constitutive.laws.catalogue.named"),
    ],
)
def test_what_a_message_ends_with_leads_on(arguments, place, in_process):
    """To what is written of the thing that was refused, and to the pages about it."""
    status, _, err = in_process(*arguments)
    assert status == 2
    assert COMM.bcast(err).endswith(f" (growthx help {place} tells more)\n")
    status, out, err = in_process("help", place)
    assert (status, err) == (0, "")
    told = said(out)
    assert told.startswith(place) and "\nMore:\n" in told
    names = re.findall(r"^  growthx help (\S+): ", told, re.MULTILINE)
    assert names and set(names) <= set(pages.titles())


@pytest.mark.parametrize("name", ["Scene", "gx.Scene", "ct.read", "scenes.bar", "Q1P0", "meshing"])
def test_a_name_of_scripts_has_its_docstring(name, in_process):
    """With its call, without what is of this process alone, such as the address of a function."""
    status, out, err = in_process("help", name)
    value = contents.found(name.removeprefix("gx."))
    assert (status, err) == (0, "")
    assert (value.__doc__ or "").splitlines()[0] in said(out) and " at 0x" not in said(out)


def test_pages_and_commands_are_told(in_process):
    """A page as it is written, a command as by --help, and all of them without a topic."""
    status, out, _ = in_process("help", "howto/stop")
    assert status == 0 and said(out).startswith(f"# {pages.titles()['howto/stop']}\n")
    status, out, _ = in_process("help", "weinans")
    assert status == 0 and said(out).startswith("usage: growthx weinans")
    status, out, _ = in_process("help")
    (words,) = (each.choices for each in _parser()._actions if isinstance(each.choices, dict))
    assert status == 0 and all(word in said(out) for word in (*words, *gx.__all__[1:], *pages.titles()))


@pytest.mark.parametrize(
    "topic", ["Scen", "", "__main__", "model._x", "../CONTRIBUTING", "loads.md", "cli.nothing", "Q1.x", "."]
)
def test_what_there_is_no_help_on_is_said(topic, in_process):
    """With what is near, and without a place of its own: that of the help itself would lead nowhere."""
    status, out, err = in_process("help", topic)
    assert (status, out) == (2, "")
    sentence = COMM.bcast(err)
    assert sentence.startswith(f"growthx: there is no help on '{topic}': ") and sentence.endswith("would be right\n")
    assert topic != "Scen" or "Scene" in sentence


def test_an_installation_names_pages_that_it_has_not(in_process, monkeypatch):
    """The wheel has no pages: where they are in the documentation is told."""
    monkeypatch.setattr(pages, "folder", lambda: None)
    status, out, _ = in_process("help", "model.loads.Traction")
    assert status == 0 and said(out).endswith("More in the documentation: docs/loads.md, docs/theory.md\n")
    assert in_process("help")[0] == 0 and in_process("help", "loads")[0] == 2
