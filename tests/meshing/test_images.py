"""Scans: where voxels are, what lies between them, and what their values mean as a density."""

import logging
import re
from dataclasses import replace

import dolfinx
import numpy as np
import pytest
from blocks import COMM, block, cube, gathered, run, square
from scans import CORTEX, MARROW, A, B, centres, linear, proximal_femur, skewed

import growthx as gx
from growthx.discretisation.variants import CATALOGUE
from growthx.meshing.fields import as_ufl
from growthx.meshing.sampling import positions, volume_ratios

NODAL = ("Q1Q1", "Q2Q2", "S2Q1", "P1P1", "P2P2", "P2P1")  # variants of shared nodes
variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)


def refused(make):
    """The one sentence of all ranks."""
    with pytest.raises(gx.InputError) as caught:
        make()
    (sentence,) = set(COMM.allgather(str(caught.value)))
    assert "\n" not in sentence
    return sentence


def still(mesh, start):
    """A block on a mesh that begins with a density."""
    return block(mesh, initial_density=start)


# -- voxels ------------------------------------------------------------------------------------------------------------


def test_the_check_of_the_literature():
    """HU = 15 + 5x + 5y + 5z over [−1, 1]³ with a = 1.3152, b = 0.6944: ρ = 11.7312 where HU is 15."""
    affine = np.diag([0.5, 0.5, 0.5, 1.0])
    affine[:3, 3] = -1.0
    values = 15 + 5 * centres(affine, (5, 5, 5)).sum(axis=-1)
    density = gx.ct.from_array(values, affine).density(a=1.3152, b=0.6944, largest=np.inf)
    places = np.array([[0, 0, 0], [0.3, -0.1, -0.2], [1, -1, 0]]).T
    assert density(places) == pytest.approx([11.7312] * 3, rel=1e-14)


@pytest.mark.parametrize("orientation", ["RAS", "LPS"])
def test_linear_between_voxels_whatever_their_axes(orientation):
    """Order, sense, spacing and turn of the axes must not be mixed up: a linear field is found exactly."""
    scan, exact = linear(orientation=orientation)
    x = np.random.default_rng(0).uniform(size=(3, 200))
    assert scan.density(a=A, b=B)(x) == pytest.approx(A + B * exact(x), rel=1e-12)
    other = scan.to("LPS" if orientation == "RAS" else "RAS")
    assert other.density(a=A, b=B)(x * [[-1], [-1], [1]]) == pytest.approx(A + B * exact(x), rel=1e-12)


def test_voxels_and_no_more():
    """At the centre of a voxel it has its value; half a voxel beyond the last one it has none, as on the far side."""
    affine, shape = skewed()
    values = np.random.default_rng(1).uniform(0, 1000, size=shape)
    density = gx.ct.from_array(values, affine).density(a=A, b=B)
    there = centres(affine, shape)
    assert density(there.reshape(-1, 3).T) == pytest.approx(A + B * values.ravel(), rel=1e-9)
    for corner, inwards in ((there[0, 0, 0], affine[:3, 0]), (there[-1, -1, -1], -affine[:3, 0])):
        density((corner + 0.01 * inwards)[:, np.newaxis])
        with pytest.raises(gx.InputError, match=r"1 of 1 points \(100 %\) lie outside .* scan"):
            density((corner - 0.01 * inwards)[:, np.newaxis])


def test_a_registration_moves_the_scan():
    """What was at x is found at its new place."""
    scan, exact = linear()
    matrix = np.array([[0.0, -1, 0, 3], [1, 0, 0, -2], [0, 0, 1, 5], [0, 0, 0, 1]])
    x = np.random.default_rng(0).uniform(size=(3, 20))
    moved = (matrix @ np.vstack([x, np.ones(20)]))[:3]
    assert scan.moved(matrix).density(a=A, b=B)(moved) == pytest.approx(A + B * exact(x), rel=1e-12)


# -- as a field --------------------------------------------------------------------------------------------------------


@variants
@pytest.mark.parametrize("dim", [2, 3])
def test_exact_on_a_linear_field_for_every_variant(variant, dim):
    """Where each density is, it is what the scan says there; in the plane, in a slice."""
    if dim == 3 and variant.cells[0] == "quadrilateral" and variant.name.startswith("S2"):
        pytest.skip("serendipity cells are plane")
    scan, exact = linear()
    shape = variant.cells[dim - 2] if len(variant.cells) > dim - 2 else None
    if shape is None:
        pytest.skip("no such cells")
    mesh = square(2, 0.1, shape=shape) if dim == 2 else cube(1, 0.1, shape=shape)
    density = scan.density(a=A, b=B, z=0.5 if dim == 2 else None)
    problem = gx.discretise(still(mesh, density), variant)
    x = problem.density_positions()[: problem.density_space.dofmap.index_map.size_local]
    if dim == 2:
        x[:, 2] = 0.5
    there = np.isfinite(x[:, 0])
    found = problem.density.x.array[: len(x)]
    assert found[there] == pytest.approx(A + B * exact(x[there].T), rel=1e-10)


@pytest.mark.parametrize("shape", ["quadrilateral", "triangle", "hexahedron", "tetrahedron"])
def test_means_of_cells(shape):
    """The mean of a linear field is that of the cell's integral; that of E ∝ ρ² is its own, above the square's."""
    scan, exact = linear()
    plane = shape in ("quadrilateral", "triangle")
    mesh = square(2, 0.1, shape=shape) if plane else cube(1, shape=shape)
    z = 0.5 if plane else None
    one = gx.discretise(still(mesh, 1.0), gx.Q1P0 if shape in ("quadrilateral", "hexahedron") else gx.P1P0)
    from basix import CellType, make_quadrature

    X, weights = (np.asarray(part) for part in make_quadrature(CellType[shape], 6))
    x = positions(mesh, X)
    if plane:
        x[:, :, 2] = 0.5
    volumes = weights * volume_ratios(mesh, X)
    rho = A + B * exact(x.reshape(-1, 3).T).reshape(volumes.shape)
    for by, power in (("mean", 1), ("modulus", 2)):
        field = as_ufl(scan.density(a=A, b=B, by=by, z=z), mesh)
        found = one.evaluate(field, X[:1])[:, 0]
        means = np.sum(volumes * rho**power, axis=1) / volumes.sum(axis=1)
        assert found == pytest.approx(means ** (1 / power), rel=1e-10)


@pytest.mark.parametrize("by", ["mean", "modulus"])
@pytest.mark.parametrize("name", NODAL)
def test_means_at_nodes_are_exact_and_keep_the_mass(name, by):
    """Nodes that took the mean of the cells around them were off on every border; a field that bends keeps its mass."""
    variant = CATALOGUE[name]
    scan, exact = linear()
    mesh = square(3, 0.1, shape=variant.cells[0])
    density = scan.density(a=A, b=B, by=by, z=0.5, exponent=1.0)
    problem = gx.discretise(still(mesh, density), variant)
    x = problem.density_positions()[: problem.density_space.dofmap.index_map.size_local]
    x[:, 2] = 0.5
    there = np.isfinite(x[:, 0])
    assert problem.density.x.array[: len(x)][there] == pytest.approx(A + B * exact(x[there].T), rel=1e-10)
    bent = gx.ct.from_array(scan.voxels.values**2 / 500, scan.voxels.affine).density(a=A, b=B, by=by, z=0.5)
    in_cells = gx.variants.default(variant.cells[0])
    masses = [gx.discretise(still(mesh, bent), each).mass() for each in (variant, in_cells)]
    assert masses[0] == pytest.approx(masses[1], rel=1e-4 if by == "mean" else 0.01)


def test_means_at_nodes_beside_what_rests():
    """Nodes between bone and metal have the density of bone, by its cells alone."""
    scan, exact = linear()
    density = {"bone": scan.density(a=A, b=B, by="mean", z=0.5), "implant": 4.5}
    problem = gx.discretise(replace(still(square(4), density), growing=("bone",)), gx.Q1Q1)
    x = problem.density_positions()[problem.growing_dofs]
    x[:, 2] = 0.5
    assert problem.density.x.array[problem.growing_dofs] == pytest.approx(A + B * exact(x.T), rel=1e-10)


def region_masses(problem, power=1.0):
    """∫ ρ^power over each region, by a rule of its own."""
    from basix import CellType, make_quadrature

    mesh = problem.scene.mesh
    X, weights = (np.asarray(part) for part in make_quadrature(CellType[mesh.cell_name], 8))
    owned = len(mesh.owned_cells)
    of_cells = (weights * volume_ratios(mesh, X) * problem.density_at(X) ** power).sum(axis=1)
    regions = {name: mesh.region(name) for name in ("bone", "implant")}
    return {name: COMM.allreduce(of_cells[cells[cells < owned]].sum()) for name, cells in regions.items()}


@pytest.mark.parametrize("ways", [("mean", "mean"), ("point", "mean"), ("modulus", "modulus"), ("modulus", "mean")])
@pytest.mark.parametrize("name", NODAL)
def test_regions_of_two_scans_keep_a_linear_field(name, ways):
    """What both scans say alike must not change where one ends and the other begins, and not at borders."""
    variant = CATALOGUE[name]
    scan, exact = linear()
    other = gx.ct.from_array(scan.voxels.values * 2, scan.voxels.affine)
    density = {
        "bone": scan.density(a=A, b=B, by=ways[0], z=0.5, density_exponent=1.0),
        "implant": other.density(a=A, b=B / 2, by=ways[1], z=0.5, density_exponent=1.0),
    }
    problem = gx.discretise(still(square(4, shape=variant.cells[0]), density), variant)
    x = problem.density_positions()[: problem.density_space.dofmap.index_map.size_local]
    x[:, 2] = 0.5
    there = np.isfinite(x[:, 0])
    assert problem.density.x.array[: len(x)][there] == pytest.approx(A + B * exact(x[there].T), rel=1e-9)


@pytest.mark.parametrize("beside", ["scan", "point", "number", "function"])
@pytest.mark.parametrize("name", NODAL)
def test_each_region_keeps_its_own_mass(name, beside):
    """A jump is met by no continuous density, but no region may gain by it what its neighbour loses."""
    variant = CATALOGUE[name]
    scan, _ = linear()
    other = gx.ct.from_array(scan.voxels.values * 1.7, scan.voxels.affine)
    density = {
        "bone": scan.density(a=A, b=B, by="mean", z=0.5, floor=0.01),
        "implant": {
            "scan": other.density(a=A, b=B, by="mean", z=0.5),
            "point": other.density(a=A, b=B, z=0.5),
            "number": 1.9,
            "function": lambda x: 1.5 + 0.1 * x[1],
        }[beside],
    }
    mesh = square(4, 0.0, shape=variant.cells[0])
    found = region_masses(gx.discretise(still(mesh, density), variant))
    of_cells = region_masses(gx.discretise(still(mesh, density), gx.variants.default(variant.cells[0])))
    assert found == pytest.approx(of_cells, rel=1e-9)
    assert abs(of_cells["bone"] - of_cells["implant"]) > 0.1 * of_cells["bone"]


@pytest.mark.parametrize("name", ["Q1Q1", "P1P1"])
def test_regions_by_modulus_keep_their_stiffness(name):
    """Of two scans by modulus, ∫ E ∝ ρⁿ of each region; by unlike ways, the mass that the means of cells have."""
    variant = CATALOGUE[name]
    scan, _ = linear()
    other = gx.ct.from_array(scan.voxels.values * 1.7, scan.voxels.affine)
    mesh = square(6, shape=variant.cells[0])
    for exponents, power in (((2.0, 2.0), 2.0), ((2.0, 3.0), 1.0)):
        density = {
            region: each.density(a=A, b=B, by="modulus", z=0.5, density_exponent=exponent)
            for region, each, exponent in zip(("bone", "implant"), (scan, other), exponents, strict=True)
        }
        problem = gx.discretise(still(mesh, density), variant)
        in_cells = gx.discretise(still(mesh, density), gx.variants.default(variant.cells[0]))
        expected = region_masses(in_cells, power)
        problem.density.x.array[:] **= power  # the function whose integral was kept is linear in E, not in ρ
        assert region_masses(problem) == pytest.approx(expected, rel=1e-9)


def test_regions_of_scans_that_leave_cells_out():
    """Cells without a start are named, as they are where no scan is among the regions."""
    scan, _ = linear()
    with pytest.raises(gx.InputError, match="no value in 8 of 16 cells"):
        gx.discretise(still(square(4), {"bone": scan.density(a=A, b=B, by="mean", z=0.5)}), gx.Q1Q1)


def test_means_see_what_points_miss():
    """Dense voxels off the middle of a cell have their share in the cell's mean, and a larger one in that of E."""
    values = np.full((7, 7, 7), 100.0)
    values[1:3, 1:3, 1:3] = 1500.0  # which have neighbours to all sides, so that each counts for a whole voxel
    scan = gx.ct.from_array(values, np.diag([1 / 6, 1 / 6, 1 / 6, 1.0]))
    mesh = cube(1)
    means = {
        by: gx.discretise(still(mesh, scan.density(a=A, b=B, by=by)), gx.Q1P0).mean_density()
        for by in ("point", "mean", "modulus")
    }
    assert means["point"] == pytest.approx(A + B * 100, rel=1e-12)
    exact = A + B * (100 + 1400 * 8 / 6**3)
    assert means["mean"] == pytest.approx(exact, rel=1e-12) and means["mean"] > 1.01 * means["point"]
    assert means["modulus"] > 1.05 * means["mean"]


def test_the_attractor_of_a_scan():
    """Any parameter that may vary takes it, with one value in each cell, that of its middle; and so does a region."""
    scan, exact = linear()
    mesh = square(2)
    scene = replace(
        block(mesh),
        growth=gx.EnergyDrivenGrowth(attractor=scan.density(a=0, b=1e-5, z=0.5, floor=1e-4), rate=1.0),
        initial_density={"bone": scan.density(a=A, b=B, z=0.5), "implant": 4.0},
    )
    problem = gx.discretise(scene, gx.Q1P0)
    middles = positions(mesh, np.array([[0.5, 0.5]]))[:, 0]
    middles[:, 2] = 0.5
    at_middle = problem.evaluate(problem.growth.attractor, np.array([[0.5, 0.5]]))[:, 0]
    assert at_middle == pytest.approx(1e-5 * exact(middles.T), rel=1e-12)
    expected = np.where(middles[:, 0] < 0.5, A + B * exact(middles.T), 4.0)
    assert problem.densities_of_cells()[:, 0] == pytest.approx(expected, rel=1e-12)
    steps, _ = run(scene, gx.Q1P0)
    assert len(steps) == 4


def test_planes_of_a_plane_body():
    """x, y of the body are the two axes of the scan that the name of the plane says."""
    scan, exact = linear((100.0, 10.0, 1.0))
    x = np.array([[0.2], [0.7], [0.0]])
    for plane, place in (("axial", (0.2, 0.7, 0.4)), ("coronal", (0.2, 0.4, 0.7)), ("sagittal", (0.4, 0.2, 0.7))):
        assert scan.density(a=A, b=B, z=0.4, plane=plane)(x)[0] == pytest.approx(A + B * exact(np.array(place)))


def test_the_way_by_ash():
    """ρ_ash = c + d ρ_QCT, and so much ash for apparent density."""
    scan, exact = linear()
    x = np.array([[0.3], [0.3], [0.3]])
    found = scan.density(a=A, b=B, ash=(0.079, 0.877, 0.6))(x)
    assert found == pytest.approx((0.079 + 0.877 * (A + B * exact(x))) / 0.6)


def test_a_shaft_in_space():
    """The parametric femur as a scanner sees it: a dense cortex, an empty canal, and HU of soft tissue between none."""
    values, affine = proximal_femur(2.0)
    scan = gx.ct.from_array(values, affine)
    ends = [[27.0, -13.0, -110.0], [53.0, 13.0, -30.0]]
    mesh = gx.Mesh.with_names(
        dolfinx.mesh.create_box(COMM, ends, [13, 13, 4]), {"left": lambda x: np.isclose(x[2], -110.0)}
    )
    scene = replace(block(cube(1)), mesh=mesh, loads=(), initial_density=scan.density(a=A, b=B, by="mean"))
    problem = gx.discretise(scene, gx.P1P0)
    zones = {
        "canal": lambda x: np.hypot(x[0] - 40, x[1]) < 2,
        "cortex": lambda x: np.abs(np.hypot(x[0] - 40, x[1]) - 10) < 1.5,
    }
    found = gx.compare(problem, scan.density(a=A, b=B), zones=zones)
    assert found.zones["canal"].mean == pytest.approx(A + B * MARROW, rel=1e-3)
    assert found.zones["cortex"].mean == pytest.approx(A + B * CORTEX, rel=3e-2)
    assert found.pearson > 0.95 and abs(found.bias) < 0.01


def test_a_run_from_a_scan_goes_on(shared_folder):
    """A checkpoint knows the density that the scan gave: the same scan goes on with it, another is refused."""
    scan, _ = linear()
    scene = still(square(2), scan.density(a=A, b=B, z=0.5))
    gx.solve(
        replace(scene, program=gx.Program(step=0.1, until=0.2, ramp=0.2)),
        gx.Q1P0,
        out=shared_folder / "a",
        checkpoint=1,
        tolerance=1e-12,  # the factors of the two are of other times
    )
    again = gx.solve(scene, gx.Q1P0, resume=shared_folder / "a", tolerance=1e-12)
    assert again.problem.mass() == pytest.approx(gx.solve(scene, gx.Q1P0, tolerance=1e-12).problem.mass(), rel=1e-12)
    other = replace(scene, initial_density=scan.density(a=A, b=1.1 * B, z=0.5))
    with pytest.raises(gx.GrowthxError, match="the initial density"):
        gx.solve(other, gx.Q1P0, resume=shared_folder / "a", tolerance=1e-12)


# -- told --------------------------------------------------------------------------------------------------------------


def test_the_share_below_the_floor_is_told_once(caplog):
    """Fat and air have no density: they get the floor, and the user hears how many, with numbers of all ranks."""
    values, affine = proximal_femur(6.0)
    values = np.where(values < 100, -100, values)  # fat
    scan = gx.ct.from_array(values, affine)
    mesh = square(4, length=20.0)
    density = scan.density(a=A, b=B, z=-80.0, floor=0.03)
    with caplog.at_level(logging.WARNING, "growthx"):
        problem = gx.discretise(still(mesh, density), gx.Q1P0)
    low, _ = problem.density_range()
    messages = COMM.allgather([record.getMessage() for record in caplog.records])
    told = [text for of_rank in messages for text in of_rank if "floor" in text]
    below = int(np.sum(gathered(problem.densities_of_cells()[:, 0]) == 0.03))
    assert low == 0.03 and len(told) == 1
    assert f"{below} of 16 points" in told[0] and "down to -0.03" in told[0] and "floor, 0.03" in told[0]


@pytest.mark.parametrize("by", ["point", "mean", "modulus"])
def test_a_scan_that_does_not_cover_the_body(by):
    """The sentence counts over all ranks, says what share, and where."""
    scan, _ = linear()
    mesh = square(4, length=2.0)
    sentence = refused(lambda: gx.discretise(still(mesh, scan.density(a=A, b=B, z=0.5, by=by)), gx.Q1P0))
    count, _, total, *_ = sentence.split()
    assert 0.2 < int(count) / int(total) < 0.4 and f"{100 * int(count) / int(total):.3g} %" in sentence
    assert by != "point" or total == "16"  # one in each cell, counted once
    assert "lie outside the voxel centres of the scan, at (" in sentence


@pytest.mark.parametrize("by", ["point", "mean"])
@pytest.mark.parametrize("orientation", ["RAS", "LPS"])
def test_a_body_in_the_other_frame(orientation, by):
    """DICOM has x and y with the other sign: where that alone is wrong, the sentence names it, and it helps."""
    scan, exact = linear(orientation=orientation)
    other = "LPS" if orientation == "RAS" else "RAS"
    mesh = square(4)
    turned = scan.to(other)
    sentence = refused(lambda: gx.discretise(still(mesh, turned.density(a=A, b=B, z=0.5, by=by)), gx.Q1P0))
    assert "with the other sign of x and y all lie inside" in sentence and f"to('{orientation}')" in sentence
    found = gx.discretise(still(mesh, turned.to(orientation).density(a=A, b=B, z=0.5, by=by)), gx.Q1P0)
    assert found.mean_density() == pytest.approx(A + B * exact(np.array([0.5, 0.5, 0.5])), rel=1e-9)


def test_a_body_beside_the_bone_of_a_scan(caplog):
    """Inside the scan, but not where its bone is, as in a wrong frame or by a wrong registration: more than half of it
    is below the floor, and the notice says what that may mean."""
    values, affine = proximal_femur(6.0)
    density = gx.ct.from_array(np.where(values < 100, -100, values), affine).density(a=A, b=B, z=-80.0)
    for left, beside in ((28.0, False), (-20.0, True)):  # the shaft is at x = 40, and 26 wide
        caplog.clear()
        with caplog.at_level(logging.WARNING, "growthx"):
            density(np.vstack([np.linspace(left, left + 20, 20), np.zeros(20)]))
        found = [record.getMessage() for record in caplog.records]
        assert any("may not lie where the scan has it" in text for text in found) == beside  # each rank asks by itself


def test_densities_are_no_hounsfield_units():
    """A scan of densities already, with the calibration of HU, would be a body of one density: not in silence."""
    scan, _ = linear(gradient=(0.5, 0.2, 0.1), offset=0.4)
    mesh = square(4)
    for by in ("point", "mean", "modulus"):
        density = scan.density(a=A, b=B, z=0.5, by=by)
        sentence = refused(lambda density=density: gx.discretise(still(mesh, density), gx.Q1P0))
        assert "are taken for HU: they are densities already, it seems" in sentence
    assert gx.discretise(still(mesh, scan.density(a=0, b=1, z=0.5)), gx.Q1P0).mean_density() == pytest.approx(0.8)
    relative = scan.density(a=0, b=1.8, z=0.5)  # shares of the densest bone, say: neither
    assert gx.discretise(still(mesh, relative), gx.Q1P0).mean_density() == pytest.approx(1.44)


def test_hounsfield_units_are_no_density():
    """The commonest mistake: a = 0, b = 1, on a scan in HU."""
    values, affine = proximal_femur(6.0)
    mesh = square(4, length=20.0)
    for change, words in ((0, "reaches 700 at ("), (-1000, "they are HU, it seems")):
        scan = gx.ct.from_array(values + change, affine)
        sentence = refused(lambda scan=scan: gx.discretise(still(mesh, scan.density(a=0, b=1, z=0.0)), gx.Q1P0))
        assert words in sentence and "a and b" in sentence


GOOD = np.ones((3, 3, 3))
SINGULAR = np.diag([1.0, 1.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: gx.ct.from_array(np.ones((3, 3, 3, 2)), np.eye(4)), r"shape \(3, 3, 3, 2\): one image of three"),
        (lambda: gx.ct.from_array(np.ones((3, 3)), np.eye(4)), r"shape \(3, 3\)"),
        (lambda: gx.ct.from_array("scan", np.eye(4)), "are 'scan'"),
        (
            lambda: gx.ct.from_array(np.where(np.arange(27).reshape(3, 3, 3) == 5, np.nan, 1), np.eye(4)),
            r"1 of 27 .*no",
        ),
        (lambda: gx.ct.from_array(GOOD, SINGULAR), "the affine of the scan is singular"),
        (
            lambda: gx.ct.from_array(GOOD, np.array([[1, 2, 0, 0], [2, 4, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])),
            "singular",
        ),
        (lambda: gx.ct.from_array(GOOD, np.eye(3)), "four rows of four numbers"),
        (lambda: gx.ct.from_array(GOOD, np.eye(4), "LAS"), "orientation of the scan is 'LAS': one of RAS, LPS"),
        (lambda: gx.ct.from_array(GOOD, np.eye(4)).to("up"), "is 'up'"),
        (lambda: gx.ct.from_array(GOOD, np.eye(4)).moved(np.zeros((4, 4))), "the matrix is"),
        (lambda: gx.ct.from_array(GOOD, np.eye(4)).density(a="x", b=1.0), "a of ρ = a \\+ b HU is 'x'"),
        (lambda: gx.ct.from_array(GOOD, np.eye(4)).density(a=1.0, b=0.0), "b of ρ = a \\+ b HU is 0"),
        (lambda: gx.ct.from_array(GOOD, np.eye(4)).density(a=1.0, b=1.0, floor=0.0), "the floor"),
        (lambda: gx.ct.from_array(GOOD, np.eye(4)).density(a=1.0, b=1.0, ash=(1, 2)), "ash is"),
        (lambda: gx.ct.from_array(GOOD, np.eye(4)).density(a=1.0, b=1.0, by="voxel"), "by 'voxel'"),
        (lambda: gx.ct.from_array(GOOD, np.eye(4)).density(a=1.0, b=1.0, z=0.0, plane="oblique"), "'oblique'"),
        (lambda: gx.ct.from_array(GOOD, np.eye(4)).density(a=1.0, b=1.0, by="mean")(np.zeros((3, 1))), "by='point'"),
        (lambda: gx.discretise(still(square(1), linear()[0].density(a=A, b=B)), gx.Q1), "the place of its slice"),
        (lambda: gx.discretise(still(cube(1), linear()[0].density(a=A, b=B, z=1.0)), gx.Q1), "no z would be right"),
        (lambda: gx.ct.read("missing.nii.gz"), "missing.nii.gz"),
        (lambda: gx.ct.read(7), "the file of a scan is 7"),
    ],
)
def test_bad_input_is_one_sentence(make, words):
    """What is wrong, where it came from, and what would be right."""
    sentence = refused(make)
    assert re.search(words, sentence), sentence


def test_differing_arrays_are_refused():
    """A scan that ranks made by themselves must be the same on all."""
    if COMM.size == 1:
        pytest.skip("one rank has no other")
    assert "differ" in refused(lambda: gx.ct.from_array(GOOD + COMM.rank, np.eye(4)))
