"""Builds the site: `./run docs`, or `python -m docs.site [FOLDER]` where Sphinx and its kin are installed."""

from __future__ import annotations

import json
import os
import shutil
import sys
from pathlib import Path

from docs.site import links, stage
from docs.site.contents import HERE, ROOT


def main(folder: Path) -> int:
    """Stage and build in a folder; every warning is an error, and so is a link to nowhere. Returns the status."""
    from sphinx.cmd.build import build_main

    source, site = folder / "source", folder / "html"
    for made in (source, site):
        shutil.rmtree(made, ignore_errors=True)
    source.mkdir(parents=True)
    stage.stage(source)
    _name_kernel(folder / "jupyter")
    settings = ["-c", str(HERE), "-d", str(folder / "doctrees"), "-E", "-q", "-n", "-W", "--keep-going"]
    status = build_main([*settings, "-b", "html", str(source), str(site)])
    if status == 0:
        stage.offer(site)
    nowhere = links.broken(site) if status == 0 else []
    for link in nowhere:
        print(f"{link} leads nowhere", file=sys.stderr)
    status = status or bool(nowhere)
    print(f"the site is {site / 'index.html'}" if status == 0 else "the site could not be built: see above")
    return int(status)


def _name_kernel(folder: Path) -> None:
    """Have this Python run the tutorials; that sockets of this machine are not encrypted is no warning of theirs."""
    command = [sys.executable, "-m", "ipykernel_launcher", "--log-level=ERROR", "-f", "{connection_file}"]
    here = folder / "kernels" / "python3"
    here.mkdir(parents=True, exist_ok=True)
    kernel = {"argv": command, "display_name": "Python 3", "language": "python"}
    (here / "kernel.json").write_text(json.dumps(kernel), encoding="utf-8")
    os.environ["JUPYTER_PATH"] = str(folder)


if __name__ == "__main__":
    raise SystemExit(main(Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else ROOT / "build" / "docs"))
