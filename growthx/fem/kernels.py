"""Compiled kernels: weak forms, expressions and C of our own, compiled for this CPU and kept for later runs.

They are kept below ~/.cache/growthx/kernels (or XDG_CACHE_HOME), in a folder for each kind of CPU and each compiler, so
that machines may share the cache and none runs code made for another.  Every kernel has a folder of its own there,
which is filled aside and renamed: a run that is killed, or two that make the same kernel at once, leave no half of one.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import dolfinx
import ffcx.naming
import ufl

from growthx.common.communicators import steady
from growthx.common.errors import InputError
from growthx.fem.compat import let_dolfinx_compile_on_steady_ones

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from mpi4py import MPI

    from growthx.common.arrays import Floats

# Sums may be reordered and divisions become products, but NaN stays NaN: it is how det F ≤ 0 shows.  The macro has the
# C library declare logarithms of whole vectors, which it does for those alone who take all of -ffast-math; these, too,
# are NaN where they should.  FFCx asks for strict C, in which multiplications and additions would not be fused.
FAST = (
    "-O3",
    "-g0",
    "-march=native",
    "-ffp-contract=fast",
    "-fno-math-errno",
    "-funsafe-math-optimizations",
    "-D__FAST_MATH__",
)
PLAIN = ("-O2", "-g0")  # for compilers that refuse these
MATHEMATICS = ("m",)  # the C library's, its vectors included

# What FFCx does on one rank, without a cache that other processes look into while it is filled.
_compile = dolfinx.jit.ffcx_jit.__wrapped__
let_dolfinx_compile_on_steady_ones()


def form(weak_form: ufl.Form) -> dolfinx.fem.Form:
    """The compiled form (collective; the other functions here raise the same).

    Raises InputError if the cache folder cannot be written, or if there is no C compiler that works.
    """
    return dolfinx.fem.form(weak_form, jit_options=_options(steady(weak_form.ufl_domain().ufl_cargo().comm), weak_form))


def expression(value: Any, X: Floats) -> dolfinx.fem.Expression:
    """A compiled UFL expression, to be evaluated at points X of the reference cell, (points, dim) (collective)."""
    comm = steady(ufl.domain.extract_unique_domain(value).ufl_cargo().comm)
    scalar = dolfinx.default_scalar_type
    return dolfinx.fem.Expression(value, X, jit_options=_options(comm, (value, X)), dtype=scalar)


def generated(comm: MPI.Comm, weak_form: ufl.Form) -> tuple[Any, Any]:
    """FFCx's compiled form, and the module it is in (collective)."""
    ufcx_form, module, _ = dolfinx.jit.ffcx_jit(comm, weak_form, _scalar(), _options(comm, weak_form))
    return ufcx_form, module


def library(comm: MPI.Comm, source: str, declarations: str, owner: str, *, libraries: tuple[str, ...] = ()) -> Any:
    """The functions of some C source, as cffi gives them, compiled once for each owner (collective).

    What the source keeps in static variables is kept once for each owner.  libraries: that it is linked with; their
    headers are looked for where compilers and SuiteSparse have them.
    """
    flags = _flags(comm)
    name = f"growthx_{_hash(source, declarations, owner, flags, *libraries)}"
    folder = _keep(comm, name, lambda folder: _build(folder, name, source, declarations, flags, libraries))
    return _loaded(name, folder)


def derived(comm: MPI.Comm, weak_forms: Sequence[ufl.Form], recipe: Recipe) -> Any | None:
    """The functions of C code that is made of FFCx's for some forms; None where none can be (collective).

    A compiler that refuses it need not know vectors: that is no error, and is tried once.
    """
    flags = _flags(comm)
    folders = [_options(comm, weak_form)["cache_dir"] for weak_form in weak_forms]
    name = (
        f"growthx_{_hash([folder.name for folder in folders], recipe.declarations, recipe.frame, flags, MATHEMATICS)}"
    )

    def build(folder: Path) -> None:
        source = recipe.source([next(folder.glob("*.c")).read_text() for folder in folders])
        if source is not None:
            try:
                _build(folder, name, source, recipe.declarations, flags, MATHEMATICS)
            except Exception as error:
                if not _is_refusal(error):
                    raise

    folder = _keep(comm, name, build)
    return _loaded(name, folder) if any(folder.glob(f"{name}.*so")) else None


class Recipe(Protocol):
    """How C code is made of FFCx's."""

    @property
    def declarations(self) -> str:
        """Of its functions, as cffi reads them."""

    @property
    def frame(self) -> str:
        """What tells recipes apart."""

    def source(self, codes: list[str]) -> str | None:
        """C code made of FFCx's for each form; None where it is of a kind that is not known."""


def _build(
    folder: Path, name: str, source: str, declarations: str, flags: Sequence[str], libraries: Sequence[str] = ()
) -> None:
    import cffi

    headers = [f"{root}/include/suitesparse" for root in (sys.prefix, "/usr")] if libraries else []
    ffi = cffi.FFI()
    ffi.cdef(declarations)
    arguments = {"libraries": list(libraries), "include_dirs": headers} if libraries else {}
    ffi.set_source(name, source, extra_compile_args=["-std=c17", *flags], **arguments)
    ffi.compile(tmpdir=str(folder))


def _loaded(name: str, folder: Path) -> Any:
    spec = importlib.util.spec_from_file_location(name, next(folder.glob(f"{name}.*so")))
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.lib


def _options(comm: MPI.Comm, source: Any) -> dict[str, Any]:
    """DOLFINx's options to take a form, or an expression with its points, from where it is kept; compiled by then."""
    flags = _flags(comm)
    name = "form_" + ffcx.naming.compute_signature([source], _hash(flags, sorted(ffcx.get_options().items())))

    def options(folder: Path) -> dict[str, Any]:
        return {"cache_dir": folder, "cffi_extra_compile_args": list(flags)}

    return options(_keep(comm, name, lambda folder: _compile(source, _scalar(), options(folder))))


def _scalar() -> dict[str, Any]:
    """The option that `dolfinx.fem.form` gives to FFCx."""
    return {"scalar_type": dolfinx.default_scalar_type}


# -- where kernels are kept --------------------------------------------------------------------------------------------


def _keep(comm: MPI.Comm, name: str, build: Callable[[Path], Any]) -> Path:
    """The folder of that name among those kept for this CPU; if there is none, `build` fills it (collective)."""
    folder = Path()
    problem: Exception | None = None
    for root in (True, False):  # the others find what rank 0 has made or, on another kind of CPU, make theirs
        if (comm.rank == 0) == root:
            try:
                folder = _make(_home(), name, build)
            except InputError as error:
                problem = error
            except Exception as error:  # not foreseen, but the other ranks must not wait for ever
                problem = RuntimeError(f"compiling failed: {error!r}")
                problem.__cause__ = error
        for other in comm.allgather(problem):
            if other is not None:
                raise other
    return folder


def _make(home: Path, name: str, build: Callable[[Path], Any]) -> Path:
    place = home / name
    if place.is_dir():
        return place
    try:
        home.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix="unfinished_", dir=home, ignore_cleanup_errors=True) as aside:
            built = Path(aside) / name
            built.mkdir()
            build(built)
            try:
                built.rename(place)
            except OSError:  # another process was faster
                if not place.is_dir():
                    raise
    except OSError as error:
        raise InputError(
            f"compiled weak forms cannot be kept in {home} ({error.strerror or error}): the variable XDG_CACHE_HOME "
            "may name another folder for them"
        ) from error
    except Exception as error:
        if not _is_refusal(error):
            raise
        raise InputError(
            f"the C compiler '{shlex.join(_compiler())}' could not compile a weak form in {home} ({error}): one that "
            f"works, and room on the disk, would be right ({shutil.disk_usage(home).free >> 20} MB are free)"
        ) from error
    return place


def _is_refusal(error: Exception) -> bool:
    """Whether it is cffi's, which is not imported for this: the compiler has failed."""
    return type(error).__name__ == "VerificationError"


def _home() -> Path:
    """Where kernels for this CPU, by this compiler, are kept."""
    caches = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    python = sysconfig.get_config_var("SOABI")
    return caches / "growthx" / "kernels" / _hash(_cpu(), _compiler_file(), python, FAST)[:16]


@cache
def _cpu() -> str:
    """What tells the kinds of CPUs, and of C libraries, apart."""
    told = {"vendor_id", "cpu family", "model", "flags", "CPU implementer", "CPU part", "Features", "features", "isa"}
    lines: list[str] = []
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.is_file():
        with cpuinfo.open() as file:
            for line in file:
                if not line.strip() and lines:
                    break  # the others are like the first
                if line.partition(":")[0].strip() in told:
                    lines.append(line)
    # A CPU that does not tell its features shares with no other machine.
    return _hash(platform.machine(), platform.libc_ver(), lines or platform.node())


def _compiler() -> list[str]:
    """The command that compiles C, as setuptools finds it."""
    return shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc")


def _compiler_file() -> tuple[object, ...]:
    """What tells compilers apart without running them."""
    command = _compiler()
    found = shutil.which(command[0])
    if found is None:
        return tuple(command)
    file = Path(found).resolve()
    return (*command[1:], str(file), file.stat().st_size, file.stat().st_mtime_ns)


def _flags(comm: MPI.Comm) -> tuple[str, ...]:
    """The flags to compile with: the fast ones unless the compiler refuses them, which is tried once (collective)."""
    return tuple((_keep(comm, "flags", _try_flags) / "flags").read_text().split())


def _try_flags(folder: Path) -> None:
    source, target = folder / "empty.c", folder / "empty.o"
    source.write_text("int main(void) { return 0; }\n")
    try:
        tried = subprocess.run([*_compiler(), *FAST, "-c", source, "-o", target], capture_output=True, check=False)
    except FileNotFoundError:
        raise InputError(
            f"there is no C compiler '{_compiler()[0]}' to compile weak forms: an installed one in the variable CC "
            "would be right"
        ) from None
    (folder / "flags").write_text(" ".join(FAST if tried.returncode == 0 else PLAIN))


def _hash(*parts: object) -> str:
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:40]
