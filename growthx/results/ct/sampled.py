"""The density of a run sampled at the centres of voxels, as NIfTI for other programs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.checks import is_whole, require_number
from growthx.common.errors import InputError, OutputError, raise_on_all, shown
from growthx.common.renamed import renamed
from growthx.discretisation.checks.arguments import require_problem
from growthx.meshing.images import nifti
from growthx.meshing.images.scan import require_frame

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation

MOST_VOXELS = 500_000_000
AT_ONCE = 200_000  # voxels sampled together
ROUND_OFF = 1e-9
_TO_RAS = {"RAS": np.eye(4), "LPS": np.diag([-1.0, -1.0, 1.0, 1.0])}


@renamed(margin="padding")
def write(
    result: Any,
    path: str | os.PathLike[str],
    *,
    spacing: float | tuple[float, ...],
    outside: float = 0.0,
    padding: int = 1,
    orientation: str = "RAS",
) -> None:
    """Write the density that a run has ended with as a NIfTI image in single precision (collective); needs nibabel.

    result: of a run, or a discretised scene.  path: a new file, .nii or .nii.gz.
    spacing: of voxels (mm), one number or one for each of three directions.  Voxels fill the body's box, at rest, and
    `padding` more on each side; those whose centres lie outside the body have the value `outside`, 0 or numpy.nan.
    A plane body is one layer of voxels at z = 0.
    orientation: the frame of the body's coordinates, "RAS" or "LPS".
    Raises InputError for anything else or a file that is there, OutputError if it cannot be written.

    Example:
        >>> scene = gx.scenes.plate(2)
        >>> gx.ct.write(gx.discretise(scene, gx.Q1P0), "plate.nii.gz", spacing=0.25)
        >>> gx.ct.read("plate.nii.gz").voxels.values.shape
        (10, 6, 1)
    """
    problem = require_problem(result)
    _check(outside, padding, orientation)
    steps = _spacing(spacing)
    target = _new_file(path, problem.comm)
    first, counts = _grid(problem, steps, padding)
    values = _sampled(problem, first, steps, counts, outside)
    trouble = ""
    if problem.comm.rank == 0:
        affine = np.diag([*steps, 1.0])
        affine[:3, 3] = first
        trouble = _written(target, values, _TO_RAS[orientation] @ affine)
    raise_on_all(problem.comm, trouble, OutputError)


def _check(outside: Any, padding: Any, orientation: Any) -> None:
    if not (isinstance(outside, float) and np.isnan(outside)):
        require_number(outside, "the value outside the body", "a number or numpy.nan", lambda _: True)
    if not is_whole(padding, 0, 100):
        raise InputError(f"the padding is {shown(padding)}: a whole number of voxels, from 0 to 100, would be right")
    require_frame(orientation)


def _spacing(spacing: Any) -> Floats:
    several = spacing if isinstance(spacing, (tuple, list, np.ndarray)) else (spacing,) * 3
    if len(several) != 3:
        raise InputError(f"the spacing of voxels is {shown(spacing)}: one number, or three, would be right")
    for value in several:
        require_number(value, "the spacing of voxels (mm)", "a positive number", lambda h: h > 0)
    return np.array(several, dtype=float)


def _new_file(path: Any, comm: MPI.Intracomm) -> Path:
    from growthx.common.checks import require_path

    require_path(path, "the file of an image")
    file, trouble = Path(path), ""
    if comm.rank == 0:
        if not file.name.endswith(nifti.SUFFIXES):
            trouble = f"the image {file} has another suffix than {' or '.join(nifti.SUFFIXES)}: one of them is right"
        elif not file.parent.is_dir():
            trouble = f"the image {file} is to be in a folder that is not there: one that is there would be right"
        elif file.exists():
            trouble = f"the image {file} is there already: a new name would keep it"
        else:
            try:
                nifti.nibabel(f"writing {file}")
            except InputError as error:
                trouble = str(error)
    raise_on_all(comm, trouble)
    return file


def _grid(problem: Discretisation, steps: Floats, padding: int) -> tuple[Floats, Floats]:
    """Centre of the first voxel, (3,), and how many there are in each direction; those of a plane body in one layer."""
    x = problem.scene.mesh.domain.geometry.x
    comm, dim = problem.comm, problem.scene.mesh.dim
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    comm.Allreduce(np.ascontiguousarray(x.min(axis=0, initial=np.inf)), low, MPI.MIN)
    comm.Allreduce(np.ascontiguousarray(x.max(axis=0, initial=-np.inf)), high, MPI.MAX)
    counts = np.ceil((high - low) / steps * (1 - ROUND_OFF)).clip(1) + 2 * padding
    counts[dim:] = 1
    if counts.prod() > MOST_VOXELS:
        raise InputError(
            f"voxels of {steps.min():g} mm are {counts.prod():.3g} over the body: a spacing for at most "
            f"{MOST_VOXELS:.0e} would be right"
        )
    return (low + high) / 2 - (counts - 1) / 2 * steps, counts.astype(int)


def _sampled(problem: Discretisation, first: Floats, steps: Floats, counts: Floats, outside: float) -> Floats:
    """The density at all centres, (i, j, k), on all ranks."""
    dim, total = problem.scene.mesh.dim, int(counts.prod())
    values = np.empty(total, dtype=np.float32)
    for start in range(0, total, AT_ONCE):
        numbers = np.arange(start, min(start + AT_ONCE, total))
        indices = np.column_stack(np.unravel_index(numbers, counts))
        found = problem.sample_density((first + indices * steps)[:, :dim])
        values[numbers] = np.where(np.isnan(found), outside, found)
    return values.reshape(counts)


def _written(target: Path, values: Floats, affine: Floats) -> str:
    """Write beside, then give it its name, over none that is there; what went wrong, as a sentence."""
    suffix = next(end for end in nifti.SUFFIXES[::-1] if target.name.endswith(end))
    hidden = target.with_name(f".{target.name[: -len(suffix)]}.growthx-unfinished{suffix}")
    try:
        nifti.write(hidden, values, affine, "density of growthx, g/cm3")
        os.link(hidden, target)
    except OSError as error:
        reason = error.strerror or str(error)
        return f"the image {target} cannot be written ({reason}): a new file in a folder with room would be right"
    finally:
        hidden.unlink(missing_ok=True)
    return ""
