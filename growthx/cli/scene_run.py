"""A scene solved as the options of its command ask for, and told as tables or as JSON."""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import asdict, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from growthx.cli import picture, scan, states
from growthx.cli.changes import laws, loads
from growthx.cli.command import Command, SceneCommand, add_energy, add_plane, with_energy
from growthx.common.errors import InputError

if TYPE_CHECKING:
    from growthx.discretisation.variants import Variant
    from growthx.meshing.mesh import Mesh
    from growthx.model.scene import Scene
    from growthx.stepping.control import Stepping
    from growthx.stepping.record import Result


VARIANTS = (
    "discretisation, displacement before density; of quadrilaterals and hexahedra: Q1Q1, Q2Q2, S2Q1, Q1P0, Q1, Q2, "
    "Q1sri, S2fri; of triangles and tetrahedra: P1P1, P2P2, P2P1, P1P0, P1, P2 (Q1P0 or P1P0)"
)

SCHEMES = "scheme of time integration: implicit-euler, tr-bdf2 or sdirk2"

LAST_STATE = "growthx-last-state"  # folder of runs that end early and have none
IN_OUT = ""  # --resume alone

FIELDS = (
    "with --out, write these fields alone, by their names with commas: each as mean over cells, averaged to nodes and "
    "at points of integration, or in one place, as von_mises:cells, von_mises:nodes or von_mises:points; of density, "
    "relative_change, stimulus, mass_source, major_stress, minor_stress, displacement, strain_energy, "
    "strain_energy_per_mass, young, green_lagrange_strain, thickness_stretch, hencky_strain, principal_strains, "
    "strain_direction_1, strain_direction_2, strain_direction_3, cauchy_stress, first_piola_stress, von_mises, "
    "principal_stresses, stress_direction_1, stress_direction_2, stress_direction_3 (density, its change, stimulus, "
    "source, stresses)"
)


def of_scene(scene: SceneCommand) -> Command:
    """The command that solves a scene."""
    return Command(scene.name, scene.help, partial(arguments, scene), partial(run, scene))


def arguments(scene: SceneCommand, parser: argparse.ArgumentParser) -> None:
    """The options of a scene's command."""
    parser.add_argument("--variant", metavar="NAME", help=VARIANTS)
    scene.arguments(parser)
    parser.add_argument(
        "--bounds",
        nargs=2,
        type=_bound,
        metavar=("LOW", "HIGH"),
        help="lowest and highest density, 'none' for none of the two: density that reaches a bound stays there for as "
        "long as its source drives it on (none none)",
    )
    add_energy(parser)
    laws.add_laws(parser)
    loads.add_loads(parser)
    if not scene.in_space:
        add_plane(parser)
    _add_stepping(parser)
    parser.add_argument("--check", action="store_true", help="examine at the end whether the problem is well posed")
    parser.add_argument("--out", metavar="FOLDER", help="write fields for ParaView and history.csv to a new folder")
    parser.add_argument("--fields", metavar="NAMES", help=FIELDS)
    states.add_states(parser)
    _add_checkpoints(parser)
    scan.add_scan(parser)
    picture.add_picture(parser, scene)
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout instead of tables")


def run(command: SceneCommand, options: argparse.Namespace) -> int:
    """Solve a scene as the options ask for, on all ranks; returns the exit status."""
    from growthx.cli import report
    from growthx.constitutive.elastic import catalogue
    from growthx.discretisation import variants
    from growthx.meshing.files import load_gmsh
    from growthx.model.exponents import is_well_posed
    from growthx.post.wellposedness import check
    from growthx.results import summary

    variant = None if options.variant is None else variants.named(options.variant)
    if options.energy is not None:
        catalogue.named(options.energy)
    stepping = stepping_of(options)
    scan.check(options)
    laws.check(options)
    if command.by_gmsh:
        load_gmsh()
    start = time.perf_counter()
    scene = adapted(command.build(options), options)
    scanned = scan.density(options, scene.mesh)
    if scanned is not None:
        scene = replace(scene, initial_density=scanned)
    setup = time.perf_counter() - start
    check_kept(options, scene.mesh, command)
    variant = variant or variants.default(scene.mesh.cell_name)
    result, status = _solved(scene, variant, stepping, options)
    result.setup_s += setup
    readings = {**command.read(result), **scan.read(result, scanned)}
    posed = check(result.problem) if options.check or not is_well_posed(scene) else None
    if posed is not None:
        readings = {**readings, "well_posedness": asdict(posed)}
    if options.json:
        answer = json.dumps({**summary(result), **readings}, ensure_ascii=False)
        if scene.mesh.comm.rank == 0:
            print(answer)
    else:
        report.steps(result)
        command.show(result, readings)
        scan.show(result, readings)
        report.times(result)
        if posed is not None:
            report.say(result, f"{scene.name}: {posed}")
    picture.draw(options, result, command)
    states.draw(options, result, command.drawn_in)
    return status


def adapted(scene: Scene, options: argparse.Namespace) -> Scene:
    """The scene with the stored energy, law, loads, plane and bounds that the options ask for."""
    from growthx.constitutive.elastic import catalogue

    if options.energy is not None:
        scene = with_energy(scene, catalogue.named(options.energy))
    scene = loads.with_loads(laws.with_laws(scene, options), options)
    if getattr(options, "plane", None) is not None:
        scene = replace(scene, plane=options.plane)
    if options.bounds is not None:
        scene = replace(scene, growth=replace(scene.growth, bounds=tuple(options.bounds)))
    return scene


def check_kept(options: argparse.Namespace, mesh: Mesh, command: SceneCommand) -> None:
    """Refuse, before a long run, what could not be drawn or kept of it as asked for (collective)."""
    from growthx.results.plan import check_plan

    picture.check(options, mesh, command)
    states.check(options, mesh.comm)
    check_plan(**_kept(options), watch=None)


def _kept(options: argparse.Namespace) -> dict[str, Any]:
    """What a run keeps, and what it goes on from, as `solve` takes it."""
    return {
        "out": options.out,
        **states.chosen(options),
        "checkpoint": options.checkpoint,
        "resume": _source(options),
        "refuge": LAST_STATE,
        "fields": None if options.fields is None else [name.strip() for name in options.fields.split(",")],
    }


def _solved(scene: Scene, variant: Variant, stepping: Stepping, options: argparse.Namespace) -> tuple[Result, int]:
    """The result of a run as far as it got, and the exit status of how it ended."""
    from growthx.cli import report
    from growthx.run import RunEndedEarly, RunNotWritten, solve

    try:
        with report.progress(scene) as watch:
            result = solve(
                scene,
                variant,
                **_kept(options),
                watch=watch,
                stepping=stepping,
                full_newton=options.full_newton,
            )
    except (RunEndedEarly, RunNotWritten) as ended:
        if scene.mesh.comm.rank == 0:
            kept = (
                f"the last good state is in {ended.result.folder}"
                if ended.result.folder
                else "nothing has been written"
            )
            print(f"growthx: {ended}; {kept}", file=sys.stderr)
        return ended.result, ended.exit_status
    return result, 0


def _bound(text: str) -> float | None:
    """A bound of density from the command line."""
    try:
        return None if text == "none" else float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no density: a number or 'none' would be right") from None


def _source(options: argparse.Namespace) -> str | None:
    """The checkpoint, or the folder of some, that the options ask for; None for a run from the beginning."""
    if options.resume != IN_OUT:
        return options.resume
    if options.out is None:
        raise InputError("--resume names no checkpoint and there is no --out: the folder of a run would be right")
    return options.out


def _add_stepping(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--adaptive",
        type=float,
        metavar="ERROR",
        help="choose the time steps by this error of density in each, relative (steps of fixed length)",
    )
    parser.add_argument("--scheme", metavar="NAME", help=f"{SCHEMES} (implicit-euler; with --adaptive, tr-bdf2)")
    parser.add_argument(
        "--equilibrium",
        type=float,
        metavar="SHARE",
        help="end the run when the rate of density has fallen to this share of unloaded resorption",
    )
    parser.add_argument(
        "--full-newton",
        action="store_true",
        help="assemble and factorise the tangent at every iteration, as the paper (only where that pays)",
    )


def _add_checkpoints(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--checkpoint", type=int, metavar="K", help="keep the state in --out, at the start and after every K steps"
    )
    parser.add_argument(
        "--resume",
        nargs="?",
        const=IN_OUT,
        metavar="FROM",
        help="go on from a checkpoint, or from the last one in a folder (that of --out)",
    )


def stepping_of(options: argparse.Namespace) -> Stepping:
    """The way through time that the options ask for."""
    from growthx.stepping import time_schemes
    from growthx.stepping.control import AdaptiveSteps, FixedSteps

    stepping: Stepping = FixedSteps(equilibrium=options.equilibrium)
    if options.adaptive is not None:
        stepping = AdaptiveSteps(options.adaptive, equilibrium=options.equilibrium)
    return stepping if options.scheme is None else replace(stepping, scheme=time_schemes.named(options.scheme))
