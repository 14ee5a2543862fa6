"""FEBio's verification problem of bone remodelling, from FEBio's own file: how near growthx comes to its number.

    python -m benchmarks.accuracy.febio mi33.feb

The file is not here: it is Verify3/mi33.feb of FEBio's public test suite (github.com/febiosoftware/TestSuite), of which
the whole model is read, materials, supports, nodal forces and load curves, as far as that one has them.
Leaves febio.md and febio.csv in benchmarks/results.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import growthx as gx
from benchmarks.shared import command
from benchmarks.shared.reporting import RESULTS, Table, item, read_rows, write_rows
from growthx import baselines
from growthx.meshing.formats.febio import parsed
from growthx.meshing.surfaces.nodes import node_places
from growthx.meshing.surfaces.sides import corner_nodes

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation
    from growthx.stepping.record import Step

KNOWN = 2.94304075732  # in that suite, the norm of all displacements at t = 10
RUNS = {  # variant, whether the density is updated after equilibrium, parts of a time step
    "implicit, Q1": ("Q1", False, 1),
    "implicit, Q1, half the step": ("Q1", False, 2),
    "update, Q1": ("Q1", True, 1),
    "implicit, Q1P0": ("Q1P0", False, 1),
    "update, Q1P0": ("Q1P0", True, 1),
    "implicit, Q1Q1": ("Q1Q1", False, 1),
}
AXES = "xyz"

INTRODUCTION = f"""\
# FEBio's remodelling of a femur

The problem `mi33` of FEBio's public test suite: half of a plane femur, 510 hexahedra 1.2 thick, with a side plate of
368 that joins its two cortices, fixed below, under four pairs of nodal forces that rise until t = 1.
Neo-Hooke with E = 3.79e10 ρ³, ν = 0.3, and of the plate E = 1.7e11; R₀ = 1e-5 [Ψ₀/ρ − 4e4] between the densities 0.1
and 1.74, ρ(0) = 1.74; 100 steps of 0.1.  At the end the norm of the vector of all displacements is {KNOWN:.11f}:
each FEBio is tested for that number.

FEBio finds the densities at the eight integration points of a cell together with the displacement, by implicit Euler:
each evaluation of a stress takes the density from the one before, until the displacement changes by less than a
thousandth.  That is Q1 here, by a fixed point instead of Newton's method.

Made by `python -m benchmarks.accuracy.febio`, which is given the file; it is FEBio's, and not here.

"""


@dataclass(frozen=True)
class Row:
    """A run at its end: the norm of all displacements, mean density, shares of the volume at the bounds."""

    run: str
    norm: float
    mean: float
    low: float
    high: float


def model(path: Path) -> gx.Scene:
    """The scene of a file of FEBio 3; InputError for what this script does not know."""
    mesh = gx.meshing.read(path)
    root = parsed(path)
    if root.get("version") != "3.0":
        raise gx.InputError(f"{path} is a model of version {root.get('version')}: one of 3.0 would be right")
    bone, rest = _materials(root, path)
    remodelled, young = root.find(f"Material/material[@name='{bone}']"), {name: E for name, (E, _) in rest.items()}
    region = _region(root, bone)
    solid, supply = remodelled.find("solid"), remodelled.find("supply")
    if solid.get("type") != "Carter-Hayes (old)" or supply.get("type") != "Huiskes-supply":
        raise gx.InputError(
            f"the bone of {path} is a '{solid.get('type')}' with a '{supply.get('type')}': a 'Carter-Hayes (old)' with "
            "a 'Huiskes-supply' would be right"
        )
    least, most = _number(remodelled, "min_density"), _number(remodelled, "max_density")
    poisson = {region: _number(solid, "v"), **{name: nu for name, (_, nu) in rest.items()}}
    step, steps = _number(root, "Control/step_size"), _number(root, "Control/time_steps")
    return gx.Scene(
        name="FEBio's femur",
        mesh=mesh,
        material=gx.Material(
            young={region: _number(solid, "c"), **young},
            poisson=poisson,
            reference_density=1.0,
            density_exponent=_number(solid, "gamma"),
        ),
        growth=gx.SpecificEnergyDrivenGrowth(_number(supply, "k"), _number(supply, "B"), bounds=(least, most)),
        supports=tuple(_supports(root, mesh)),
        loads=tuple(_loads(root, path)),
        program=gx.Program(step, step * steps),
        initial_density=_number(solid, "density"),
        growing=(region,),
    )


def _number(part: Any, name: str) -> float:
    found = part.find(name)
    try:
        return float(found.text)
    except (AttributeError, TypeError, ValueError):
        raise gx.InputError(f"<{part.tag}> has no number in <{name}>: one is needed") from None


def _region(root: Any, material: str) -> str:
    """The part that is of a material."""
    names = [one.get("name") for one in root.iter("SolidDomain") if one.get("mat") == material]
    if len(names) != 1:
        raise gx.InputError(f"the material '{material}' has {len(names)} parts: one would be right")
    return str(names[0])


def _materials(root: Any, path: Path) -> tuple[str, dict[str, tuple[float, float]]]:
    """The name of what remodels, and E and ν of each part of another material."""
    kinds = {one.get("name"): one.get("type") for one in root.iterfind("Material/material")}
    bones = [name for name, kind in kinds.items() if kind == "remodeling solid"]
    if len(bones) != 1 or set(kinds.values()) - {"remodeling solid", "neo-Hookean"}:
        raise gx.InputError(
            f"the materials of {path} are {', '.join(sorted(set(map(str, kinds.values()))))}: one 'remodeling solid', "
            "and 'neo-Hookean' ones, would be right"
        )
    rest = {
        _region(root, name): (_number(one, "E"), _number(one, "v"))
        for one in root.iterfind("Material/material")
        if (name := one.get("name")) != bones[0]
    }
    return bones[0], rest


def _supports(root: Any, mesh: gx.Mesh) -> Iterator[gx.Support | gx.PointSupport]:
    """Of faces by their name, where the set is one, and else of each node."""
    for one in root.iterfind("Boundary/bc"):
        fixed = {AXES.index(name) for name in one.find("dofs").text.replace(" ", "").split(",")}
        held = tuple(0.0 if axis in fixed else None for axis in range(3))
        name = one.get("node_set")
        places = node_places(mesh, name, "of a support")
        if name in mesh.boundaries and len(places) == _corners(mesh, name):
            yield gx.Support(name, held)
        else:
            yield from (gx.PointSupport(tuple(place), held) for place in places.tolist())


def _corners(mesh: gx.Mesh, boundary: str) -> int:
    """How many nodes the sides of a boundary have at their corners (collective)."""
    comm, here = mesh.comm, corner_nodes(mesh.domain, mesh.boundary(boundary))
    return len(np.unique(np.concatenate(comm.allgather(mesh.origin.nodes[here].ravel()))))


def _loads(root: Any, path: Path) -> Iterator[gx.NodalForces]:
    curves = {one.get("id"): one for one in root.iterfind("LoadData/load_controller")}
    for one in root.iterfind("Loads/nodal_load"):
        scale, axis = one.find("scale"), AXES.index(one.find("dof").text)
        force = tuple(float(scale.text) if i == axis else 0.0 for i in range(3))
        yield gx.NodalForces(one.get("node_set"), force, _history(curves[scale.get("lc")], path))


def _history(curve: Any, path: Path) -> gx.Table:
    """Of two points what is smooth to FEBio is linear; after the last one it stays."""
    rows = [tuple(map(float, point.text.split(","))) for point in curve.iter("point")]
    if len(rows) > 2 and curve.find("interpolate").text != "LINEAR":
        raise gx.InputError(f"a load curve of {path} has {len(rows)} points, not linear between: two would be right")
    return gx.Table(tuple((time, share) for time, share in rows))


def norm(problem: Discretisation) -> float:
    """Of the vector of all displacements at nodes (length) (collective)."""
    u = problem.displacement
    own = u.function_space.dofmap.index_map.size_local * u.function_space.dofmap.index_map_bs
    return float(np.sqrt(problem.comm.allreduce(float((u.x.array[:own] ** 2).sum()))))


def solved(run: str, scene: gx.Scene) -> Row:
    """A run to its end."""
    name, updated, parts = RUNS[run]
    scene = replace(scene, program=replace(scene.program, step=scene.program.step / parts))
    variant = gx.variants.named(name)
    problem = baselines.frozen(scene, variant) if updated else gx.discretise(scene, variant)
    steps: Iterator[Step] = (
        baselines.update(scene, variant, problem, floor=scene.growth.limits[0])
        if updated
        else gx.march(scene, variant, problem)
    )
    for _ in steps:
        pass
    dofs = problem.growing_dofs
    density, shares = problem.density.x.array[dofs], problem.volumes[dofs] / problem.volumes[dofs].sum()
    low, high = scene.growth.limits
    at_low, at_high = shares[density <= low * (1 + 1e-9)].sum(), shares[density >= high * (1 - 1e-9)].sum()
    return Row(run, norm(problem), float(shares @ density), float(at_low), float(at_high))


def page(folder: Path = RESULTS) -> str:
    """The page, from the CSV file of a folder."""
    rows = read_rows(folder / "febio.csv", Row)
    by = {row.run: row for row in rows}
    lines = [
        [
            row.run,
            *(f"{row.norm:.7f}", f"{row.norm / KNOWN - 1:+.1e}"),
            *(f"{row.mean:.4f}", f"{row.low:.1%}", f"{row.high:.1%}"),
        ]
        for row in rows
    ]
    header = ["", "norm", "against FEBio", "mean density", "at 0.1", "at 1.74"]
    exact, halved, after = (by[run] for run in ("implicit, Q1", "implicit, Q1, half the step", "update, Q1"))
    findings = [
        f"**FEBio's number to {abs(exact.norm / KNOWN - 1):.0e}**, with the same cells, law and steps.",
        f"Half the time step moves it by {abs(halved.norm / exact.norm - 1):.1e}, densities updated after equilibrium "
        f"by {abs(after.norm / exact.norm - 1):.1e}.",
        "Other densities make other bones: with m = 1 below n = 3 the model is not well posed, and growthx says so. "
        f"One density per cell leaves {by['implicit, Q1P0'].low:.0%} of the volume at the lower bound, one per node "
        f"{by['implicit, Q1Q1'].low:.0%}, one per integration point {exact.low:.0%}.",
    ]
    return "\n".join([INTRODUCTION + Table("At t = 10", header, lines).markdown(), *map(item, findings), ""])


def main() -> None:
    """Run all, and write the page."""
    parser = command.parser("benchmarks.accuracy.febio", __doc__)
    parser.add_argument("path", type=Path, help="mi33.feb of FEBio's test suite")
    command.add_out(parser)
    options = parser.parse_args()
    command.require_one_rank("would write the same rows")
    logging.getLogger("growthx").setLevel(logging.ERROR)  # sets of nodes that are no faces, and m ≤ n
    scene = model(options.path)
    write_rows(options.out / "febio.csv", [solved(run, scene) for run in RUNS])
    command.write_page(options.out, "febio", page(options.out))


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
