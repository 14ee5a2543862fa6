"""NIfTI files, by nibabel, which is imported when it is needed: on rank 0."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.errors import InputError, raise_on_all

if TYPE_CHECKING:
    from collections.abc import Callable

    from mpi4py import MPI

    from growthx.common.arrays import Floats

MILLIMETRES = {"mm": 1.0, "meter": 1e3, "micron": 1e-3}
SUFFIXES = (".nii", ".nii.gz")


def nibabel(what: str) -> Any:
    """The library; what: is to be done, for the sentence where it is missing."""
    try:
        import nibabel as library
    except ImportError:
        raise InputError(
            f"{what} needs nibabel, which is not installed: Debian's python3-nibabel, or pip install nibabel, would be "
            "right, or gx.ct.from_array(values, affine)"
        ) from None
    return library


def read(path: Path, comm: MPI.Intracomm) -> tuple[Floats, Floats]:
    """Voxels, (i, j, k) or what there is, and the affine in mm, RAS, read on rank 0, on all ranks (collective)."""
    values: Floats = np.empty(0)
    affine: Floats = np.eye(4)
    problem = ""
    if comm.rank == 0:
        try:
            values, affine = _read(path)
        except InputError as error:
            problem = str(error)
    raise_on_all(comm, problem)
    shape, dtype, affine = comm.bcast((values.shape, values.dtype, affine))
    if comm.rank != 0:
        values = np.empty(shape, dtype=dtype)
    values = np.ascontiguousarray(values)
    for plane in values if values.ndim else ():  # at once they may be more than MPI counts
        comm.Bcast(plane.view(np.uint8))
    return values, affine


def _read(path: Path) -> tuple[Floats, Floats]:
    library = nibabel(f"reading the scan {path}")
    try:
        image = library.load(path)
        values = np.asarray(image.dataobj)
        affine = np.asarray(image.affine, dtype=float)
    except FileNotFoundError:
        raise InputError(f"there is no scan {path}: the path of a NIfTI file, .nii or .nii.gz, is right") from None
    except Exception as error:  # of many kinds: a damaged file may fail anywhere
        reason = " ".join(str(error).split())[:120]
        raise InputError(
            f"the scan {path} cannot be read ({reason}): a NIfTI file, .nii or .nii.gz, would be right"
        ) from None
    while values.ndim > 3 and values.shape[-1] == 1:
        values = values[..., 0]
    if values.dtype.kind in "iuf" and values.dtype.byteorder not in "=|":
        values = values.astype(values.dtype.newbyteorder("="))
    units: Callable[[], tuple[str, str]] | None = getattr(image.header, "get_xyzt_units", None)
    scale = MILLIMETRES.get(units()[0], 1.0) if units else 1.0
    return values, np.diag([scale, scale, scale, 1.0]) @ affine


def write(path: Path, values: Floats, affine: Floats, description: str) -> None:
    """Write voxels and their affine, in mm, RAS, to a file, on this rank."""
    library = nibabel(f"writing {path}")
    image = library.Nifti1Image(values, affine)
    image.header.set_xyzt_units("mm")
    image.header["descrip"] = description.encode("ascii", "replace")[:79]
    library.save(image, path)
