"""The bar on the command line."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from growthx.cli.command import SHAPE, SceneCommand, add_exponents, add_former, add_option

if TYPE_CHECKING:
    from growthx.model.scene import Scene
    from growthx.stepping.record import Result


def _bar_arguments(parser: argparse.ArgumentParser) -> None:
    add_option(parser, "--kind", "discontinuous", str, "discontinuous (stepped stimulus) or continuous (tapered bar)")
    add_option(parser, "--elements", 40, int, "number of elements along the bar; the paper takes 10, 40 and 100")
    add_option(parser, "--shape", "quadrilateral", str, SHAPE)
    add_option(parser, "--step", 0.1, float, "time step")
    add_option(parser, "--until", 6.0, float, "end time")
    add_exponents(parser)
    add_former(parser, problem="kind", cells="shape", dt="step")


def _bar(options: argparse.Namespace) -> Scene:
    from growthx.scenes.bar import bar

    kept = {name: getattr(options, name) for name in ("shape", "n", "m", "step", "until")}
    return bar(options.kind, options.elements, **kept)


def _read_bar(result: Result) -> Mapping[str, Any]:
    from growthx.scenes.bar import end_displacement, midpoint_axis_density_change, midpoint_density_change

    return {
        "midpoint_density_change": midpoint_density_change(result.problem),
        "midpoint_axis_density_change": midpoint_axis_density_change(result.problem),
        "end_displacement": end_displacement(result.problem),
    }


def _show_bar(result: Result, readings: Mapping[str, Any]) -> None:
    from growthx.cli import report

    names = ("midpoint_density_change", "midpoint_axis_density_change", "end_displacement")
    values = {name.replace("_", " "): readings[name] for name in names}
    report.numbers(result, "bar", values, "", digits=6)  # as many as the paper prints


def _plot_bar(result: Result, path: str, relative: bool) -> None:
    """The density along the lower edge, where the paper reads it."""
    from growthx.post import plots
    from growthx.scenes.bar import PROBLEMS, lower_edge

    (problem,) = (each for each in PROBLEMS.values() if result.scene.name == f"bar, {each.name}")
    plots.along_length({result.variant.name: result.problem}, path, lower_edge(problem), relative=relative)


BAR = SceneCommand("bar", "the paper's bar in tension", _bar_arguments, _bar, _read_bar, _show_bar, graph=_plot_bar)
