"""Bone around a stem in space on the command line."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from growthx.cli.command import add_exponents, add_option
from growthx.cli.femur3d import COMBINATIONS, IN_SPACE, SHAPE
from growthx.cli.implants.operation import Operation
from growthx.common.errors import InputError

if TYPE_CHECKING:
    from growthx.meshing.mesh import Mesh
    from growthx.model.scene import Scene

STEM = {
    "tip": "height of the stem's tip below the head's centre in mm",
    "width": "of the stem at its tip in mm",
    "flare": "width of the stem at the neck, in widths at its tip",
    "resection": "where the neck is cut, in lengths of the neck from the head's centre",
    "stem_head": "radius of the stem's head in mm",
}


class Stem3d(Operation):
    """The femur in space, which grows in the cells that it has with the stem."""

    name = "stem3d"
    help = "bone around a press-fit stem in space: the femur to equilibrium, then with the stem in it"
    outside = 0.8
    in_space = True

    def add(self, parser: argparse.ArgumentParser) -> None:
        """The options of the command."""
        super().add(parser)
        parser.add_argument("--left", action="store_true", help="a left femur instead of a right one")
        for name, text in {**STEM, **SHAPE}.items():
            parser.add_argument(
                f"--{name.replace('_', '-')}", type=float, metavar="X", help=f"{text} (that of the script)"
            )
        add_option(parser, "--body-weight", 735.75, float, "of which the forces are shares, in N")
        add_option(parser, "--size", 6.0, float, "cell size in mm")
        add_option(parser, "--combination", IN_SPACE.taken, str, IN_SPACE.combination)
        parser.add_argument("--weights", type=float, nargs=3, metavar="W", help=f"weights of {IN_SPACE.weights}")
        add_option(parser, "--intact", 200.0, float, "time that the intact femur has to come to equilibrium")
        add_option(parser, "--until", 200.0, float, "end time, from the operation on")
        add_option(
            parser, "--step", IN_SPACE.step, float, "time step; of the intact femur the load ramps over the first"
        )
        add_exponents(parser)

    def check(self, options: argparse.Namespace) -> None:
        """The same, and the loads, and lengths of a stem and of a femur that are not there together."""
        from growthx.scenes.femur3d import ACTIVITIES, plan

        super().check(options)
        if options.combination not in COMBINATIONS:
            raise InputError(
                f"there is no load combination '{options.combination}' in space: one of {', '.join(COMBINATIONS)} "
                "would be right"
            )
        day = self._day(options)
        plan(activities=ACTIVITIES, **day, until=options.intact)
        plan(activities=ACTIVITIES, **day, until=options.until)
        if options.natural and options.stem_head is not None:
            raise InputError(
                f"--stem-head {options.stem_head:g} is of a stem, and with --natural the femur keeps its own: one of "
                "the two would be right"
            )

    def mesh(self, options: argparse.Namespace) -> Mesh:
        """The bone with the stem."""
        return self._mesh(options, natural=options.natural)

    def femur(self, options: argparse.Namespace, mesh: Mesh) -> Scene:
        """The intact femur, in the same cells."""
        from growthx.scenes.femur3d import femur3d

        whole = mesh if options.natural else self._mesh(options, natural=True)
        return femur3d(whole, **self._day(options), until=options.intact)

    @staticmethod
    def _day(options: argparse.Namespace) -> dict[str, Any]:
        """What the femur bears, of what, by which steps."""
        from growthx.scenes.femur3d import DAILY

        return {
            "body_weight": options.body_weight,
            "weights": tuple(options.weights or DAILY),
            "separate": COMBINATIONS[options.combination],
            "n": options.n,
            "m": options.m,
            "step": options.step,
        }

    def with_stem(
        self, options: argparse.Namespace, mesh: Mesh, density: Any, femur: Scene, young: float | None
    ) -> Scene:
        """The femur with the stem, whose metal has its own stiffness."""
        from growthx.scenes.femur3d import Femur3d
        from growthx.scenes.stem3d import stem3d

        assert isinstance(femur, Femur3d)
        return stem3d(femur, mesh, density, young=young, until=options.until)

    @staticmethod
    def _mesh(options: argparse.Namespace, natural: bool) -> Mesh:
        from growthx.scenes.stem3d import stem3d_mesh

        shape = {name: value for name in (*STEM, *SHAPE) if (value := getattr(options, name)) is not None}
        return stem3d_mesh(left=options.left, natural=natural, size=options.size, **shape)


STEM3D = Stem3d.as_command()
