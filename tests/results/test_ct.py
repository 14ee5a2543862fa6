"""Densities to and from NIfTI files: what one writes another reads, on any number of ranks."""

import builtins
from dataclasses import replace

import numpy as np
import pytest
from blocks import COMM, block, cube, square
from scans import A, B, linear, proximal_femur

import growthx as gx

nibabel = pytest.importorskip("nibabel", reason="nibabel, which is optional, is not installed")


def refused(make, kind=gx.InputError):
    """The one sentence of all ranks."""
    with pytest.raises(kind) as caught:
        make()
    (sentence,) = set(COMM.allgather(str(caught.value)))
    assert "\n" not in sentence
    return sentence


def saved(image, path):
    """An image written by rank 0."""
    if COMM.rank == 0:
        nibabel.save(image, path)
    COMM.barrier()
    return path


def grown(mesh, start):
    """A discretised block that begins with a density."""
    return gx.discretise(block(mesh, initial_density=start), gx.Q1P0)


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
@pytest.mark.parametrize("dtype", [np.int16, ">i2", np.float32])
def test_a_file_says_the_same_as_its_array(shared_folder, suffix, dtype):
    """Voxels, bytes in either order, affine and frame come through the file, on all ranks."""
    values, affine = proximal_femur(6.0)
    image = nibabel.Nifti1Image(values.astype(dtype), affine)
    path = saved(image, shared_folder / f"scan{suffix}")
    x = np.random.default_rng(0).uniform(-20, 20, size=(3, 50))
    expected = gx.ct.from_array(values, affine).density(a=A, b=B)(x)
    assert gx.ct.read(path).density(a=A, b=B)(x) == pytest.approx(expected, rel=1e-6)
    turned = gx.ct.read(path, "LPS").density(a=A, b=B)(x * [[-1], [-1], [1]])
    assert turned == pytest.approx(expected, rel=1e-6)


def test_units_and_scales_of_a_file(shared_folder):
    """A file in metres with a slope is in mm, and in HU, once read; a fourth axis of one image is none."""
    values, affine = proximal_femur(8.0)
    image = nibabel.Nifti1Image(values[..., np.newaxis], np.diag([1e-3, 1e-3, 1e-3, 1]) @ affine)
    image.header.set_xyzt_units("meter")
    image.header.set_slope_inter(2.0, -1000.0)
    scan = gx.ct.read(saved(image, shared_folder / "metres.nii"))
    same = gx.ct.from_array(2 * values - 1000, affine)
    x = np.array([[1.0], [2.0], [3.0]])
    assert scan.voxels.spacing == pytest.approx([8.0] * 3, rel=1e-6)
    assert scan.density(a=A, b=B)(x) == pytest.approx(same.density(a=A, b=B)(x), rel=1e-5)


def test_files_that_are_no_scan(shared_folder):
    """Each in a sentence that names the file, on all ranks."""
    values, affine = proximal_femur(8.0)
    four = saved(nibabel.Nifti1Image(np.stack([values, values], axis=3), affine), shared_folder / "four.nii")
    assert "four.nii has voxels of shape" in refused(lambda: gx.ct.read(four))
    bad = values.astype(float)
    bad[1, 2, 3] = np.nan
    holed = saved(nibabel.Nifti1Image(bad, affine), shared_folder / "holed.nii")
    assert "1 of" in (sentence := refused(lambda: gx.ct.read(holed))) and "(1, 2, 3)" in sentence
    torn = shared_folder / "torn.nii"
    if COMM.rank == 0:
        torn.write_bytes(holed.read_bytes()[:1000])
        (shared_folder / "text.nii").write_text("no scan")
    COMM.barrier()
    for name in ("torn.nii", "text.nii", "missing.nii"):
        assert name in refused(lambda name=name: gx.ct.read(shared_folder / name))


def test_without_nibabel(shared_folder, monkeypatch):
    """It is optional: who asks for it where it is missing hears what to install."""
    within = builtins.__import__

    def missing(name, *arguments, **named):
        if name == "nibabel":
            raise ImportError(name)
        return within(name, *arguments, **named)

    monkeypatch.setattr(builtins, "__import__", missing)
    assert "needs nibabel" in refused(lambda: gx.ct.read(shared_folder / "scan.nii"))
    problem = grown(square(1), 1.0)
    assert "needs nibabel" in refused(lambda: gx.ct.write(problem, shared_folder / "out.nii", spacing=0.5))


@pytest.mark.parametrize("orientation", ["RAS", "LPS"])
@pytest.mark.parametrize("outside", [0.0, np.nan])
def test_a_density_written_and_read(shared_folder, orientation, outside):
    """Each voxel has the density at its centre, in space, or what was chosen outside; in either frame."""
    scan, exact = linear()
    problem = gx.discretise(block(cube(2), initial_density=scan.density(a=A, b=B)), gx.Q1Q1)
    path = shared_folder / "density.nii.gz"
    gx.ct.write(problem, path, spacing=(0.25, 0.2, 0.5), outside=outside, orientation=orientation)
    image = nibabel.load(path)
    values, affine = np.asarray(image.dataobj), image.affine
    assert values.shape == (6, 7, 4) and values.dtype == np.float32 and image.header.get_xyzt_units()[0] == "mm"
    x = np.stack(np.meshgrid(*map(np.arange, values.shape), indexing="ij"), axis=-1) @ affine[:3, :3].T + affine[:3, 3]
    x = x * ([-1, -1, 1] if orientation == "LPS" else 1)
    inside = np.all((x > 0) & (x < 1), axis=-1)
    assert inside.sum() == 4 * 5 * 2
    assert values[inside] == pytest.approx(A + B * exact(x[inside].T), rel=1e-6)
    assert np.array_equal(values[~inside], np.full((~inside).sum(), outside), equal_nan=True)
    if outside == 0.0:
        again = gx.ct.read(path, orientation).density(a=0, b=1)
        middle = np.array([[0.4], [0.5], [0.5]])
        assert again(middle) == pytest.approx(A + B * exact(middle), rel=1e-6)


def test_a_plane_density_is_one_layer(shared_folder):
    """Read back in its slice, it begins a run of the same density, but for a voxel's width at the border."""
    mesh = square(4)
    result = gx.solve(block(mesh), gx.Q1P0)
    path = shared_folder / "plane.nii"
    gx.ct.write(result, path, spacing=0.05)
    assert nibabel.load(path).shape == (22, 22, 1)
    again = gx.ct.read(path).density(a=0, b=1, z=0.0, by="point")
    scene = replace(result.scene, initial_density=again)
    start = gx.discretise(scene, gx.Q1P0)
    assert start.mean_density() == pytest.approx(result.problem.mean_density(), rel=2e-3)
    assert gx.compare(result, start).pearson > 0.99


def test_nothing_is_overwritten(shared_folder):
    """What was there stays, and nothing is left of what could not be written."""
    problem = grown(square(1), 1.0)
    path = shared_folder / "density.nii"
    gx.ct.write(problem, path, spacing=0.5)
    before = path.read_bytes()
    COMM.barrier()
    assert "is there already" in refused(lambda: gx.ct.write(problem, path, spacing=0.25))
    COMM.barrier()
    assert path.read_bytes() == before and [file.name for file in shared_folder.iterdir()] == ["density.nii"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"spacing": 0.0}, "the spacing of voxels"),
        ({"spacing": (1.0, 1.0)}, r"the spacing of voxels is (1.0, 1.0)"),
        ({"spacing": 1e-9}, "a spacing for at most"),
        ({"spacing": 1.0, "outside": np.inf}, "the value outside"),
        ({"spacing": 1.0, "padding": -1}, "the padding is -1"),
        ({"spacing": 1.0, "orientation": "ARS"}, "'ARS'"),
        ({"spacing": 1.0, "path": "density.png"}, "another suffix"),
        ({"spacing": 1.0, "path": "no/such/folder/a.nii"}, "a folder that is not there"),
    ],
)
def test_bad_orders_to_write(options, words):
    """One sentence before anything is sampled."""
    given = {"path": "never.nii", **options}
    path = given.pop("path")
    problem = grown(square(1), 1.0)
    assert words in refused(lambda: gx.ct.write(problem, path, **given))
