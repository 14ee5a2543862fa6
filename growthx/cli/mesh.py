"""What a file of a mesh holds, on the command line."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

from growthx.cli.command import Command, add_trusted
from growthx.common.errors import GrowthxError, InputError

if TYPE_CHECKING:
    from growthx.meshing.inspection import Inspection, Named


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="file of a mesh or of a surface, of any format that growthx reads")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=NUMBER", help="a parameter of the file")
    parser.add_argument("--keep", metavar="WHICH", help="largest: leave out all but the largest island")
    parser.add_argument("--merge", action="store_true", help="make one node of those in one place")
    parser.add_argument(
        "--near", nargs="+", type=float, metavar="X", help="tell the node nearest to a place, as for a point force"
    )
    add_trusted(parser)
    parser.add_argument("--picture", metavar="PNG", help="draw regions and boundaries")
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout instead of tables")


def _run(options: argparse.Namespace) -> int:
    from mpi4py import MPI

    comm = MPI.COMM_WORLD
    status: int | GrowthxError = 0
    if comm.rank == 0:
        try:
            status = _look(options)
        except GrowthxError as error:  # of whatever kind: the others must not wait for ever
            status = error
    status = comm.bcast(status)
    if isinstance(status, GrowthxError):
        raise status
    return status


def _look(options: argparse.Namespace) -> int:
    """Look at the file and tell, on this rank."""
    from mpi4py import MPI

    from growthx.common.checks import check_picture
    from growthx.meshing.files import check_options
    from growthx.meshing.inspection import inspect, nearest_in_words

    if options.picture is not None:
        check_picture(options.picture, (".png",), MPI.COMM_SELF)
    check_options(1, options.keep, options.merge, options.trusted)
    parameters = dict(_parameter(text) for text in options.set)
    near = None if options.near is None else tuple(options.near)
    seen, parts = inspect(Path(options.file), parameters, options.keep, options.merge, options.trusted)
    drawn = options.picture is not None and parts is not None
    if drawn:
        from growthx.post.mesh_picture import mesh_picture

        assert parts is not None
        mesh_picture(parts, Path(options.picture))
    if near is not None and parts is not None:
        seen = replace(seen, nearest=nearest_in_words(parts, near))
    if options.json:
        print(json.dumps(asdict(seen), ensure_ascii=False))
    else:
        _show(seen, options)
        if drawn:
            print(f"the picture is {options.picture}")
    if seen.refused:
        print(f"growthx: {seen.refused}", file=sys.stderr)
    return InputError.exit_status if seen.refused else 0


def _parameter(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise InputError(f"--set {text} gives no number to a name: NAME=NUMBER would be right") from None


def _show(seen: Inspection, options: argparse.Namespace) -> None:
    """Tables and sentences for people."""
    from growthx.cli import report
    from growthx.common.words import place_in_words, quoted_names

    rows = [("file", seen.file), ("format", seen.kind)]
    if seen.elements:
        rows.append(("elements", ", ".join(seen.elements)))
        rows.append(("nodes", f"{seen.nodes}" + (f", {seen.orphans} of them of no cell" if seen.orphans else "")))
    if seen.low:
        low, high = place_in_words(seen.low), place_in_words(seen.high)
        rows += [("extent", f"{low} to {high}"), ("unit", seen.unit)]
    report.rows("the file", rows)
    if not seen.cells:
        groups = [(group.name, group.of, f"{group.count}") for group in seen.groups]
        report.rows("groups and sets", groups, ("name", "of", "number"))
    size = ("cells", "area") if len(seen.low) == 2 else ("cells", "volume")
    report.rows("regions", _named(seen.regions), ("name", *size))
    report.rows("boundaries", _named(seen.boundaries), ("name", "facets", "length" if len(seen.low) == 2 else "area"))
    sets = [(one.name, f"{one.count}") for one in seen.node_sets]
    report.rows("sets of nodes, for gx.NodalForces", sets, ("name", "nodes"))
    values = [(one.name, f"{one.low:.6g}", f"{one.high:.6g}", f"{one.without}") for one in seen.values]
    report.rows("values of cells", values, ("name", "from", "to", "cells without"))
    if seen.quality:
        quality = seen.quality
        print(
            f"quality: {quality.measure}, 1 is best: worst {quality.worst:.3g} at {place_in_words(quality.at)}, "
            f"median {quality.median:.3g}, {quality.poor} of {seen.cells} cells below 0.1"
        )
    if seen.turned:
        print(f"senses: {seen.turned} of {seen.cells} cells numbered the other way round than the rest, as they may be")
    if seen.islands:
        print(f"islands: {seen.islands}")
    if seen.nearest:
        print(f"nearest: {seen.nearest}")
    for notice in seen.notices:
        print(f"notice: {notice}")
    if seen.refused:
        print("refused: it says why below")
        return
    names = (("regions", seen.regions), ("boundaries", seen.boundaries))
    known = "; ".join(f"{what} {quoted_names(part.name for part in parts)}" for what, parts in names)
    print(f"in a script: mesh = gx.meshing.read({_call(seen, options)})  # {known}")


def _named(parts: tuple[Named, ...]) -> list[tuple[str, ...]]:
    return [(part.name, f"{part.count}", f"{part.size:.6g}") for part in parts]


def _call(seen: Inspection, options: argparse.Namespace) -> str:
    """The arguments with which a script reads the same."""
    words = [json.dumps(seen.file, ensure_ascii=False)]
    numbers = dict(map(_parameter, options.set))  # as whole as they were given
    words += [f"{name}={int(value) if value.is_integer() else value!r}" for name, value in numbers.items()]
    words += [f'keep="{options.keep}"'] if options.keep else []
    words += [f"{name}=True" for name, given in (("merge", options.merge), ("trusted", options.trusted)) if given]
    return ", ".join(words)


MESH = Command("mesh", "what the file of a mesh holds, before it is used", _arguments, _run)
