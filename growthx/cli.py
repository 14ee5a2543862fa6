"""The command `growthx`: the benchmark scenes with their parameters, as tables for people or as JSON for programs."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, NoReturn

from growthx.errors import InputError
from growthx.parallel import guarded

if TYPE_CHECKING:
    from growthx.run import Result
    from growthx.scene import Scene
    from growthx.stepping import Stepping

VARIANTS = (
    "discretisation, displacement before density; of quadrilaterals: Q1Q1, Q2Q2, S2Q1, Q1P0, Q1, Q2, Q1sri, S2fri; "
    "of triangles: P1P1, P2P2, P2P1, P1P0, P1, P2 (Q1P0 or P1P0)"
)
CELLS = "shape of the cells: quadrilateral or triangle"
SCHEMES = "scheme of time integration: implicit-euler, tr-bdf2 or sdirk2"
LOADS = (
    "how the load cases combine: average (forces by daily cycles), superposed (plain sum of the forces) or stimulus (a "
    "displacement for each, growth by the mean of the energies)"
)
EPILOG = """\
Exit status: 0 done, 1 results could not be written, 2 bad input, 3 the run ended early (its last good state is kept in
a folder), 130, 138 and 143 it was ended by Ctrl-C, SIGUSR1 and SIGTERM (its state is kept: --resume goes on from it).
In parallel: mpirun -n 2 growthx …, which lets a run end in order after SIGUSR1 only; PETSc options under the prefix
-growthx_ go into the variable PETSC_OPTIONS.
"""


LAST_STATE = "growthx-last-state"  # folder of runs that end early and have none
IN_OUT = ""  # --resume alone


class _Parser(argparse.ArgumentParser):
    """Bad arguments are bad input like any other."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message} ({self.prog} --help tells what there is)")


@dataclass(frozen=True)
class _Command:
    """A scene on the command line.

    build: the scene from the arguments.  read: what is read off the result for the JSON object, on all ranks.
    show: tables for people.
    """

    name: str
    help: str
    arguments: Callable[[argparse.ArgumentParser], None]
    build: Callable[[argparse.Namespace], Scene]
    read: Callable[[Result], Mapping[str, Any]]
    show: Callable[[Result, Mapping[str, Any]], None]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    return guarded(lambda: _main(sys.argv[1:] if arguments is None else arguments))


def _main(arguments: Sequence[str]) -> int:
    options = _parser().parse_args(arguments)
    command: _Command = options.command
    from growthx import meshing, report, results, variants, wellposedness
    from growthx.run import RunEndedEarly, RunNotWritten, solve

    variant = None if options.variant is None else variants.named(options.variant)
    stepping = _stepping(options)
    meshing.load_gmsh()
    start = time.perf_counter()
    scene = command.build(options)
    setup = time.perf_counter() - start
    variant = variant or variants.default(scene.mesh.cell_name)
    status = 0
    try:
        with report.progress(scene) as watch:
            result = solve(
                scene,
                variant,
                out=options.out,
                watch=watch,
                stepping=stepping,
                full_newton=options.full_newton,
                checkpoint=options.checkpoint,
                resume=_source(options),
                refuge=LAST_STATE,
            )
    except (RunEndedEarly, RunNotWritten) as ended:
        result, status = ended.result, ended.exit_status
        if scene.mesh.domain.comm.rank == 0:
            kept = f"the last good state is in {result.folder}" if result.folder else "nothing has been written"
            print(f"growthx: {ended}; {kept}", file=sys.stderr)
    result.setup_s += setup
    readings = command.read(result)
    posed = wellposedness.check(result.problem) if options.check or not wellposedness.is_well_posed(scene) else None
    if posed is not None:
        readings = {**readings, "well_posedness": asdict(posed)}
    if options.json:
        answer = json.dumps({**results.summary(result), **readings}, ensure_ascii=False)
        if scene.mesh.domain.comm.rank == 0:
            print(answer)
    else:
        report.steps(result)
        command.show(result, readings)
        report.times(result)
        if posed is not None:
            report.say(result, f"{scene.name}: {posed}")
    return status


def _source(options: argparse.Namespace) -> str | None:
    """The checkpoint, or the folder of some, that the options ask for; None for a run from the beginning."""
    if options.resume != IN_OUT:
        return options.resume
    if options.out is None:
        raise InputError("--resume names no checkpoint and there is no --out: the folder of a run would be right")
    return options.out


def _parser() -> argparse.ArgumentParser:
    from growthx import __version__

    parser = _Parser(
        prog="growthx",
        description="Density growth of bone at finite strains (Kuhl, Menzel & Steinmann 2003).",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"growthx {__version__}")
    scenes = parser.add_subparsers(metavar="SCENE", required=True, parser_class=_Parser)
    for command in (BAR, FEMUR, PLATE):
        scene = scenes.add_parser(
            command.name,
            help=command.help,
            description=command.help,
            epilog=EPILOG,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        scene.set_defaults(command=command)
        scene.add_argument("--variant", metavar="NAME", help=VARIANTS)
        command.arguments(scene)
        _add_stepping(scene)
        scene.add_argument("--check", action="store_true", help="examine at the end whether the problem is well posed")
        scene.add_argument("--out", metavar="FOLDER", help="write fields for ParaView and history.csv to a new folder")
        _add_checkpoints(scene)
        scene.add_argument("--json", action="store_true", help="print one JSON object on stdout instead of tables")
    return parser


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


def _stepping(options: argparse.Namespace) -> Stepping:
    """The way through time that the options ask for."""
    from growthx import time_schemes
    from growthx.stepping import AdaptiveSteps, FixedSteps

    stepping: Stepping = FixedSteps(equilibrium=options.equilibrium)
    if options.adaptive is not None:
        stepping = AdaptiveSteps(options.adaptive, equilibrium=options.equilibrium)
    return stepping if options.scheme is None else replace(stepping, scheme=time_schemes.named(options.scheme))


def _add_exponents(parser: argparse.ArgumentParser) -> None:
    _add(parser, "--n", 2.0, float, "exponent n: Ψ₀ = [ρ/ρ*]ⁿ Ψ₀ⁿᵉᵒ")
    _add(parser, "--m", 3.0, float, "exponent m: R₀ = c { [ρ/ρ*]^(−m) Ψ₀ − Ψ₀* }; well posed for m > n")


def _add(parser: argparse.ArgumentParser, name: str, default: Any, kind: type, text: str) -> None:
    parser.add_argument(name, default=default, type=kind, metavar=name.strip("-").upper(), help=f"{text} ({default})")


# -- bar ---------------------------------------------------------------------------------------------------------------


def _bar_arguments(parser: argparse.ArgumentParser) -> None:
    _add(parser, "--problem", "discontinuous", str, "discontinuous (stepped stimulus) or continuous (tapered bar)")
    _add(parser, "--elements", 40, int, "number of elements along the bar; the paper takes 10, 40 and 100")
    _add(parser, "--cells", "quadrilateral", str, CELLS)
    _add(parser, "--dt", 0.1, float, "time step")
    _add_exponents(parser)


def _bar(options: argparse.Namespace) -> Scene:
    from growthx.scenes.bar import PROBLEMS, bar

    if options.problem not in PROBLEMS:
        raise InputError(f"there is no bar problem '{options.problem}': one of {', '.join(PROBLEMS)} would be right")
    return bar(
        PROBLEMS[options.problem], options.elements, cells=options.cells, n=options.n, m=options.m, step=options.dt
    )


def _read_bar(result: Result) -> Mapping[str, Any]:
    from growthx.scenes.bar import end_displacement, midpoint_density_change

    return {
        "midpoint_density_change": midpoint_density_change(result.problem),
        "end_displacement": end_displacement(result.problem),
    }


def _show_bar(result: Result, readings: Mapping[str, Any]) -> None:
    from growthx import report

    values = {name.replace("_", " "): readings[name] for name in ("midpoint_density_change", "end_displacement")}
    report.numbers(result, "bar", values, "", digits=6)  # as many as the paper prints


# -- femur -------------------------------------------------------------------------------------------------------------


def _femur_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--cells", metavar="CELLS", help=f"{CELLS} (quadrilateral, or what --mesh has)")
    parser.add_argument("--size", type=float, metavar="MM", help="cell size in mm (that of the paper's 658 cells)")
    parser.add_argument("--mesh", metavar="FILE", help="own .geo or .msh in mm with boundaries 'surface' and 'distal'")
    _add(parser, "--refine", 1, int, "split every cell uniformly into REFINE x REFINE")
    _add(parser, "--loads", "average", str, LOADS)
    parser.add_argument(
        "--weights",
        type=float,
        nargs=3,
        metavar="W",
        help="weights of midstance of gait, extreme abduction and extreme adduction (those of --loads)",
    )
    _add(parser, "--thickness", 30.0, float, "thickness of the plane model in mm")
    _add(parser, "--until", 160.0, float, "end time")
    _add(parser, "--dt", 4.0, float, "time step; the load ramps over five of them")
    _add_exponents(parser)


def _femur(options: argparse.Namespace) -> Scene:
    from growthx.scenes.femur import combination, femur

    if options.mesh is not None:
        for name in ("size", "cells"):
            if (value := getattr(options, name)) is not None:
                raise InputError(f"--{name} {value} is for the built-in outline: with --mesh, the file has its own")
    loads = combination(options.loads)
    return femur(
        options.mesh,
        cells=options.cells or "quadrilateral",
        size=options.size,
        refine=options.refine,
        thickness=options.thickness,
        weights=tuple(options.weights or loads.weights),
        separate=loads.separate,
        n=options.n,
        m=options.m,
        step=options.dt,
        until=options.until,
    )


def _read_femur(result: Result) -> Mapping[str, Any]:
    from growthx.scenes.femur import zones
    from growthx.zones import area_means

    return {"zones": area_means(result.problem, zones()), "bone": result.problem.mean_density()}


def _show_femur(result: Result, readings: Mapping[str, Any]) -> None:
    from growthx import report

    values = {**readings["zones"], "whole bone": readings["bone"]}
    reference = result.scene.material.reference_density
    report.numbers(result, "mean density of anatomical zones", values, "g/cm³", reference)


# -- plate -------------------------------------------------------------------------------------------------------------


def _plate_arguments(parser: argparse.ArgumentParser) -> None:
    _add(parser, "--n", 64, int, "number of cells over the height; 2N x N in all")
    _add(parser, "--cells", "quadrilateral", str, CELLS)


def _plate(options: argparse.Namespace) -> Scene:
    from growthx.scenes.plate import plate

    return plate(options.n, shape=options.cells)


def _read_plate(result: Result) -> Mapping[str, Any]:
    from growthx.scenes.plate import tip_displacement

    return {"tip_displacement": tip_displacement(result.problem)}


def _show_plate(result: Result, readings: Mapping[str, Any]) -> None:
    from growthx import report

    report.numbers(result, "plate", {"tip displacement": readings["tip_displacement"]}, "", digits=6)


BAR = _Command("bar", "the paper's bar in tension", _bar_arguments, _bar, _read_bar, _show_bar)
FEMUR = _Command("femur", "the proximal femur under daily loads", _femur_arguments, _femur, _read_femur, _show_femur)
PLATE = _Command("plate", "a bent plate of any size", _plate_arguments, _plate, _read_plate, _show_plate)
