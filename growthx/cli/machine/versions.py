"""What is installed, how, and in which versions: `growthx --version`.  Looks, and imports no library to do so."""

from __future__ import annotations

import argparse
import json
import platform
from importlib import metadata, util
from typing import Any

TOLD = ("fenics-dolfinx", "petsc4py", "gmsh")


class VersionAction(argparse.Action):
    """The option --version: prints versions on rank 0 and ends."""

    def __init__(self, option_strings: list[str], dest: str, **_: Any) -> None:
        super().__init__(option_strings, dest, nargs=0, help="versions of growthx and its libraries, and exit")

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        """Print, and end with status 0."""
        from growthx.cli.machine.ranks import first_rank

        if first_rank():
            print("\n".join(lines()))
        parser.exit()


def lines() -> list[str]:
    """What --version prints."""
    from growthx.common.installed import __version__

    found = [f"{_NAMES[name]} {version_of(name) or 'missing'}" for name in TOLD]
    return [f"growthx {__version__}", f"{', '.join(found)}, Python {platform.python_version()}", how_installed()]


_NAMES = {"fenics-dolfinx": "DOLFINx", "petsc4py": "PETSc", "gmsh": "gmsh"}
_MODULES = {"fenics-dolfinx": "dolfinx"}  # whose name is not the package's


def version_of(package: str) -> str | None:
    """Version of a package, None where it is not there, "unknown" where it does not say."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        module = _MODULES.get(package, package)
        return "unknown" if util.find_spec(module) else None


def how_installed() -> str:
    """A checkout, an editable or a whole installation, and where."""
    from growthx.common.installed import PACKAGE as folder

    if (folder.parent / "pyproject.toml").is_file():
        return f"used from the checkout {folder.parent}"
    try:
        installed = metadata.distribution("growthx")
    except metadata.PackageNotFoundError:
        return f"found at {folder}, of no installed package"
    by = (installed.read_text("INSTALLER") or "an unknown installer").strip()
    source = json.loads(installed.read_text("direct_url.json") or "{}")
    editable = source.get("dir_info", {}).get("editable", False)
    return f"installed by {by}{' as editable' if editable else ''} at {folder}"
