"""Bone around a stem in the plane on the command line."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from growthx.cli.command import SHAPE, add_exponents, add_option
from growthx.cli.femur import IN_PLANE
from growthx.cli.implants.operation import Operation
from growthx.common.errors import InputError

if TYPE_CHECKING:
    from growthx.meshing.mesh import Mesh
    from growthx.model.scene import Scene


class Stem(Operation):
    """The femur in the plane."""

    name = "stem"
    help = "bone around a press-fit stem in the plane: the femur to equilibrium, then with the stem in it"
    outside = 1.2

    def add(self, parser: argparse.ArgumentParser) -> None:
        """The options of the command."""
        super().add(parser)
        add_option(parser, "--tip", 50.0, float, "height of the stem's tip in mm")
        add_option(parser, "--width", 13.0, float, "of the stem at its tip in mm")
        parser.add_argument("--head-radius", type=float, metavar="R", help="radius of the stem's head in mm (14)")
        add_option(parser, "--size", 3.5, float, "cell size in mm")
        add_option(parser, "--shape", "quadrilateral", str, SHAPE)
        add_option(parser, "--combination", "average", str, IN_PLANE.combination)
        parser.add_argument(
            "--weights",
            type=float,
            nargs=3,
            metavar="W",
            help=f"weights of {IN_PLANE.weights}",
        )
        add_option(parser, "--thickness", 30.0, float, "thickness of the plane model in mm")
        add_option(parser, "--intact", 1000.0, float, "time that the intact femur has to come to equilibrium")
        add_option(parser, "--until", 600.0, float, "end time, from the operation on")
        add_option(parser, "--step", 4.0, float, "time step; of the intact femur the load ramps over five of them")
        add_exponents(parser)

    def mesh(self, options: argparse.Namespace) -> Mesh:
        """The bone with the stem."""
        from growthx.scenes.stem import stem_mesh

        if options.natural and options.head_radius is not None:
            raise InputError(
                f"--head-radius {options.head_radius:g} is of a stem, and with --natural the femur keeps its own: "
                "one of the two would be right"
            )
        return stem_mesh(
            tip=options.tip,
            width=options.width,
            head_radius=_head_radius(options),
            natural=options.natural,
            size=options.size,
            shape=options.shape,
        )

    def femur(self, options: argparse.Namespace, mesh: Mesh) -> Scene:
        """The intact femur."""
        from growthx.scenes.femur import femur
        from growthx.scenes.stem import own_places

        own: dict[str, Any] = {"shape": options.shape, "size": options.size}
        if options.natural:
            own = {"mesh": mesh, **own_places()}
        return femur(**own, **self._common(options), until=options.intact)

    def with_stem(
        self, options: argparse.Namespace, mesh: Mesh, density: Any, femur: Scene, young: float | None
    ) -> Scene:
        """The femur with the stem, metals as many times as stiff as its cortex as they are in truth."""
        from growthx.scenes.anatomy import HEAD_RADIUS
        from growthx.scenes.stem import scaled, stem

        return stem(
            mesh,
            density,
            young=None if young is None else scaled(young, density_exponent=options.n),
            head_radius=HEAD_RADIUS if options.natural else _head_radius(options),
            **self._common(options),
            until=options.until,
        )

    def _common(self, options: argparse.Namespace) -> dict[str, Any]:
        from growthx.scenes.femur import combination

        loads = combination(options.combination)
        return {
            "thickness": options.thickness,
            "weights": tuple(options.weights or loads.weights),
            "separate": loads.separate,
            "n": options.n,
            "m": options.m,
            "step": options.step,
        }


def _head_radius(options: argparse.Namespace) -> float:
    return 14.0 if options.head_radius is None else options.head_radius


STEM = Stem.as_command()
