"""What growthx uses of a machine, and what is lost where it is not there."""

from __future__ import annotations

import importlib
import os
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

from growthx.cli.machine.versions import version_of


@dataclass(frozen=True)
class Need:
    """A library or a program.

    package: what pip calls it, or the program.  module: what Python imports; empty for a program.
    needed: whether nothing runs without it.  lack: what is lost, and what to install.
    """

    package: str
    module: str
    lack: str
    needed: bool = False


@dataclass(frozen=True)
class Found:
    """What became of a need; version: None where it is missing, and why: the reason of the importer."""

    need: Need
    version: str | None
    why: str = ""


LIBRARIES = (
    Need("fenics-dolfinx", "dolfinx", "nothing can be solved: install DOLFINx 0.9 or newer, or use ./run", needed=True),
    Need("petsc4py", "petsc4py.PETSc", "nothing can be solved: install it with DOLFINx", needed=True),
    Need("mpi4py", "mpi4py.MPI", "nothing can be solved: install it with DOLFINx", needed=True),
    Need("numpy", "numpy", "nothing can be solved: install numpy", needed=True),
    Need("scipy", "scipy", "nothing can be solved: install scipy", needed=True),
    Need("cffi", "cffi", "weak forms cannot be compiled: install cffi", needed=True),
    Need("rich", "rich", "no tables on the terminal, only --json: install rich"),
    Need("gmsh", "gmsh", "no .geo scripts, hence no bar, no femur3d, no stem: install gmsh (conda: python-gmsh)"),
    Need("meshio", "meshio", "no meshes of Nastran, Salome, XDMF and their like: install meshio"),
    Need("h5py", "h5py", "no .med and .xdmf meshes and no --vtkhdf: install h5py"),
    Need("defusedxml", "defusedxml", "no .feb and .vtu meshes: install defusedxml"),
    Need("nibabel", "nibabel", "no CT scans: install growthx[ct]"),
    Need("matplotlib", "matplotlib", "no plots over length and no colour bars: install matplotlib"),
    Need("pyvista", "pyvista", "no pictures and no movies: install growthx[pictures] (Debian: python3-pyvista)"),
)
SHOWN = 120  # characters of a reason
PROGRAMS = (
    Need("mpirun", "", "no parallel runs: install openmpi-bin, or the MPI that mpi4py was built with"),
    Need("Xvfb", "", "no pictures where VTK needs a screen and there is none: install xvfb and xauth"),
)


def found(need: Need) -> Found:
    """Look for a library by importing it, which is what tells that it works, or for a program on the PATH."""
    if not need.module:
        path = shutil.which(need.package)
        return Found(need, path, "" if path else "not on the PATH")
    try:
        importlib.import_module(need.module)
    except Exception as error:  # a library that is there but broken may raise whatever it likes
        return Found(need, None, " ".join(f"{error}".split()))
    return Found(need, version_of(need.package))


def compiler() -> Found:
    """The C compiler that DOLFINx would take."""
    words = (os.environ.get("CC") or "cc").split()
    name = next((word for word in (words[0], "gcc", "cc") if shutil.which(word)), None)
    need = Need("C compiler", "", "no weak form that is not in the cache: install gcc (Debian: gcc libc6-dev)", True)
    return Found(need, name and shutil.which(name), "" if name else f"neither {words[0]} nor gcc is on the PATH")


def cache() -> Found:
    """The folder of compiled forms, which must be writable."""
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    need = Need("cache", "", "weak forms cannot be kept: make it writable, or move it by XDG_CACHE_HOME", True)
    try:
        home.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=home):
            pass
    except OSError as error:
        return Found(need, None, f"{home} ({error.strerror})")
    return Found(need, str(home / "growthx"))


def all_found() -> list[Found]:
    """Everything, in the order of importance."""
    return [*map(found, LIBRARIES), compiler(), cache(), *map(found, PROGRAMS)]
