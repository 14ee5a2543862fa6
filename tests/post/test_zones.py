"""Means over zones: known exactly for simple densities, and to 0.5 % in the femur's thin cortices."""

from types import SimpleNamespace

import dolfinx
import numpy as np
import pytest
from blocks import COMM, cube, square

from growthx import meshing, zones
from growthx.common.errors import InputError
from growthx.discretisation.measures import Probes
from growthx.discretisation.variants import CATALOGUE, Q1, Q1P0, Q1Q1
from growthx.meshing.mesh import Mesh
from growthx.post.zones import area_means
from growthx.scenes.femur import outline
from growthx.scenes.femur import zones as femur_zones

POLYGONS = {
    "all": np.array([[-1, -1], [2, -1], [2, 2], [-1, 2]]),
    "left": np.array([[-1, -1], [0.5, -1], [0.5, 2], [-1, 2]]),
    "corner": np.array([[0, 0], [0.6, 0], [0, 0.9]]),
    "clockwise": np.array([[0.2, 0.2], [0.2, 0.7], [0.9, 0.7], [0.9, 0.2]]),
}
CENTROIDS = {"all": (0.5, 0.5), "left": (0.25, 0.5), "corner": (0.2, 0.3), "clockwise": (0.55, 0.45)}


def grown(mesh, variant, density):
    """What `area_means` needs of a discretised scene, with a density given as a function of position."""
    space = dolfinx.fem.functionspace(mesh.domain, variant.density_element(mesh.cell_name))
    function = dolfinx.fem.Function(space)
    function.interpolate(density)
    scene, cells = SimpleNamespace(mesh=mesh), space.dofmap.list[: len(mesh.owned_cells)]
    spaces = SimpleNamespace(scene=scene, variant=variant, density_space=space, comm=COMM)
    state = SimpleNamespace(densities_of_cells=lambda: function.x.array[cells])
    problem = SimpleNamespace(scene=scene, variant=variant, density_space=space, density=function, comm=COMM)
    problem.cells_of = lambda regions: mesh.owned_cells
    problem.density_at = Probes(spaces, state, None).density_at
    return problem


@pytest.fixture(scope="module", params=["quadrilaterals", "triangles"])
def mesh(request):
    """The unit square in 6 × 6 distorted quadrilaterals, or in triangles."""
    if request.param == "quadrilaterals":
        return square(cells=6, distortion=0.05)
    return Mesh.with_names(dolfinx.mesh.create_unit_square(COMM, 6, 6, dolfinx.mesh.CellType.triangle), {})


@pytest.mark.parametrize("variant", CATALOGUE.values(), ids=lambda variant: variant.name)
def test_a_constant_is_its_own_mean(mesh, variant):
    """Whatever a zone cuts through: no weight may be lost or counted twice."""
    means = area_means(grown(mesh, variant, lambda x: np.full(x.shape[1], 1.7)), POLYGONS)
    assert means == pytest.approx(dict.fromkeys(POLYGONS, 1.7), rel=1e-13)


def test_the_mean_of_a_linear_density_is_its_value_at_the_centroid(mesh):
    """It is a mean over area: counting samples alone would favour regions of small cells."""
    means = area_means(grown(mesh, Q1Q1, lambda x: 1 + 2 * x[0] - 0.5 * x[1]), POLYGONS)
    for name, (x, y) in CENTROIDS.items():
        assert means[name] == pytest.approx(1 + 2 * x - 0.5 * y, rel=5e-3)


@pytest.mark.parametrize(("variant", "error"), [(Q1P0, 0.0), (Q1, 0.0)], ids=["Q1P0", "Q1"])
def test_local_densities_count_with_their_part_of_the_cell(variant, error):
    """On squares the mean over a whole cell of a linear density is exact for a density per cell and per quarter."""
    problem = grown(square(cells=4), variant, lambda x: 1 + 2 * x[0] - 0.5 * x[1])
    zone = {"cells": np.array([[0.25, 0.5], [0.75, 0.5], [0.75, 1.0], [0.25, 1.0]])}
    assert area_means(problem, zone)["cells"] == pytest.approx(1 + 2 * 0.5 - 0.5 * 0.75, rel=1e-13)


def test_a_jump_between_cells_is_not_smeared():
    """The zone takes half of each of two cells: cell averages give their mean, centroids would give all or nothing."""
    problem = grown(square(cells=2), Q1P0, lambda x: np.where(x[0] < 0.5, 1.0, 3.0))
    zone = {"across": np.array([[0.25, 0.0], [0.75, 0.0], [0.75, 1.0], [0.25, 1.0]])}
    assert area_means(problem, zone)["across"] == pytest.approx(2.0, rel=1e-13)


def test_only_the_part_inside_the_body_counts(mesh):
    """Zones of an own mesh may stick out of it: what lies outside has no density, not a density of zero."""
    zone = {"half out": np.array([[0.5, 0.25], [1.5, 0.25], [1.5, 0.75], [0.5, 0.75]])}
    assert area_means(grown(mesh, Q1Q1, lambda x: x[0]), zone)["half out"] == pytest.approx(0.75, rel=2e-3)


def test_a_zone_outside_the_mesh_is_refused(mesh):
    """0/0 would be NaN in the table; on several ranks most zones lie outside of most ranks' cells."""
    problem = grown(mesh, Q1P0, lambda x: 1 + x[0])
    with pytest.raises(InputError, match=r"^the zone 'tail' lies outside the mesh: a polygon that overlaps it "):
        area_means(problem, {"all": POLYGONS["all"], "tail": POLYGONS["all"] + 9})


BODIES = {
    "all": np.array([[x, y, z] for x in (-1, 2) for y in (-1, 2) for z in (-1, 2)]),
    "box": np.array([[x, y, z] for x in (0.2, 0.9) for y in (0.1, 0.6) for z in (0.3, 0.8)]),
    "tetrahedron": np.array([[0, 0, 0], [0.9, 0, 0], [0, 0.9, 0], [0, 0, 0.9]]),
}
MIDDLES = {"all": (0.5, 0.5, 0.5), "box": (0.55, 0.35, 0.55), "tetrahedron": (0.225, 0.225, 0.225)}


@pytest.fixture(params=["tetrahedron", "hexahedron"])
def solid(request):
    """The unit cube, in distorted cells."""
    return cube(cells=5, distortion=0.03, shape=request.param)


def test_a_constant_is_its_own_mean_in_space(solid):
    """As in the plane, whatever a zone cuts through."""
    means = area_means(grown(solid, Q1P0, lambda x: np.full(x.shape[1], 1.7)), BODIES)
    assert means == pytest.approx(dict.fromkeys(BODIES, 1.7), rel=1e-13)


def test_the_mean_of_a_linear_density_is_its_value_at_the_centroid_in_space(solid):
    """A mean over volume, of bodies whose corners come in any order."""
    means = area_means(grown(solid, Q1Q1, lambda x: 1 + 2 * x[0] - 0.5 * x[1] + x[2]), BODIES)
    for name, (x, y, z) in MIDDLES.items():
        assert means[name] == pytest.approx(1 + 2 * x - 0.5 * y + z, rel=1e-2), name


def test_parts_of_a_tetrahedron_have_one_volume():
    """Else samples would not count alike; their middles have the middle of the whole."""
    corners = zones.reference_corners("tetrahedron")
    parts = zones._halved(corners[np.newaxis], 2)
    volumes = np.abs(np.linalg.det(parts[:, 1:] - parts[:, :1])) / 6
    assert volumes == pytest.approx(np.full(64, 1 / 6 / 64), rel=1e-12)
    middles = zones._sample_points("tetrahedron")
    assert middles.min() > 0 and middles.sum(axis=1).max() < 1
    assert middles.mean(axis=0) == pytest.approx([0.25, 0.25, 0.25])


@pytest.mark.parametrize(
    ("zone", "sentence"),
    [
        (POLYGONS["all"], r"^the corners of the zone 'z' are of shape \(4, 2\): shape \(corners, 3\), a row for each"),
        (np.eye(3), "^the corners of the zone 'z' are 3: four or more would be right"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], "^the corners of the zone 'z' lie in a plane: those of a body"),
        (BODIES["all"] + 9, "^the zone 'z' lies outside the mesh: a body that overlaps it would be right"),
    ],
    ids=["polygon", "three", "flat", "outside"],
)
def test_bodies_that_are_none_are_refused(solid, zone, sentence):
    """A polygon is none in space, and nor is what has no volume."""
    with pytest.raises(InputError, match=sentence):
        area_means(grown(solid, Q1P0, lambda x: 1 + x[0]), {"z": zone})


@pytest.mark.parametrize("variant", [Q1Q1, Q1P0, Q1], ids=lambda variant: variant.name)
def test_femur_zones_to_half_a_per_cent(monkeypatch, variant):
    """The cortices are as thin as a cell, and density falls off there: twice the samples must change little."""
    mesh = meshing.read(meshing.locate("femur_658.msh"))
    shell = outline()

    def cortex(x):
        """Dense within 4 mm of the outline's control polygon, spongy inside."""
        ends = np.roll(shell, -1, axis=0) - shell
        to = x[:2].T[:, np.newaxis] - shell
        along = np.clip(np.sum(to * ends, axis=2) / np.sum(ends**2, axis=1), 0, 1)
        depth = np.linalg.norm(to - along[..., np.newaxis] * ends, axis=2).min(axis=1)
        return 0.2 + 1.8 / (1 + np.exp((depth - 4) / 0.5))

    problem = grown(mesh, variant, cortex)
    coarse = area_means(problem, femur_zones())
    monkeypatch.setattr(zones, "SAMPLES", 48)
    fine = area_means(problem, femur_zones())
    assert fine["med_cortex"] > 2 * fine["ward"]  # the density does vary
    assert coarse == pytest.approx(fine, rel=5e-3)
