"""`growthx doctor`: what is there, what is missing, what each lack costs, and how fast the machine is."""

from __future__ import annotations

import argparse
import json
import os
from dataclasses import asdict
from typing import Any

from growthx.cli.command import Command
from growthx.cli.machine import needs, trial
from growthx.cli.machine.ranks import first_rank
from growthx.cli.machine.versions import how_installed, lines


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--no-trial", action="store_true", help="measure no speed: only look")
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout instead of sentences")


def _run(options: argparse.Namespace) -> int:
    found = needs.all_found()
    missing = [one for one in found if one.version is None]
    broken = any(one.need.needed for one in missing)
    speed = None if broken or options.no_trial else trial.measure()
    if first_rank():
        print(json.dumps(_as_object(found, speed)) if options.json else "\n".join(_told(found, speed, broken)))
    return 1 if broken or (speed is not None and not speed.right) else 0


def _as_object(found: list[needs.Found], speed: trial.Speed | None) -> dict[str, Any]:
    return {
        "installed": how_installed(),
        "found": {one.need.package: one.version for one in found},
        "lacks": {one.need.package: one.need.lack for one in found if one.version is None},
        "cores": trial.cores(),
        "speed": speed and {**asdict(speed), "right": speed.right},
    }


def _told(found: list[needs.Found], speed: trial.Speed | None, broken: bool) -> list[str]:
    """Plain lines: what draws tables may be what is missing."""
    width = max(len(one.need.package) for one in found)
    told = [*lines(), ""]
    for one in found:
        mark = "ok     " if one.version else "MISSING" if one.need.needed else "missing"
        reason = one.version or f"{one.need.lack} [{one.why[: needs.SHOWN]}]"
        told.append(f"{mark} {one.need.package:{width}} {reason}")
    threads = os.environ.get("OMP_NUM_THREADS", "as many as BLAS likes")
    told += ["", f"cores: {trial.cores()}; threads of BLAS in each rank: {threads}"]
    if broken:
        return [*told, "growthx cannot run here: what is MISSING above is needed"]
    return [*told, *_speeds(speed), "growthx can run here"] if speed is None or speed.right else told + _speeds(speed)


def _speeds(speed: trial.Speed | None) -> list[str]:
    if speed is None:
        return []
    told = [
        f"BLAS: {speed.gflops:.0f} GFLOPS on a core (known: {trial.BLAS_GFLOPS:.0f})",
        f"trial run: {speed.solve_s:.2f} s (known: {trial.SECONDS:.2f} s on an idle core of a server), "
        f"mass {speed.mass:.8f} (known: {trial.MASS:.8f})",
    ]
    if not speed.right:
        told.append("WRONG: the trial run came out differently; tell us, with all that is printed above")
    if 4 * trial.SLOW * speed.gflops < trial.BLAS_GFLOPS:
        told.append("slow BLAS: install libopenblas0, with which factorisations take a third of the time")
    elif speed.solve_s > trial.SLOW * trial.SECONDS:
        told.append("slow: the machine is busy or slower than the known one; is something else running?")
    return told


DOCTOR = Command(
    "doctor", "what is installed, what is missing, what that costs, and how fast this is", _arguments, _run
)
