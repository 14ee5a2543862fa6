"""The femur's loads, zones and outline: forces exact on every mesh, and where they should be."""

from dataclasses import replace

import dolfinx
import numpy as np
import pytest
from blocks import gathered, square

import growthx as gx
from growthx import meshing, variants
from growthx.common.errors import InputError
from growthx.post.zones import area_means
from growthx.scenes.femur import AVERAGE, SUPERPOSED, Combination, abductor_weight, combination, femur, outline, zones

# Spec §4: joint N, angle, abductor N, angle; degrees from the vertical.
TABLE = {
    "midstance of gait": (2317, 24, 703, 28),
    "extreme abduction": (1158, -15, 351, -8),
    "extreme adduction": (1548, 56, 468, 35),
}
HEAD = np.array([43.0, 132.0])
ONE_CASE = {name: tuple(float(name == other) for other in TABLE) for name in TABLE}


def forces(name):
    """The two forces (N) of a load case: the joint presses down and laterally, the abductor pulls up and medially."""
    joint, a, abductor, b = TABLE[name]
    a, b = np.radians([a, b])
    return -joint * np.array([np.sin(a), np.cos(a)]), abductor * np.array([np.sin(b), np.cos(b)])


def resultant(scene, variant=None):
    """Sum of the nodal load (N per mm of thickness)."""
    discretised = gx.discretise(scene, variant or variants.default(scene.mesh.cell_name))
    return discretised.system.loads.resultant(discretised.system.loads.nodal_load)


def joint_weight(name):
    """Weight of a case's joint force, from the scene."""
    mesh = meshing.read(meshing.locate("femur_658.msh"))
    return femur(mesh, weights=ONE_CASE[name]).loads[0].weight


@pytest.fixture(scope="module", params=["658 cells", "size 5", "triangles"])
def mesh(request):
    """Three meshes of the femur."""
    if request.param == "658 cells":
        return femur().mesh
    return femur(size=5.0, shape="triangle" if request.param == "triangles" else "quadrilateral").mesh


@pytest.fixture(scope="module")
def surface():
    """Middles of the surface's facets on all ranks, shape (facets, 2)."""
    mesh = meshing.read(meshing.locate("femur_658.msh"))
    middles = dolfinx.mesh.compute_midpoints(mesh.domain, 1, mesh.boundary("surface"))
    return np.unique(gathered(middles[:, :2]).round(9), axis=0)


@pytest.mark.parametrize("name", TABLE)
def test_each_force_of_each_case_is_the_tables(mesh, name):
    """Tractions on facets are never quite the force wanted: its nodal forces must add up to it all the same."""
    scene = femur(mesh, weights=ONE_CASE[name], thickness=25.0)
    assert [load.case for load in scene.loads] == [name, name]
    for load, force in zip(scene.loads, forces(name), strict=True):
        error = 25.0 * resultant(replace(scene, loads=(load,))) - force
        assert np.linalg.norm(error) <= 1e-12 * np.linalg.norm(force)


@pytest.mark.parametrize("weights", [AVERAGE, SUPERPOSED, (0.0, 1.5, 0.25)])
def test_cases_are_superposed_with_their_weights(mesh, weights):
    """The average of the daily cycles and the plain sum are both linear in the cases."""
    expected = sum(weight * sum(forces(name)) for weight, name in zip(weights, TABLE, strict=True))
    error = 30.0 * resultant(femur(mesh, weights=weights)) - expected
    assert np.linalg.norm(error) <= 1e-12 * np.linalg.norm(expected)


@pytest.mark.parametrize(
    "variant", [v for v in variants.CATALOGUE.values() if v not in variants.DEFAULTS], ids=lambda variant: variant.name
)
def test_resultants_are_exact_whatever_the_unknowns(variant):
    """Densities between the displacements are no forces, and those of serendipity are moments along the edges."""
    expected = sum(forces("midstance of gait"))
    scene = femur(size=8.0, shape=variant.cells[0], weights=ONE_CASE["midstance of gait"])
    error = 30.0 * resultant(scene, variant) - expected
    assert np.linalg.norm(error) <= 1e-12 * np.linalg.norm(expected)


@pytest.mark.parametrize("name", TABLE)
def test_the_joint_presses_on_the_head_only(surface, name):
    """±35° of the head's arc about the direction the force comes from, cosine-shaped, nothing elsewhere."""
    values = joint_weight(name)(np.vstack([surface.T, np.zeros(len(surface))]))
    loaded = surface[values > 0] - HEAD
    assert len(loaded) >= 9
    assert np.allclose(np.hypot(*loaded.T), 24.0, atol=0.1)
    angle = np.degrees(np.arctan2(loaded[:, 1], loaded[:, 0])) - (90 - TABLE[name][1])
    assert np.abs(angle).max() < 35 and np.abs(angle).max() > 30
    assert np.allclose(values[values > 0], np.cos(np.radians(90 * angle / 35)), rtol=0, atol=1e-12)


def test_the_abductors_pull_at_the_greater_trochanter_only(surface):
    """Control points 45 to 52 of the outline, half a sine along the arc, nothing on the shaft, neck or head."""
    values = abductor_weight(np.vstack([surface.T, np.zeros(len(surface))]))
    points = outline()
    loaded = surface[values > 1e-9]
    assert len(loaded) > 10 and values.min() >= 0 and 0.98 < values.max() <= 1
    assert (loaded >= points[45:53].min(axis=0) - 1).all() and (loaded <= points[45:53].max(axis=0) + 1).all()
    at_points = abductor_weight(np.vstack([points.T, np.zeros(len(points))]))
    assert np.allclose(at_points[[45, 52]], 0, atol=1e-12) and (at_points[46:52] > 0.1).all()
    assert not at_points[:44].any() and not at_points[54:].any()
    along = np.append(0, np.cumsum(np.hypot(*np.diff(points[45:53], axis=0).T)))
    assert np.allclose(at_points[45:53], np.sin(np.pi * along / along[-1]), atol=0.02)


def test_the_published_setting():
    """Spec §4: every default is part of the numbers."""
    scene = femur(meshing.locate("femur_658.msh"))
    assert (scene.mesh.cell_count, set(scene.mesh.boundaries)) == (658, {"surface", "distal"})
    assert scene.material == gx.Material(young=500.0, poisson=0.2, reference_density=1.2, density_exponent=2.0)
    assert scene.growth == gx.EnergyDrivenGrowth(attractor=0.01, rate=1.0, exponent=3.0)
    assert scene.supports == (gx.Support("distal"),) and len(scene.loads) == 6
    times = scene.program.times()
    assert len(times) == 40 and times[-1] == 160.0 and scene.program.ramp == 20.0


def test_a_case_without_weight_has_no_load():
    """A force of zero cannot be scaled to its resultant."""
    assert len(femur(meshing.locate("femur_658.msh"), weights=(1.0, 0.0, 0.0)).loads) == 2


def test_zones_by_name(mesh):
    """The table of zone means is compared by name, and each polygon must lie in the bone on every mesh."""
    assert set(zones()) == {
        *("strut", "calcar", "ward", "arcuate", "lat_cortex", "med_cortex"),
        *("canal", "gt_tip", "head_superolateral", "head_inferomedial"),
    }
    means = area_means(gx.discretise(femur(mesh), variants.default(mesh.cell_name)), zones())
    assert means == pytest.approx(dict.fromkeys(zones(), 1.2), rel=1e-13)


def test_outline():
    """63 control points, anticlockwise from the distal medial corner."""
    x, y = outline().T
    assert len(x) == 63 and y[0] == y[-1] == y.min() and x[0] > x[-1]
    assert np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) > 0


def test_combinations_by_name():
    """The command line names them."""
    assert combination("average") == Combination((0.6, 0.2, 0.2))
    assert combination("superposed") == Combination((1.0, 1.0, 1.0))
    assert combination("stimulus") == Combination((0.6, 0.2, 0.2), separate=True)
    with pytest.raises(InputError) as caught:
        combination("mean")
    assert (
        str(caught.value) == "there is no load combination 'mean': one of average, superposed, stimulus would be right"
    )


@pytest.mark.parametrize(
    ("parameters", "sentence"),
    [
        ({"thickness": 0.0}, "the thickness (mm) is 0: a positive number would be right"),
        ({"thickness": float("nan")}, "the thickness (mm) is nan: a positive number would be right"),
        ({"size": -1.0}, "the cell size (mm) is -1: a positive number would be right"),
        ({"weights": (1.0, -0.5, 0.0)}, "the weight of a load case is -0.5: a number of at least 0 would be right"),
        ({"weights": (1.0, 0.5)}, "the weights of the load cases are (1.0, 0.5): 3 numbers would be right"),
        ({"weights": (0.0, 0.0, 0.0)}, "no load case of the femur has a weight: one above 0 would be right"),
    ],
)
def test_impossible_parameters_are_refused(parameters, sentence):
    """Before the mesh is made, which takes longest."""
    with pytest.raises(InputError) as caught:
        femur(**parameters)
    assert str(caught.value) == sentence


def test_an_own_mesh_needs_the_femurs_boundaries():
    """A mesh of something else must not be loaded somewhere by chance."""
    with pytest.raises(InputError, match=r"^the mesh has no boundary named 'distal'; it has 'bottom', 'left', "):
        femur(square())


def test_a_force_without_a_place_is_refused():
    """A force beside its boundary is an error, not zero: whatever is done to a scene's loads afterwards."""
    scene = femur(size=9.0)
    beside = replace(scene.loads[0], on="distal")
    with pytest.raises(InputError, match=r"^the force \(.*\) on 'distal' has no weight there: a positive one is "):
        gx.discretise(replace(scene, loads=(beside,)), gx.Q1P0)


# -- its mesh ----------------------------------------------------------------------------------------------------------


def test_the_default_mesh_is_the_papers_on_every_gmsh():
    """658 cells come from a file, since versions of gmsh differ; a size, or triangles, ask gmsh."""
    own = femur().mesh
    assert (own.cell_name, own.cell_count, own.domain.geometry.index_map().size_global) == ("quadrilateral", 658, 725)
    triangles, coarse = femur(shape="triangle").mesh, femur(size=7.0).mesh
    assert triangles.cell_name == "triangle" and 1.5 * 658 < triangles.cell_count < 2.5 * 658
    assert coarse.cell_name == "quadrilateral" and coarse.cell_count < 300
    assert femur(refine=2).mesh.cell_count == 4 * 658


def test_unknown_cells_are_refused():
    """Before gmsh is started."""
    with pytest.raises(InputError) as caught:
        femur(shape="hexahedron")
    assert str(caught.value) == "there are no cells 'hexahedron' in the plane: quadrilateral or triangle would be right"
