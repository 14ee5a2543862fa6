"""What each tutorial took, time and memory, measured when the site is made and told at its head and in one table."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes

from docs.site import contents

# The last cell of a tutorial as it is staged; readers see neither it nor its output. What Linux counts for a process
# by getrusage may be that of the one it was started from.
CELL = """\
import resource
from pathlib import Path

_status = Path("/proc/self/status")
_told = _status.read_text() if _status.exists() else f"VmHWM: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss} kB"
print("peak memory", next(line.split()[1] for line in _told.splitlines() if line.startswith("VmHWM")), "kB")
"""
TELLS = re.compile(r"peak memory (\d+) kB")
TABLE = "tutorials"  # the page with the table, in place of its paragraph "COSTS"


def sentence(seconds: float, megabytes: float) -> str:
    """What a tutorial's page says below its title."""
    return f"This page took {seconds:.0f} s and {megabytes:.0f} MB when the site was made, on one core."


def show(app: Any, tree: nodes.document, page: str) -> None:
    """Tell what a tutorial took; of all of them on their common page (for Sphinx's `doctree-resolved`)."""
    if page.startswith("tutorials/"):
        _take_out(tree)
        title = next(tree.findall(nodes.title))
        seconds, megabytes = _cost(app.env, page)
        told = nodes.paragraph("", "", nodes.emphasis("", sentence(seconds, megabytes)))
        title.parent.insert(title.parent.index(title) + 1, told)
    elif page == TABLE:
        place = next(each for each in tree.findall(nodes.paragraph) if each.astext() == "COSTS")
        place.replace_self(_table(app, page))


def _cost(env: Any, page: str) -> tuple[float, float]:
    """Seconds, of all cells, and MB, the most that the process had."""
    found = _last_output(env.get_doctree(page))
    measured = found and TELLS.search(found.astext())
    run = env.nb_metadata[page]["exec_data"]["runtime"]
    if not measured or run is None:
        raise RuntimeError(f"{page} does not tell its time and memory: it has not run to its end")
    return float(run), int(measured[1]) / 1000


def _last_output(tree: nodes.document) -> nodes.Element | None:
    return next((each for each in tree.findall(nodes.container) if _is_measure(each)), None)


def _is_measure(cell: nodes.container) -> bool:
    return "cell" in cell["classes"] and bool(TELLS.fullmatch(cell.astext().strip()))


def _take_out(tree: nodes.document) -> None:
    cell = _last_output(tree)
    if cell is not None:
        cell.parent.remove(cell)


def _table(app: Any, page: str) -> nodes.table:
    rows = [("tutorial", "time (s)", "memory (MB)")]
    for name in contents.TUTORIALS:
        seconds, megabytes = _cost(app.env, f"tutorials/{name}")
        rows.append((name, f"{seconds:.0f}", f"{megabytes:.0f}"))
    group = nodes.tgroup("", *(nodes.colspec(colwidth=1) for _ in rows[0]), cols=len(rows[0]))
    head, body = nodes.thead(), nodes.tbody()
    for at, row in enumerate(rows):
        cells = [nodes.entry("", _content(app, page, text, linked=at > 0 and not k)) for k, text in enumerate(row)]
        (body if at else head).append(nodes.row("", *cells))
    group += [head, body]
    return nodes.table("", group)


def _content(app: Any, page: str, text: str, *, linked: bool) -> nodes.paragraph:
    if not linked:
        return nodes.paragraph("", text)
    there = f"tutorials/{text}"
    address = app.builder.get_relative_uri(page, there)
    title = app.env.titles[there].astext()
    return nodes.paragraph("", "", nodes.reference("", title, internal=True, refuri=address))
