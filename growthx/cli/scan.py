"""A scan to begin with and to compare with, as options of every scene's command."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from growthx.common.errors import InputError

if TYPE_CHECKING:
    from growthx.meshing.images.density import ScanDensity
    from growthx.meshing.mesh import Mesh
    from growthx.stepping.record import Result

READING = "ct"  # the key of its numbers
DEFAULTS: dict[str, Any] = {"ct_by": "point", "ct_floor": 0.01, "ct_frame": "RAS"}


def add_scan(parser: argparse.ArgumentParser) -> None:
    """The options of a scan."""
    parser.add_argument(
        "--ct",
        metavar="FILE",
        help="begin with the density of a CT scan, NIfTI in the coordinates of the mesh, and tell at the end how the "
        "density differs from it",
    )
    parser.add_argument(
        "--hu",
        type=_pair,
        metavar="A,B",
        help="with --ct, its calibration: ρ = A + B HU (where A is negative: --hu=A,B)",
    )
    parser.add_argument(
        "--ct-slice",
        nargs=2,
        metavar=("PLANE", "AT"),
        help="with --ct and a plane mesh, whose x, y are the scan's x, y (axial), x, z (coronal) or y, z (sagittal): "
        "the plane, and the scan's third coordinate there",
    )
    parser.add_argument("--ct-by", metavar="WAY", help="with --ct: point, mean (of HU) or modulus (of E) (point)")
    parser.add_argument("--ct-floor", type=float, metavar="RHO", help="with --ct, the lowest density (0.01)")
    parser.add_argument(
        "--ct-frame", metavar="FRAME", help="with --ct, that of the mesh's coordinates: RAS, as in NIfTI, or LPS (RAS)"
    )


def _pair(text: str) -> tuple[float, float]:
    """Two numbers with a comma between them."""
    try:
        a, b = map(float, text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no calibration: A,B, as 0.05,0.0008, would be right") from None
    return a, b


def check(options: argparse.Namespace) -> None:
    """Refuse options that do without each other."""
    if options.ct is not None:
        if options.hu is None:
            raise InputError(f"--ct {options.ct} has HU: --hu A,B, as ρ = A + B HU, would be right beside it")
        return
    for name in ("hu", "ct_slice", *DEFAULTS):
        if getattr(options, name) is not None:
            raise InputError(f"--{name.replace('_', '-')} is of a scan, and there is none: --ct FILE would be right")


def density(options: argparse.Namespace, mesh: Mesh) -> ScanDensity | None:
    """What the options say, if they name a scan (collective)."""
    if options.ct is None:
        return None
    from growthx.meshing.images.scan import read

    given = {name: getattr(options, name) for name in DEFAULTS}
    by, floor, frame = (DEFAULTS[name] if value is None else value for name, value in given.items())
    place: dict[str, Any] = {}
    if options.ct_slice is not None:
        plane, at = options.ct_slice
        try:
            place = {"plane": plane, "z": float(at)}
        except ValueError:
            raise InputError(f"--ct-slice {plane} {at} is at no number: PLANE AT would be right") from None
    a, b = options.hu
    found = read(options.ct, frame, comm=mesh.comm).density(a=a, b=b, by=by, floor=floor, **place)
    found.check_dimension(mesh.dim)
    return found


def read(result: Result, scanned: ScanDensity | None) -> Mapping[str, Any]:
    """How the density at the end differs from the scan's (collective)."""
    if scanned is None:
        return {}
    from growthx.post.comparing.comparison import compare

    zones = dict(getattr(result.scene, "zones", {}))  # those that the scene tells the densities of
    return {READING: asdict(compare(result, scanned, zones=zones))}


def show(result: Result, readings: Mapping[str, Any]) -> None:
    """The same for people."""
    from growthx.cli import report

    if (found := readings.get(READING)) is None:
        return
    r = "none, as one of them is the same everywhere" if found["pearson"] is None else f"{found['pearson']:.4f}"
    report.say(
        result,
        f"compared with the scan: Pearson's r {r}, RMSE {found['rmse']:.4f}, bias {found['bias']:+.4f} (mean "
        f"{found['mean']:.4f}, of the scan {found['other']:.4f})",
    )
