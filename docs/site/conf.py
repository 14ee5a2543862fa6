"""Sphinx's settings of the site."""

from __future__ import annotations

import inspect
import re
from typing import Any

from docutils import nodes
from sphinx.util.inspect import signature, stringify_signature

import growthx
from docs.site import contents, cost, prose

project = "growthx"
author = "the growthx developers"
copyright = author
version = release = growthx.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.viewcode"]
html_theme = "sphinx_book_theme"
html_title = f"growthx {release}"
html_theme_options = {
    "use_download_button": True,
    "show_toc_level": 2,
    "home_page_in_toc": True,
    "navbar_persistent": [],  # the search is beside the pages, and once is enough
}
html_show_sourcelink = True
smartquotes = False  # a message's --option is no dash, and is searched for as it was printed
python_maximum_signature_line_length = 100  # longer calls have a line for each parameter

# Tutorials run at each build; an error in one is a warning with its traceback, and a warning ends the build.
nb_execution_mode = "force"
nb_execution_show_tb = True
nb_execution_in_temp = False  # beside the page, which shows the pictures that it leaves
nb_execution_timeout = 300
nb_merge_streams = True

myst_enable_extensions = ["deflist"]
myst_heading_anchors = 4  # as the repository's pages link to their headings

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True  # as the code has them: MPI.COMM_WORLD instead of an object at some address
python_use_unqualified_type_names = True
autodoc_default_options = {"members": True}

nitpicky = True
# Types in signatures. Links go to what is public; the rest names other libraries, which have sites of their own and
# cannot be looked up offline, type variables and aliases, and what growthx keeps to itself.
nitpick_ignore_regex = [("py:.*", r"(?!growthx\.).*"), ("py:.*", r"growthx\.\w+\.[\w.]+")]


def _docstring(_app: Any, _what: str, _name: str, _object: Any, _options: Any, lines: list[str]) -> None:
    lines[:] = prose.as_text(lines, KNOWN)


def _signature(
    _app: Any, what: str, _name: str, value: Any, _options: Any, told: str | None, returns: str | None
) -> Any:
    """Of a class whose metaclass takes any arguments, that of its constructor."""
    if what != "class" or not told or not told.startswith("(*values"):
        return told, returns
    if value.__init__ is object.__init__:
        return "()", returns
    parameters = signature(value.__init__, bound_method=True)
    own = [
        each.replace(
            default=inspect.Parameter.empty if each.default is inspect.Parameter.empty else _Default(each.default)
        )
        for each in parameters.parameters.values()
    ]
    words = stringify_signature(
        parameters.replace(parameters=own), unqualified_typehints=True, show_return_annotation=False
    )
    return words, returns


class _Default:
    """A default as a signature shows it, without addresses."""

    def __init__(self, value: Any) -> None:
        self.text = "…" if " at 0x" in repr(value) or "<factory>" in repr(value) else repr(value)

    def __repr__(self) -> str:
        return self.text


def _bases(_app: Any, _name: str, _value: Any, _options: Any, bases: list[Any]) -> None:
    bases[:] = contents.public_bases(bases)


def _public(app: Any, env: Any, node: Any, content: Any) -> Any:
    """A link to a public name from its name alone, or from where it is at home."""
    name = node.get("reftarget", "").rpartition(".")[2]
    if node.get("refdomain") == "py" and name in growthx._HOME and node["reftarget"] != f"growthx.{name}":
        return env.domains["py"].resolve_xref(env, node["refdoc"], app.builder, "obj", f"growthx.{name}", node, content)
    return None


CALL = re.compile(r"gx\.([\w.]+)(?:\(.*\))?")


def _link_names(app: Any, tree: nodes.document, page: str) -> None:
    """In prose, `gx.Scene` and `gx.solve(…)` lead to where they are told."""
    told = app.env.domains["py"].objects
    for literal in list(tree.findall(nodes.literal)):
        called = CALL.fullmatch(literal.astext())
        entry = called and told.get(f"growthx.{called[1]}")
        if entry and not isinstance(literal.parent, nodes.reference):
            address = f"{app.builder.get_relative_uri(page, entry.docname)}#{entry.node_id}"
            literal.replace_self(nodes.reference("", "", literal.deepcopy(), internal=True, refuri=address))


WAY_BACK = re.compile(r'<a class="viewcode-back" href="[^"#]*#([^"]+)">.*?</a>')


def _ways_back(app: Any, page: str, _template: str, context: dict[str, Any], _doctree: Any) -> None:
    """Pages of code lead to where names are told: Sphinx thinks that all names of a module are told as one room's."""
    if page.startswith("_modules/") and "body" in context:
        told = app.env.domains["py"].objects
        context["body"] = WAY_BACK.sub(lambda way: way[0] if way[1] in told else "", context["body"])


KNOWN = contents.documented()


def setup(app: Any) -> None:
    """Have docstrings read as what they are, and links find what is public."""
    app.connect("autodoc-process-docstring", _docstring)
    app.connect("autodoc-process-signature", _signature)
    app.connect("autodoc-process-bases", _bases)
    app.connect("doctree-resolved", _link_names)
    app.connect("doctree-resolved", cost.show)
    app.connect("html-page-context", _ways_back)
    app.connect("missing-reference", _public)
