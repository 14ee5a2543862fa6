"""Two densities beside one another: numbers that are known by hand, whole and in zones."""

import numpy as np
import pytest
from blocks import COMM, block, cube, square
from scans import A, B, linear

import growthx as gx

X2 = 1 / 12  # variance of x over [0, 1]


def of(start, variant=gx.Q1Q1, mesh=None):
    """A discretised block with a density."""
    return gx.discretise(block(square(4) if mesh is None else mesh, initial_density=start), variant)


def test_numbers_by_hand():
    """ρ = 1 + x beside 2 + 2x and 3 − x: r is 1 and −1, means and squares are integrals of polynomials."""
    problem = of(lambda x: 1 + x[0])
    double = gx.compare(problem, lambda x: 2 + 2 * x[0])
    assert double.pearson == pytest.approx(1.0, rel=1e-12) and double.bias == pytest.approx(-1.5, rel=1e-12)
    assert double.rmse == pytest.approx(np.sqrt(7 / 3), rel=1e-12) and double.volume == pytest.approx(1.0)
    assert (double.mean, double.other) == pytest.approx((1.5, 3.0), rel=1e-12)
    falling = gx.compare(problem, lambda x: 3 - x[0] + 0 * x[1])
    assert falling.pearson == pytest.approx(-1.0, rel=1e-12) and falling.bias == pytest.approx(-1.0, rel=1e-12)
    cross = gx.compare(problem, lambda x: x[0] + x[1])
    assert cross.pearson == pytest.approx(X2 / np.sqrt(X2 * 2 * X2), rel=1e-12)
    constant = gx.compare(problem, 1.0)
    assert constant.pearson is None and constant.rmse == pytest.approx(np.sqrt(1 / 3), rel=1e-12)


@pytest.mark.parametrize("by", ["point", "mean"])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_run_that_begins_with_a_scan_agrees_with_it(by, dim):
    """The check of all parts together: nothing is apart, but for what a cell's one value is from the scan in it."""
    scan, _ = linear()
    density = scan.density(a=A, b=B, by=by, z=0.5 if dim == 2 else None)
    mesh = square(4) if dim == 2 else cube(2)
    found = gx.compare(of(density, gx.Q1P0, mesh), density)
    assert found.bias == pytest.approx(0.0, abs=1e-12)
    assert found.rmse == pytest.approx(0.0, abs=1e-12 if by == "mean" else 0.05)
    share = 1.0 if by == "mean" else np.sqrt(1 - 1 / (4 if dim == 2 else 2) ** 2)  # of the deviation, of n steps
    assert found.pearson == pytest.approx(share, rel=1e-10)


def test_zones_of_every_kind():
    """A polygon that cuts cells, a region, and a function of position: each with its own numbers and volume."""
    problem = of(lambda x: 1 + x[0])
    zones = {
        "left": np.array([[0, 0], [0.5, 0], [0.5, 1], [0, 1]]),
        "bone": ("bone",),
        "top": lambda x: x[1] > 0.5,
    }
    found = gx.compare(problem, lambda x: 1 + 0 * x[0], zones=zones).zones
    assert {name: zone.volume for name, zone in found.items()} == pytest.approx(dict.fromkeys(zones, 0.5), rel=1e-6)
    assert found["left"].bias == pytest.approx(0.25) == found["bone"].bias
    assert found["top"].bias == pytest.approx(0.5)


def test_beside_another_run(shared_folder):
    """A run of the same body by another variant is near; itself, to the bit; a folder's density does as well."""
    scene = block(square(4))
    one, other = (gx.solve(scene, variant) for variant in (gx.Q1P0, gx.Q1))
    gx.solve(scene, gx.Q1P0, out=shared_folder / "out")
    read = gx.read_density(shared_folder / "out")
    for same in (one, one.problem, read):
        found = gx.compare(one, same)
        assert found.rmse == 0.0 and found.pearson == pytest.approx(1.0)
    near = gx.compare(one, other)
    assert 0 < near.rmse < 0.05 * near.mean and near.pearson > 0.9


def test_densities_at_integration_points():
    """A run of a variant that has them, and what was carried for it: both are read at the nearest point."""
    start = lambda x: 1 + 0.5 * x[0] ** 2  # noqa: E731
    one, two = of(start, gx.Q1), of(start, gx.Q1P0)
    for other in (one, gx.transfer(one, one.scene.mesh, gx.Q1)):
        assert gx.compare(one, other).rmse < 1e-14
    assert 0 < gx.compare(one, two).rmse < 0.1


def test_what_does_not_grow_is_left_out():
    """Metal is no part of the agreement."""
    scene = block(square(4), initial_density={"bone": 1.0, "implant": 4.0}, growing=("bone",))
    found = gx.compare(gx.discretise(scene, gx.Q1P0), 1.5)
    assert found.volume == pytest.approx(0.5) and found.bias == pytest.approx(-0.5)


@pytest.mark.parametrize("dim", [2, 3])
def test_the_picture(shared_folder, dim):
    """It is there, and has three bodies side by side."""
    problem = of(lambda x: 1 + x[0], gx.Q1P0, square(4) if dim == 2 else cube(2))
    gx.compare(problem, 1.2, picture=shared_folder / "difference.png")
    if COMM.rank == 0:
        from matplotlib.image import imread

        height, width, _ = imread(shared_folder / "difference.png").shape
        assert width > 2 * height > 400


@pytest.mark.parametrize(
    ("other", "options", "words"),
    [
        ("scan.nii", {}, "is 'scan.nii'"),
        (None, {}, "is None"),
        (lambda x: x, {}, "shape"),
        (1.0, {"zones": {"far": np.array([[5, 5], [6, 5], [6, 6]])}}, "the zone 'far' holds nothing that grows"),
        (1.0, {"zones": {"bone": ("muscle",)}}, "muscle"),
        (1.0, {"zones": {"few": lambda x: x[0, :1] > 0}}, "one for each point"),
        (1.0, {"zones": [1]}, "what holds the zones"),
        (1.0, {"picture": "difference.txt"}, "suffix '.txt'"),
        (linear()[0].density(a=A, b=B), {}, "the place of its slice"),
        (linear()[0].density(a=A, b=B, z=9.0), {}, "lie outside the voxel centres"),
    ],
)
def test_bad_input_is_one_sentence(other, options, words):
    """What cannot be compared, and what would be right, on all ranks."""
    with pytest.raises(gx.InputError) as caught:
        gx.compare(of(1.0), other, **options)
    (sentence,) = set(COMM.allgather(str(caught.value)))
    assert words in sentence
