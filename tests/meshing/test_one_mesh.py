"""One mesh in all formats: the same cells, names and volumes, and one run on it to the last digit."""

import meshio
import numpy as np
import pytest
from blocks import COMM, boundary_size, region_size

import growthx as gx
from growthx import meshing

SQUARE = (
    [[x / 3, y / 3, 0.0] for y in range(4) for x in range(4)],
    [[i + 4 * j, i + 4 * j + 1, i + 4 * j + 5, i + 4 * j + 4] for j in range(3) for i in range(3)],
)
CUBE = (
    [[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)],
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]],
)
SIDES = {
    2: {3: [[0, 4], [4, 8], [8, 12]], 4: [[3, 7], [7, 11], [11, 15]]},
    3: {3: [[0, 2, 6], [0, 6, 4]], 4: [[1, 3, 7], [5, 1, 7]]},
}
TYPES = {2: ("quad", "line", 3, 1, "CPE4", "T2D2", "quad4"), 3: ("tetra", "triangle", 4, 2, "C3D4", "S3", "tet4")}


def of(dim):
    """Points, cells, the region of each, and sides with the number of their boundary."""
    points, cells = SQUARE if dim == 2 else CUBE
    regions = [1 + (number % 2) for number in range(len(cells))]
    sides = [(side, number) for number, some in SIDES[dim].items() for side in some]
    return points, cells, regions, sides


def msh(path, dim):
    points, cells, regions, sides = of(dim)
    rows = [f"{i} {' '.join(map(repr, x))}" for i, x in enumerate(points, start=1)]
    kinds = [(TYPES[dim][3], group, side) for side, group in sides]
    kinds += [(TYPES[dim][2], group, cell) for cell, group in zip(cells, regions, strict=True)]
    elements = [
        f"{i} {kind} 2 {group} {group} {' '.join(str(node + 1) for node in nodes)}"
        for i, (kind, group, nodes) in enumerate(kinds, start=1)
    ]
    path.write_text(
        "\n".join(["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(rows)), *rows, "$EndNodes"])
        + "\n"
        + "\n".join(["$Elements", str(len(elements)), *elements, "$EndElements", ""])
    )


def inp(path, dim):
    points, cells, regions, sides = of(dim)
    text = "*NODE\n" + "".join(f"{i}, {', '.join(map(repr, x))}\n" for i, x in enumerate(points, start=1))
    text += f"*ELEMENT, TYPE={TYPES[dim][4]}\n"
    text += "".join(f"{i}, {', '.join(str(n + 1) for n in nodes)}\n" for i, nodes in enumerate(cells, start=1))
    for number in (1, 2):
        text += f"*ELSET, ELSET={number}\n" + "".join(f"{i},\n" for i, r in enumerate(regions, start=1) if r == number)
    for number in (3, 4):
        text += f"*ELEMENT, TYPE={TYPES[dim][5]}, ELSET={number}\n"
        own = [side for side, group in sides if group == number]
        text += "".join(f"{100 * number + i}, {', '.join(str(n + 1) for n in s)}\n" for i, s in enumerate(own))
    path.write_text(text)


def feb(path, dim):
    points, cells, regions, sides = of(dim)
    nodes = "".join(f'<node id="{i}">{",".join(map(repr, x))}</node>' for i, x in enumerate(points, start=1))
    elements = "".join(
        f'<elem id="{i}">{",".join(str(n + 1) for n in nodes)}</elem>' for i, nodes in enumerate(cells, start=1)
    )
    sets = "".join(
        f'<ElementSet name="{number}">{",".join(str(i) for i, r in enumerate(regions, 1) if r == number)}</ElementSet>'
        for number in (1, 2)
    )
    for number in (3, 4):
        own = [side for side, group in sides if group == number]
        if dim == 2:
            names = sorted({node + 1 for side in own for node in side})
            sets += f'<NodeSet name="{number}">{",".join(map(str, names))}</NodeSet>'
        else:
            facets = "".join(
                f'<tri3 id="{i}">{",".join(str(n + 1) for n in side)}</tri3>' for i, side in enumerate(own)
            )
            sets += f'<Surface name="{number}">{facets}</Surface>'
    path.write_text(
        f'<febio_spec version="4.0"><Mesh><Nodes>{nodes}</Nodes><Elements type="{TYPES[dim][6]}" name="part">{elements}'
        f"</Elements>{sets}</Mesh></febio_spec>"
    )


def by_meshio(path, dim):
    points, cells, regions, sides = of(dim)
    blocks = [(TYPES[dim][0], cells), (TYPES[dim][1], [side for side, _ in sides])]
    name = "medit:ref" if path.suffix == ".mesh" else "region"
    data = {name: [np.array(regions), np.array([group for _, group in sides])]}
    options = {"float_fmt": ".17g"} if path.suffix == ".mesh" else {}
    meshio.Mesh(np.array(points), blocks, cell_data=data).write(path, **options)


WRITERS = {".inp": inp, ".feb": feb, **dict.fromkeys((".vtu", ".vtk", ".xdmf", ".med", ".mesh"), by_meshio)}


def told(mesh, variant):
    """Cells, sizes of what is named by numbers, and masses of a run."""
    numbers = ("1", "2"), ("3", "4")
    sizes = [region_size(mesh, name) for name in numbers[0]]
    sizes += [boundary_size(mesh, name) for name in numbers[1]]
    scene = gx.Scene(
        name="one mesh",
        mesh=mesh,
        material=gx.Material(young={"1": 1.0, "2": 3.0}, poisson=0.3, reference_density=1.2),
        growth=gx.EnergyDrivenGrowth(attractor=0.01, rate=1.0),
        supports=(gx.Support("3"),),
        loads=(gx.Traction("4", (0.05, 0.02, 0.01)[: mesh.dim]),),
        program=gx.Program(step=0.1, until=0.2),
    )
    return mesh.cell_count, sizes, [step.mass for step in gx.solve(scene, variant).steps]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("suffix", WRITERS)
def test_it_is_the_same_in_all_formats(shared_folder, dim, suffix):
    """As from gmsh's own file."""
    if COMM.rank == 0:
        msh(shared_folder / "one.msh", dim)
        WRITERS[suffix](shared_folder / f"one{suffix}", dim)
    COMM.barrier()
    variant = gx.Q1 if dim == 2 else gx.P1
    mesh = meshing.read(shared_folder / f"one{suffix}")
    if suffix == ".feb":  # which has its part as a region too
        mesh = gx.Mesh(mesh.domain, mesh.boundaries, {name: mesh.regions[name] for name in ("1", "2")})
    expected = told(meshing.read(shared_folder / "one.msh"), variant)
    found = told(mesh, variant)
    assert found[0] == expected[0] and found[1] == pytest.approx(expected[1], rel=1e-12)
    assert found[2] == (expected[2] if COMM.size == 1 else pytest.approx(expected[2], rel=1e-14))
