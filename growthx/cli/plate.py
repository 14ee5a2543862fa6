"""The plate on the command line."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from growthx.cli.command import CELLS, SceneCommand, add_option

if TYPE_CHECKING:
    from growthx.model.scene import Scene
    from growthx.stepping.record import Result


def _plate_arguments(parser: argparse.ArgumentParser) -> None:
    add_option(parser, "--n", 64, int, "number of cells over the height; 2N x N in all")
    add_option(parser, "--cells", "quadrilateral", str, CELLS)


def _plate(options: argparse.Namespace) -> Scene:
    from growthx.scenes.plate import plate

    return plate(options.n, shape=options.cells)


def _read_plate(result: Result) -> Mapping[str, Any]:
    from growthx.scenes.plate import tip_displacement

    return {"tip_displacement": tip_displacement(result.problem)}


def _show_plate(result: Result, readings: Mapping[str, Any]) -> None:
    from growthx.cli import report

    report.numbers(result, "plate", {"tip displacement": readings["tip_displacement"]}, "", digits=6)


PLATE = SceneCommand(
    "plate", "a bent plate of any size", _plate_arguments, _plate, _read_plate, _show_plate, "", by_gmsh=False
)
