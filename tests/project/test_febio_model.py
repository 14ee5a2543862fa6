"""The program that reads a whole model of FEBio: against the scalar solution of a bar, and what it does not know."""

import numpy as np
import pytest
from blocks import COMM
from scipy.optimize import brentq

import growthx as gx
from benchmarks.accuracy import febio

FORCE, C, PLATE, K, B, LOW, HIGH, START = 8.0, 100.0, 40.0, 0.02, 1.2, 0.1, 1.74, 1.2
PLACES = [(x, y, z) for x in (0, 1, 2) for y in (0, 1) for z in (0, 1)]
CELLS = ["1,5,7,3,2,6,8,4", "5,9,11,7,6,10,12,8"]
SETS = {"foot": "1,2,3,4", "side": "1,2,5,6,9,10", "edge": "1,5,9", "end": "9,10,11,12"}


def text(**changes):
    """A cube of bone and one of a plate in a row, without transverse contraction, pulled at four nodes."""
    nodes = "".join(f'<node id="{i}">{x},{y},{z}</node>' for i, (x, y, z) in enumerate(PLACES, start=1))
    parts = "".join(
        f'<Elements type="hex8" name="part{i}"><elem id="{i}">{cell}</elem></Elements>'
        for i, cell in enumerate(CELLS, start=1)
    )
    sets = "".join(
        f'<NodeSet name="{name}">{"".join(f"""<n id="{node}"/>""" for node in nodes.split(","))}</NodeSet>'
        for name, nodes in SETS.items()
    )
    held = (("foot", "x"), ("side", "y"), ("edge", "z"))
    bcs = "".join(f'<bc type="fix" node_set="{name}"><dofs>{dofs}</dofs></bc>' for name, dofs in held)
    words = {
        "version": "3.0",
        "solid": "Carter-Hayes (old)",
        "plate": "neo-Hookean",
        "curve": "SMOOTH",
        "points": "<point>0,0</point><point>0.5,1</point>",
        **changes,
    }
    return (
        f'<febio_spec version="{words["version"]}"><Control><time_steps>8</time_steps><step_size>0.25</step_size>'
        f'</Control><Material><material id="1" name="bone" type="remodeling solid"><min_density>{LOW}</min_density>'
        f'<max_density>{HIGH}</max_density><solid type="{words["solid"]}"><density>{START}</density><c>{C}</c>'
        f'<gamma>3</gamma><v>0</v></solid><supply type="Huiskes-supply"><B>{B}</B><k>{K}</k></supply></material>'
        f'<material id="2" name="plate" type="{words["plate"]}"><density>1</density><E>{PLATE}</E><v>0</v></material>'
        f'</Material><Mesh><Nodes name="all">{nodes}</Nodes>{parts}{sets}</Mesh><MeshDomains>'
        '<SolidDomain name="part1" mat="bone"/><SolidDomain name="part2" mat="plate"/></MeshDomains>'
        f"<Boundary>{bcs}</Boundary>"
        f'<Loads><nodal_load node_set="end"><dof>x</dof><scale lc="3">{FORCE / 4}</scale></nodal_load></Loads>'
        f'<LoadData><load_controller id="3" type="loadcurve"><interpolate>{words["curve"]}</interpolate><points>'
        f"{words['points']}</points></load_controller></LoadData></febio_spec>"
    )


def put(folder, **changes):
    if COMM.rank == 0:
        (folder / "bar.feb").write_text(text(**changes))
    COMM.barrier()
    return folder / "bar.feb"


def stretch(stress, young):
    """Of a bar with P = E/2 [λ − 1/λ]."""
    half = stress / young
    return half + np.sqrt(half**2 + 1)


def by_hand():
    """Norm of the displacements of all nodes, and the density, after eight steps of implicit Euler."""
    density = START
    for step in range(1, 9):
        stress = FORCE * min(1.0, step * 0.25 / 0.5)

        def missing(rho, old=density, stress=stress):
            length = stretch(stress, C * rho**3)
            energy = C * rho**3 / 2 * ((length**2 - 1) / 2 - np.log(length))
            return rho - old - 0.25 * B * (energy / rho - K)

        if missing(LOW) * missing(HIGH) < 0:
            density = brentq(missing, LOW, HIGH, xtol=1e-15)
        else:
            density = HIGH if missing(HIGH) < 0 else LOW
    near = stretch(FORCE, C * density**3) - 1
    far = near + stretch(FORCE, PLATE) - 1
    return np.sqrt(4 * near**2 + 4 * far**2), density


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1P0], ids=lambda variant: variant.name)
def test_a_model_ends_where_its_scalar_solution_does(shared_folder, variant):
    """Two materials, nodal forces with their curve, supports of faces and of nodes, and the law with m = 1."""
    scene = febio.model(put(shared_folder))
    problem = gx.discretise(scene, variant)
    *_, last = gx.march(scene, variant, problem, tolerance=1e-12)
    size, density = by_hand()
    assert LOW < density < HIGH and abs(density - START) > 0.1
    assert febio.norm(problem) == pytest.approx(size, rel=1e-10)
    assert [last.min_density, last.max_density] == pytest.approx([density, density], rel=1e-10)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"version": "4.0"}, "is a model of version 4.0: one of 3.0 would be right"),
        ({"solid": "Carter-Hayes"}, "is a 'Carter-Hayes' with a 'Huiskes-supply': a 'Carter-Hayes \\(old\\)'"),
        ({"plate": "Mooney-Rivlin"}, "the materials of .* are Mooney-Rivlin, remodeling solid"),
        ({"points": "<point>0,0</point><point>1,1</point><point>2,0</point>"}, "a load curve of .* has 3 points"),
        ({"version": '3.0"><Extra/'}, "is not whole, as XML"),
    ],
)
def test_what_it_does_not_know_it_says(shared_folder, changes, told):
    """One sentence."""
    with pytest.raises(gx.InputError, match=told):
        febio.model(put(shared_folder, **changes))
