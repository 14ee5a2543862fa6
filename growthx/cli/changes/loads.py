"""Forces at points, and a history of all loads of a scene, as the command line asks for them."""

from __future__ import annotations

import argparse
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

from growthx.common.errors import InputError

if TYPE_CHECKING:
    from growthx.model.actions.histories import Table
    from growthx.model.scene import Scene


def add_loads(parser: argparse.ArgumentParser) -> None:
    """The options of loads."""
    parser.add_argument(
        "--point-force",
        type=float,
        nargs="+",
        action="append",
        metavar="X",
        help="a force at a point of the body, beside the scene's loads: X Y FX FY or, in space, X Y Z FX FY FZ (in the "
        "plane per thickness); as often as there are such forces",
    )
    parser.add_argument(
        "--history",
        metavar="FILE",
        help="CSV file with the columns time and share, in place of the ramp of all loads, linear between its rows; "
        "two rows of one time are a jump, at which a step ends (the program's ramp)",
    )


def with_loads(scene: Scene, options: argparse.Namespace) -> Scene:
    """The scene with the forces and the history that the options ask for."""
    from growthx.model.actions.concentrated import PointForce
    from growthx.model.actions.histories import Table

    dim = scene.mesh.dim
    forces = []
    for numbers in options.point_force or ():
        if len(numbers) != 2 * dim:
            wanted = "X Y FX FY" if dim == 2 else "X Y Z FX FY FZ"
            raise InputError(f"--point-force has {len(numbers)} numbers: the {2 * dim} of {wanted} would be right")
        forces.append(PointForce(tuple(numbers[:dim]), tuple(numbers[dim:])))
    if forces:
        scene = replace(scene, loads=(*scene.loads, *forces))
    if options.history is None:
        return scene
    table = Table.read(options.history, scene.mesh.comm)
    return replace(
        scene,
        loads=tuple(_following(load, table) for load in scene.loads),
        cases=tuple(replace(case, loads=tuple(_following(load, table) for load in case.loads)) for case in scene.cases),
        supports=tuple(_following(support, table) for support in scene.supports),
    )


def _following(part: Any, table: Table) -> Any:
    """A load or a support by the history; InputError for one that follows none, or one of its own."""
    from growthx.model.actions.rigid import RigidFace

    if isinstance(part, RigidFace):  # moved by what its loads and the body have it
        return part
    if not any(each.name == "history" for each in fields(part)):
        raise InputError(
            f"the {type(part).__name__} {part.place} follows no history: a scene of dead loads and pressures would be "
            "right for --history"
        )
    if part.history is not None:
        raise InputError(
            f"the {type(part).__name__} {part.place} has a history of its own: a scene whose loads follow its ramp "
            "would be right for --history"
        )
    return replace(part, history=table)
