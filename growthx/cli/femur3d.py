"""The femur in space on the command line."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from growthx.cli.command import SceneCommand, add_former, add_option
from growthx.cli.femur import BoneOptions
from growthx.common.errors import InputError

if TYPE_CHECKING:
    from growthx.model.scene import Scene
    from growthx.scenes.femur3d import Femur3d
    from growthx.stepping.record import Result

COMBINATIONS = {"stimulus": True, "average": False}  # whether each activity has a displacement of its own
SHAPE = {
    "head_radius": "radius of the head in mm",
    "neck_shaft_angle": "angle between neck and shaft in degrees",
    "anteversion": "of the neck in degrees",
    "offset": "of the head's centre from the shaft's axis in mm",
    "neck_width": "of the neck, front to back, in mm",
    "neck_height": "of the neck at its narrowest in mm",
    "shaft_width": "of the shaft, side to side, in mm",
    "shaft_depth": "of the shaft, front to back, in mm",
    "lean": "of the shaft, down and medially, in degrees",
    "bow": "radius of the shaft's bow, forward, in mm",
    "cut": "of the shaft, below the head's centre, in mm",
}


IN_SPACE = BoneOptions(
    size="meshes/femur3d.geo",
    mesh=" in space, of any format that growthx reads, of a left or right femur in mm, z superior and y anterior, with "
    "the boundaries 'head', 'trochanter' and 'distal'",
    zones="x_mm, y_mm, z_mm: corners of convex bodies whose mean densities are told (anatomical zones, laid by the "
    "landmarks of the mesh)",
    combination="how the activities combine: stimulus (a displacement for each, growth by the mean of the energies) or "
    "average (one displacement, of the forces by daily cycles)",
    taken="stimulus",
    weights="walking, one-legged stance and standing up; 0 leaves one out (0.75 0.2 0.05)",
    until=20.0,
    step=1.0,
    ramp="the first",
)


def _femur3d_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--left", action="store_true", help="a left femur instead of a right one")
    for name, text in SHAPE.items():
        parser.add_argument(f"--{name.replace('_', '-')}", type=float, metavar="X", help=f"{text} (that of the script)")
    add_option(parser, "--body-weight", 735.75, float, "of which the forces are shares, in N")
    IN_SPACE.add(parser)
    add_former(parser, version="anteversion")


def _femur3d(options: argparse.Namespace) -> Scene:
    from growthx.scenes.femur3d import DAILY, femur3d

    if options.combination not in COMBINATIONS:
        raise InputError(
            f"there is no load combination '{options.combination}' in space: one of {', '.join(COMBINATIONS)} would be "
            "right"
        )
    shape = {name: value for name in SHAPE if (value := getattr(options, name)) is not None}
    return femur3d(
        options.mesh,
        left=options.left,
        body_weight=options.body_weight,
        weights=tuple(options.weights or DAILY),
        separate=COMBINATIONS[options.combination],
        **IN_SPACE.read(options),
        **shape,
    )


def _read_femur3d(result: Result) -> Mapping[str, Any]:
    from growthx.post.zones import area_means
    from growthx.scenes.femur3d import loaded_areas

    scene = _as_femur3d(result)
    bone = scene.anatomy
    return {
        "zones": area_means(result.problem, scene.zones),
        "bone": result.problem.mean_density(),
        "head": {"centre": list(map(float, bone.centre)), "radius": bone.radius, "misfit": bone.misfit},
        "side": "right" if bone.lateral > 0 else "left",
        "crossing": list(map(float, bone.crossing)),
        "neck_shaft_angle": bone.neck_shaft_angle,
        "version": bone.version,
        "body_weight": scene.body_weight,
        "loads": [asdict(area) for area in loaded_areas(scene)],
    }


def _as_femur3d(result: Result) -> Femur3d:
    from growthx.scenes.femur3d import Femur3d

    assert isinstance(result.scene, Femur3d)
    return result.scene


def _show_femur3d(result: Result, readings: Mapping[str, Any]) -> None:
    from growthx.cli import report

    scene = _as_femur3d(result)
    report.table(
        f"where the forces act, of a body weight of {scene.body_weight:g} N",
        ("activity", "force", "N", "on", "mm²"),
        (
            (area["case"], area["force"], f"{area['newtons']:.0f}", area["on"], f"{area['area']:.0f}")
            for area in readings["loads"]
        ),
        result.problem.comm,
    )
    report.say(result, f"bone: {scene.anatomy}")
    values = {**readings["zones"], "whole bone": readings["bone"]}
    report.numbers(result, "mean density of anatomical zones", values, "g/cm³", scene.material.reference_density)


FEMUR3D = SceneCommand(
    "femur3d",
    "the proximal femur in space, under daily loads",
    _femur3d_arguments,
    _femur3d,
    _read_femur3d,
    _show_femur3d,
    drawn_in="g/cm³",
    in_space=True,
)
