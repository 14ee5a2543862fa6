"""The femur on the command line."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from growthx.cli.command import SHAPE, SceneCommand, add_exponents, add_former, add_option, add_trusted
from growthx.common.errors import InputError

if TYPE_CHECKING:
    from growthx.model.scene import Scene
    from growthx.scenes.femur import Femur
    from growthx.stepping.record import Result


COMBINATION = (
    "how the load cases combine: average (forces by daily cycles), superposed (plain sum of the forces) or stimulus (a "
    "displacement for each, growth by the mean of the energies)"
)


def _femur_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--shape", metavar="SHAPE", help=f"{SHAPE} (quadrilateral, or what --mesh has)")
    parser.add_argument("--size", type=float, metavar="MM", help="cell size in mm (that of the paper's 658 cells)")
    parser.add_argument(
        "--mesh",
        metavar="FILE",
        help="own mesh, of any format that growthx reads, of a left or right femur in mm, y proximal, with a boundary "
        "'distal', and 'surface', or 'head' and 'trochanter', or all",
    )
    add_trusted(parser)
    parser.add_argument(
        "--head",
        type=float,
        nargs=3,
        metavar=("X", "Y", "R"),
        help="with --mesh, centre and radius of the head in mm (a circle fitted to 'head' or to what is round of "
        "'surface')",
    )
    parser.add_argument(
        "--trochanter",
        type=float,
        nargs=4,
        metavar=("X", "Y", "X", "Y"),
        help="with --mesh, ends of the abductors' insertion on 'surface' (the boundary 'trochanter', or the lateral "
        "side of the greater trochanter, as found)",
    )
    parser.add_argument(
        "--zones",
        metavar="FILE",
        help="CSV file with the columns zone, x_mm, y_mm: corners of polygons whose mean densities are told (on the "
        "built-in outline its anatomical zones)",
    )
    add_option(parser, "--refine", 1, int, "split every cell uniformly into REFINE x REFINE")
    add_option(parser, "--combination", "average", str, COMBINATION)
    parser.add_argument(
        "--weights",
        type=float,
        nargs=3,
        metavar="W",
        help="weights of midstance of gait, extreme abduction and extreme adduction (those of --combination)",
    )
    add_option(parser, "--thickness", 30.0, float, "thickness of the plane model in mm")
    add_option(parser, "--until", 160.0, float, "end time")
    add_option(parser, "--step", 4.0, float, "time step; the load ramps over five of them")
    add_exponents(parser)
    add_former(parser, cells="shape", loads="combination", dt="step")


def _femur(options: argparse.Namespace) -> Scene:
    from growthx.scenes.femur import combination, femur

    if options.mesh is not None:
        for name in ("size", "shape"):
            if (value := getattr(options, name)) is not None:
                raise InputError(f"--{name} {value} is for the built-in outline: with --mesh, the file has its own")
    loads, ends = combination(options.combination), options.trochanter
    return femur(
        options.mesh,
        trusted=options.trusted,
        head=options.head and tuple(options.head),
        trochanter=ends and (tuple(ends[:2]), tuple(ends[2:])),
        zones=options.zones,
        shape=options.shape or "quadrilateral",
        size=options.size,
        refine=options.refine,
        thickness=options.thickness,
        weights=tuple(options.weights or loads.weights),
        separate=loads.separate,
        n=options.n,
        m=options.m,
        step=options.step,
        until=options.until,
    )


def _read_femur(result: Result) -> Mapping[str, Any]:
    from growthx.post.zones import area_means
    from growthx.scenes.femur import FOREIGN_ZONES, loaded_arcs

    scene = _as_femur(result)
    head, insertion = scene.anatomy.head, scene.anatomy.insertion
    return {
        "zones": area_means(result.problem, scene.zones),
        **({} if scene.zones else {"no_zones": FOREIGN_ZONES}),
        "bone": result.problem.mean_density(),
        "head": asdict(head),
        "insertion": {"length": insertion.length, "on": insertion.on, "how": insertion.how},
        "lean": scene.anatomy.lean,
        "loads": [asdict(arc) for arc in loaded_arcs(scene)],
    }


def _as_femur(result: Result) -> Femur:
    from growthx.scenes.femur import Femur

    assert isinstance(result.scene, Femur)
    return result.scene


def _show_femur(result: Result, readings: Mapping[str, Any]) -> None:
    from growthx.cli import report

    scene = _as_femur(result)
    report.table(
        "where the forces act",
        ("load case", "force", "N", "on", "mm of arc"),
        (
            (arc["case"], arc["force"], f"{arc['newtons']:.1f}", arc["on"], f"{arc['length']:.1f}")
            for arc in readings["loads"]
        ),
        result.problem.comm,
    )
    report.say(result, f"head: {scene.anatomy.head}")
    report.say(result, f"abductors' insertion: {scene.anatomy.insertion}")
    if not scene.anatomy.ours:
        lean = f"{abs(scene.anatomy.lean):.1f}° {'medially' if scene.anatomy.lean > 0 else 'laterally'}"
        report.say(result, f"shaft: leans {lean} from the y axis, from which the forces have their angles")
    title = "mean density of anatomical zones" if scene.zones else "mean density"
    values = {**readings["zones"], "whole bone": readings["bone"]}
    report.numbers(result, title, values, "g/cm³", scene.material.reference_density)
    if not scene.zones:
        report.say(result, f"zones: none are told, since {readings['no_zones']}")


FEMUR = SceneCommand(
    "femur", "the proximal femur under daily loads", _femur_arguments, _femur, _read_femur, _show_femur, "g/cm³"
)
