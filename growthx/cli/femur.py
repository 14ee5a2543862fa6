"""The femur on the command line."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from growthx.cli.command import SHAPE, SceneCommand, add_exponents, add_former, add_option, add_trusted
from growthx.common.errors import InputError

if TYPE_CHECKING:
    from growthx.model.scene import Scene
    from growthx.scenes.femur import Femur
    from growthx.stepping.record import Result


@dataclass(frozen=True)
class BoneOptions:
    """What the options that femora in the plane and in space have in common say in each.

    size: whose cells are taken.  mesh, zones: what they must have.  combination: ways to combine the loads;
    taken: one of these.  weights: of what, and which are taken.  until: end time.  step: Δt.
    ramp: over what the load rises.
    """

    size: str
    mesh: str
    zones: str
    combination: str
    taken: str
    weights: str
    until: float
    step: float
    ramp: str

    def add(self, parser: argparse.ArgumentParser) -> None:
        """Put them into a parser."""
        parser.add_argument("--size", type=float, metavar="MM", help=f"cell size in mm (that of {self.size})")
        parser.add_argument("--mesh", metavar="FILE", help=f"own mesh{self.mesh}")
        add_trusted(parser)
        parser.add_argument("--zones", metavar="FILE", help=f"CSV file with the columns zone, {self.zones}")
        add_option(parser, "--combination", self.taken, str, self.combination)
        parser.add_argument("--weights", type=float, nargs=3, metavar="W", help=f"weights of {self.weights}")
        add_option(parser, "--until", self.until, float, "end time")
        add_option(parser, "--step", self.step, float, f"time step; the load ramps over {self.ramp}")
        add_exponents(parser)
        add_former(parser, loads="combination", dt="step")

    @staticmethod
    def read(options: argparse.Namespace) -> dict[str, Any]:
        """What a scene is told of them."""
        return {name: getattr(options, name) for name in ("size", "zones", "until", "n", "m", "step", "trusted")}


IN_PLANE = BoneOptions(
    size="the paper's 658 cells",
    mesh=", of any format that growthx reads, of a left or right femur in mm, y proximal, with a boundary 'distal', "
    "and 'surface', or 'head' and 'trochanter', or all",
    zones="x_mm, y_mm: corners of polygons whose mean densities are told (on the built-in outline its anatomical "
    "zones)",
    combination="how the load cases combine: average (forces by daily cycles), superposed (plain sum of the forces) or "
    "stimulus (a displacement for each, growth by the mean of the energies)",
    taken="average",
    weights="midstance of gait, extreme abduction and extreme adduction (those of --combination)",
    until=160.0,
    step=4.0,
    ramp="five of them",
)


def _femur_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--shape", metavar="SHAPE", help=f"{SHAPE} (quadrilateral, or what --mesh has)")
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
    add_option(parser, "--refine", 1, int, "split every cell uniformly into REFINE x REFINE")
    add_option(parser, "--thickness", 30.0, float, "thickness of the plane model in mm")
    IN_PLANE.add(parser)
    add_former(parser, cells="shape")


def _femur(options: argparse.Namespace) -> Scene:
    from growthx.scenes.femur import combination, femur

    if options.mesh is not None:
        for name in ("size", "shape"):
            if (value := getattr(options, name)) is not None:
                raise InputError(f"--{name} {value} is for the built-in outline: with --mesh, the file has its own")
    loads, ends = combination(options.combination), options.trochanter
    return femur(
        options.mesh,
        head=options.head and tuple(options.head),
        trochanter=ends and (tuple(ends[:2]), tuple(ends[2:])),
        shape=options.shape or "quadrilateral",
        refine=options.refine,
        thickness=options.thickness,
        weights=tuple(options.weights or loads.weights),
        separate=loads.separate,
        **IN_PLANE.read(options),
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
