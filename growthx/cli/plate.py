"""The plates on the command line: the one that scales, and that of Weinans."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from growthx.cli.command import SHAPE, SceneCommand, add_former, add_option

if TYPE_CHECKING:
    from growthx.model.scene import Scene
    from growthx.stepping.record import Result


def _plate_arguments(parser: argparse.ArgumentParser) -> None:
    add_option(parser, "--elements", 64, int, "number of elements over the height, twice as many along it")
    add_option(parser, "--shape", "quadrilateral", str, SHAPE)
    add_option(parser, "--step", 0.1, float, "time step")
    add_option(parser, "--until", 2.5, float, "end time")
    add_former(parser, n="elements", cells="shape")


def _plate(options: argparse.Namespace) -> Scene:
    from growthx.scenes.plate import plate

    return plate(options.elements, shape=options.shape, step=options.step, until=options.until)


def _read_plate(result: Result) -> Mapping[str, Any]:
    from growthx.scenes.plate import tip_displacement

    return {"tip_displacement": tip_displacement(result.problem)}


def _show_plate(result: Result, readings: Mapping[str, Any]) -> None:
    from growthx.cli import report

    report.numbers(result, "plate", {"tip displacement": readings["tip_displacement"]}, "", digits=6)


PLATE = SceneCommand(
    "plate", "a bent plate of any size", _plate_arguments, _plate, _read_plate, _show_plate, by_gmsh=False
)


def _weinans_arguments(parser: argparse.ArgumentParser) -> None:
    add_option(parser, "--elements", 40, int, "number of elements along each side")
    add_option(parser, "--step", 1.0, float, "time step")
    add_option(parser, "--until", 100.0, float, "end time")
    add_former(parser, n="elements", dt="step")


def _weinans(options: argparse.Namespace) -> Scene:
    from growthx.scenes.weinans import weinans_plate

    return weinans_plate(options.elements, step=options.step, until=options.until)


def _read_weinans(result: Result) -> Mapping[str, Any]:
    from growthx.scenes.weinans import shares_at_bounds

    lowest, highest = shares_at_bounds(result.problem)
    mean = result.problem.mean_density()
    return {"mean_density": mean, "share_at_lowest": lowest, "share_at_highest": highest}


def _show_weinans(result: Result, readings: Mapping[str, Any]) -> None:
    from growthx.cli import report

    report.numbers(result, "weinans", {name.replace("_", " "): readings[name] for name in readings}, "", digits=6)


WEINANS = SceneCommand(
    "weinans",
    "the plate of Weinans et al. 1992, not well posed",
    _weinans_arguments,
    _weinans,
    _read_weinans,
    _show_weinans,
    by_gmsh=False,
)
