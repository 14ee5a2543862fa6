"""A femur that is grown to equilibrium and goes on with a stem: what the commands in the plane and in space share."""

from __future__ import annotations

import argparse
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

from growthx.cli.command import Command, SceneCommand
from growthx.cli.scene_run import adapted, arguments, check_kept, run, stepping_of
from growthx.common.errors import InputError

if TYPE_CHECKING:
    from growthx.meshing.mesh import Mesh
    from growthx.model.scene import Scene
    from growthx.post.comparing.shielding import Shielding
    from growthx.stepping.record import Result

BONE = "bone"  # the material of a stem that is none
ENOUGH = 1e-3  # share of equilibrium at which the intact femur is taken for grown


class Operation(ABC):
    """One run of a command with a stem; between its beginning and its end it keeps the intact femur."""

    name: str
    help: str
    outside: float  # density of what was no bone, in parts that do not grow
    in_space = False

    def __init__(self) -> None:
        self._intact: Result | None = None
        self._young: float | None = None
        self._difference: str | None = None
        self._zones: dict[str, Shielding] = {}

    @classmethod
    def as_command(cls) -> Command:
        """The command, each run of which has an operation of its own."""
        return Command(cls.name, cls.help, lambda parser: arguments(cls()._scene(), parser), cls.run)

    @classmethod
    def run(cls, options: argparse.Namespace) -> int:
        """Do what the options ask for, on all ranks; returns the exit status."""
        return run(cls()._scene(), options)

    def _scene(self) -> SceneCommand:
        return SceneCommand(
            self.name, self.help, self.add, self.build, self.read, self.show, "g/cm³", in_space=self.in_space
        )

    def check(self, options: argparse.Namespace) -> None:
        """Refuse what no mesh would make right: none is made for it.  Each command adds what is its own."""
        if options.ct is not None:
            raise InputError(
                f"--ct {options.ct} is a density to begin with, and bone around a stem begins with that of the intact "
                "femur: the command of the femur without a stem would be right"
            )
        if options.exponents is not None:
            raise InputError(
                "--exponents is of bone alone, and n tells by which cortex a stem is scaled and how stiff one of bone "
                "is: --n would be right"
            )

    @abstractmethod
    def mesh(self, options: argparse.Namespace) -> Mesh:
        """The bone with the stem."""

    @abstractmethod
    def femur(self, options: argparse.Namespace, mesh: Mesh) -> Scene:
        """The intact femur, on a mesh of its own or on that with a stem which is one piece with it."""

    @abstractmethod
    def with_stem(
        self, options: argparse.Namespace, mesh: Mesh, density: Any, femur: Scene, young: float | None
    ) -> Scene:
        """The femur with the stem, of a Young's modulus, in the bone that was carried to its mesh."""

    def add(self, parser: argparse.ArgumentParser) -> None:
        """The options that both commands have."""
        parser.add_argument(
            "--material",
            default="titanium",
            metavar="NAME",
            help="of the stem: titanium, cobalt-chromium, Young's modulus in MPa, or bone, as stiff as what it "
            "replaces (titanium)",
        )
        parser.add_argument(
            "--natural",
            action="store_true",
            help="the femur's own head and neck are one piece with the stem: with --material bone nothing changes",
        )
        parser.add_argument(
            "--difference",
            metavar="FILE",
            help="draw the density at the end, as the intact femur had it, and the difference",
        )

    def build(self, options: argparse.Namespace) -> Scene:
        """The scene with the stem, after the intact femur has grown."""
        from mpi4py import MPI

        from growthx.cli import report
        from growthx.common.checks import check_picture
        from growthx.discretisation.transfers.transfer import transfer
        from growthx.discretisation.variants import default, named
        from growthx.post.comparing.picture import IMAGES
        from growthx.run import solve

        self.check(options)
        self._young, self._difference = _young(options.material), options.difference
        if options.difference is not None:
            check_picture(options.difference, IMAGES, MPI.COMM_WORLD)
        mesh = self.mesh(options)
        check_kept(options, mesh, self._scene())
        femur = self.femur(options, mesh)
        # What the scene with the stem would refuse is refused before the intact femur has grown.
        young = 1.0 if self._young is None else self._young
        adapted(self.with_stem(options, mesh, self.outside, femur, young), options)
        variant = default(femur.mesh.cell_name) if options.variant is None else named(options.variant)
        stepping = stepping_of(options)
        if stepping.equilibrium is None:
            stepping = replace(stepping, equilibrium=ENOUGH)
        grown = adapted(femur, options)  # the scene with the stem is adapted by the run
        with report.progress(grown) as watch:
            self._intact = solve(grown, variant, watch=watch, stepping=stepping, full_newton=options.full_newton)
        carried = transfer(self._intact, mesh, variant, outside=self.outside)
        return self.with_stem(options, mesh, carried, femur, self._young)

    def read(self, result: Result) -> Mapping[str, Any]:
        """What the zones have lost, and what the intact femur was."""
        from growthx.post.comparing.comparison import compare
        from growthx.post.comparing.shielding import shielding
        from growthx.stepping.equilibrium import loaded

        assert self._intact is not None
        intact, start = self._intact, loaded(result.scene, result.problem.variant)
        self._zones = found = shielding(intact, start, result)
        if self._difference is not None:
            labels = ("with the stem", "intact")
            compare(result, result.scene.initial_density, picture=self._difference, labels=labels)
        return {
            "zones": {name: zone.density_after for name, zone in found.items()},
            "shielding": {name: asdict(zone) | {"change": zone.change} for name, zone in found.items()},
            "bone": result.problem.mean_density(),
            "stem": {"young": self._young},
            "intact": {
                "mass": intact.problem.mass(),
                "time": intact.time,
                "ended": intact.ended,
                "solve_s": intact.solve_s,
            },
        }

    def show(self, result: Result, readings: Mapping[str, Any]) -> None:
        """The same for people."""
        from growthx.cli import report
        from growthx.post.comparing.shielding import Shielding

        intact = readings["intact"]
        report.say(result, f"intact femur: grown at t = {intact['time']:g} ({intact['ended']})")
        report.table(
            "bone around the stem, densities in g/cm³ and strain energies in MPa",
            Shielding.HEADER,
            [zone.row(name) for name, zone in self._zones.items()],
            result.problem.comm,
        )
        if self._difference is not None:
            report.say(result, f"the picture of the difference is {self._difference}")


def _young(material: str) -> float | None:
    """Young's modulus of a stem of a material (MPa); None for bone."""
    from growthx.common.checks import require_number
    from growthx.scenes.stem import METALS

    if material == BONE:
        return None
    if material in METALS:
        return METALS[material]
    try:
        found = float(material)
    except ValueError:
        raise InputError(
            f"--material {material} is none: {', '.join(METALS)}, {BONE} or Young's modulus in MPa would be right"
        ) from None
    require_number(found, "Young's modulus of the stem (MPa)", "a positive number", lambda E: E > 0)
    return found
