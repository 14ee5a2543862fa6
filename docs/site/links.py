"""Links of a site that is built, checked without a network."""

from __future__ import annotations

import html
import os
import re
from functools import cache
from pathlib import Path
from urllib.parse import unquote

FOREIGN = re.compile(r"[a-z]+:|//")


def broken(site: Path) -> list[str]:
    """Links to pages, pictures and anchors that are not there, each as 'PAGE: LINK'; other hosts are not asked."""
    pages = [path for path in sorted(site.rglob("*.html")) if "_static" not in path.relative_to(site).parts]
    return [
        f"{page.relative_to(site)}: {link}"
        for page in pages
        for link in sorted(set(re.findall(r'(?:href|src)="([^"]+)"', page.read_text(encoding="utf-8"))))
        if not FOREIGN.match(link) and not _leads(page, html.unescape(link))
    ]


def _leads(page: Path, link: str) -> bool:
    target, _, anchor = link.partition("#")
    path = unquote(target.partition("?")[0])
    file = Path(os.path.normpath(page.parent / path)) if path else page
    if file.suffix != ".html" or not anchor:
        return file.is_file()
    return file.is_file() and unquote(anchor) in _anchors(file)


@cache
def _anchors(page: Path) -> frozenset[str]:
    return frozenset(re.findall(r'\b(?:id|name)="([^"]+)"', page.read_text(encoding="utf-8")))
