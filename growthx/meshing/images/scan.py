"""A scan: voxels in a frame that is named, as NIfTI or as an array has them."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.checks import require_path
from growthx.common.communicators import same_on_all, steady
from growthx.common.errors import InputError, shown
from growthx.common.renamed import renamed
from growthx.common.words import place_in_words
from growthx.meshing.images import nifti
from growthx.meshing.images.density import ScanDensity, Slice
from growthx.meshing.images.relation import Relation
from growthx.meshing.images.voxels import Voxels

if TYPE_CHECKING:
    from growthx.common.arrays import Floats

FRAMES = ("RAS", "LPS")  # x to the right or left, y to the front or back, z up: of NIfTI, and of DICOM and ITK
SINGULAR = 1e-9  # of the product of the axes' lengths: an affine's determinant below has no inverse
_TURN = np.diag([-1.0, -1.0, 1.0, 1.0])  # from one frame to the other


@dataclass(frozen=True, repr=False, eq=False)
class Scan:
    """Values at the centres of voxels, in HU or in whatever unit a calibration takes.

    orientation: the frame in which places are meant, "RAS" or "LPS", as those of the body to be.  name: in sentences.

    Example:
        >>> import numpy as np
        >>> scan = gx.ct.from_array(np.zeros((2, 2, 2)), np.eye(4))
        >>> isinstance(scan, gx.ct.Scan)
        True
    """

    voxels: Voxels
    orientation: str
    name: str

    def __repr__(self) -> str:
        low, high = (place_in_words(end, 4) for end in self.voxels.corners)
        shape = " × ".join(map(str, self.voxels.values.shape))
        size = place_in_words(self.voxels.spacing, 4)
        return f"Scan({self.name}: {shape} voxels of {size}, {low} to {high} {self.orientation})"

    @renamed(exponent="density_exponent")
    def density(
        self,
        *,
        a: float,
        b: float,
        ash: tuple[float, float, float] | None = None,
        floor: float = 0.01,
        by: str = "point",
        density_exponent: float = 2.0,
        largest: float = 5.0,
        z: float | None = None,
        plane: str = "axial",
    ) -> ScanDensity:
        """The apparent density ρ that the scan means, for a scene's fields or to `compare` with.

        a, b: ρ = a + b HU (g/cm³, and per HU), of the calibration.
        ash: (c, d, r), where a + b HU is an equivalent density, ρ_ash = c + d (a + b HU), and r = ρ_ash/ρ.
        floor: what is below it becomes it, as a notice of the logger `growthx` says.
        by: "point" – where a density is, trilinear between the centres of voxels, or at the midpoint of a cell where
        one value per cell is asked for; "mean" – of the HU of each cell; "modulus" – of E ∝ ρⁿ of each cell, mapped
        back, with n the density_exponent.  Means are integrals by a rule of second or third degree in each of as many
        parts of a cell along its edges as the largest has voxels, 6 at most.  A start that is continuous between cells
        is the nearest of its kind to that, in the mean square over what grows, with the same integral.
        largest: a density above it is refused, as HU or other units give them; numpy.inf for none.
        z: of a plane body, the coordinate of its slice along the axis that it does not have.  plane: that of the
        slice: the body's x, y are the scan's x, y ("axial"), x, z ("coronal") or y, z ("sagittal").

        What is asked for outside the voxels' centres is refused, by the error that tells how much it is and where.
        Raises InputError for numbers that cannot be.
        """
        place = None if z is None else Slice(plane, z)
        relation = Relation(a, b, ash, floor, largest)
        return ScanDensity(self.voxels, relation, by=by, density_exponent=density_exponent, place=place, name=self.name)

    def to(self, orientation: str) -> Scan:
        """The same scan in the frame of the body: "RAS" or "LPS"."""
        require_frame(orientation)
        if orientation == self.orientation:
            return self
        return replace(self, voxels=Voxels(self.voxels.values, _TURN @ self.voxels.affine), orientation=orientation)

    def moved(self, matrix: Any) -> Scan:
        """The same scan elsewhere, as where a registration puts it; matrix: (4, 4), from places of it to the body's."""
        return replace(self, voxels=Voxels(self.voxels.values, _affine(matrix, "the matrix") @ self.voxels.affine))


def read(path: str | os.PathLike[str], orientation: str = "RAS", *, comm: MPI.Comm = MPI.COMM_WORLD) -> Scan:
    """A scan from a NIfTI file, .nii or .nii.gz, in mm, read on rank 0 (collective); needs nibabel.

    orientation: the frame in which places are meant, that of the body: "RAS", as in the file, or "LPS".
    Raises InputError, on all ranks, if it cannot be read or is no image of numbers in three dimensions.

    Example:
        >>> problem = gx.discretise(gx.scenes.block(), gx.Q1P0)
        >>> gx.ct.write(problem, "block.nii.gz", spacing=0.5)
        >>> gx.ct.read("block.nii.gz").voxels.values.shape
        (6, 4, 4)
    """
    require_path(path, "the file of a scan")
    require_frame(orientation)
    comm = steady(comm)
    values, affine = nifti.read(Path(path), comm)
    scan = _scan(values, affine, "RAS", f"the scan {Path(path).name}")
    return scan.to(orientation)


def from_array(values: Any, affine: Any, orientation: str = "RAS", *, comm: MPI.Comm = MPI.COMM_WORLD) -> Scan:
    """A scan from an array, the same on all ranks (collective).

    values: shape (i, j, k), in HU or in whatever is calibrated.  affine: (4, 4), from the indices of a voxel to the
    place of its centre.  orientation: the frame of those places, "RAS" or "LPS": that of the body to be, or see `to`.
    Raises InputError for anything else.

    Example:
        >>> import numpy as np
        >>> scan = gx.ct.from_array(np.full((4, 4, 4), 300.0), np.diag([0.5, 0.5, 0.5, 1.0]))
        >>> scan.orientation
        'RAS'
    """
    require_frame(orientation)
    scan = _scan(values, affine, orientation, "the scan")
    if not same_on_all(scan.voxels.values, steady(comm)):
        raise InputError("the values of the scan differ from rank to rank: the same ones on all would be right")
    return scan


def require_frame(orientation: Any) -> None:
    """Refuse what names no frame."""
    if orientation not in FRAMES:
        raise InputError(f"the orientation of the scan is {shown(orientation)}: one of {', '.join(FRAMES)} is right")


def _scan(values: Any, affine: Any, orientation: str, name: str) -> Scan:
    try:
        found = np.asarray(values)
    except ValueError:
        found = np.empty(0, dtype=object)
    if found.dtype.kind not in "iuf":
        raise InputError(f"the voxels of {name} are {shown(values)}: numbers, of shape (i, j, k), would be right")
    if found.ndim != 3 or not found.size:
        raise InputError(
            f"{name} has voxels of shape {found.shape}: one image of three dimensions, (i, j, k), would be right"
        )
    wrong = ~np.isfinite(found) if found.dtype.kind == "f" else np.zeros((), dtype=bool)
    if wrong.any():
        first = np.unravel_index(int(np.argmax(wrong)), found.shape)
        raise InputError(
            f"{int(wrong.sum())} of {found.size} voxels of {name} are no finite numbers, the first at the indices "
            f"{place_in_words(map(float, first))}: numbers in all, as numpy.nan_to_num(values, nan=-1000) gives, are "
            "right"
        )
    return Scan(Voxels(found, _affine(affine, f"the affine of {name}")), orientation, name)


def _affine(matrix: Any, what: str) -> Floats:
    """A matrix that places indices, or places, in space; InputError for one without an inverse."""
    right = "four rows of four numbers, the last (0, 0, 0, 1), would be right"
    try:
        found = np.asarray(matrix, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{what} is {shown(matrix)}: {right}") from None
    if found.shape != (4, 4) or not np.isfinite(found).all() or not np.allclose(found[3], (0, 0, 0, 1)):
        raise InputError(f"{what} is {shown(found.tolist())}: {right}")
    lengths = np.linalg.norm(found[:3, :3], axis=0)
    if abs(np.linalg.det(found[:3, :3])) <= SINGULAR * lengths.prod() or not lengths.all():
        raise InputError(
            f"{what} is singular, with axes of the lengths {place_in_words(lengths, 4)}: three axes in directions of "
            "their own would be right"
        )
    return found
