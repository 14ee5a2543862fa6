"""Pictures of bodies in space show what is inside, where it is, and whence the loads come."""

import matplotlib.image
import numpy as np
import pytest
from blocks import COMM, block, cube, square

import growthx as gx
from growthx import plots
from growthx.post.space import body, panels, pictures, planes

STILL = gx.EnergyDrivenGrowth(attractor=0.0, rate=0.0)
VARIANTS = ("Q1P0", "Q1", "Q2", "Q1Q1", "Q2Q2", "P1P0", "P2", "P1P1")


def layered(variant=gx.Q1P0, **changes):
    """A cube whose density is 1 + x, as the variant has it, at rest."""
    mesh = cube(4, shape=variant.cells[1])
    changes = {"growth": STILL, "initial_density": lambda x: 1 + x[0], **changes}
    return gx.discretise(block(mesh, **changes), variant)


def pixels(path):
    """The colours of a picture, (rows, columns, 3)."""
    COMM.barrier()
    return matplotlib.image.imread(path)[:, :, :3]


def coloured(image):
    """Which of its pixels are neither white, black nor grey."""
    return np.ptp(image, axis=2) > 0.1


@pytest.mark.parametrize("name", VARIANTS)
def test_a_picture_without_arguments_shows_outside_and_middle(name, shared_folder):
    """Of every kind of density on both shapes of cells: two panels with a range of colours, and the colour bar."""
    path = shared_folder / "body.png"
    plots.density(layered(gx.variants.named(name)), path)
    image = pixels(path)
    found = coloured(image)
    width = panels.PANEL_WIDTH
    for part in (found[:, :width], found[:, width : 2 * width]):
        assert 0.05 < part.mean() < 0.9
    for part in (image[:, :width][found[:, :width]], image[:, width : 2 * width][found[:, width : 2 * width]]):
        assert len(np.unique((part * 16).astype(int), axis=0)) >= 4
    assert found[:, 2 * width :].any()
    assert np.all(image[0, 0] == 1.0)


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.parametrize("smoothed", [False, True], ids=["raw", "smoothed"])
def test_the_body_has_the_values_and_the_volume(name, smoothed):
    """On rank 0 all cells of all ranks are there, once, with their densities; neighbours share their points."""
    problem = layered(gx.variants.named(name))
    found = body.space_body(problem, "density", False, smoothed, 1.0)
    low, high = body.range_of(found, problem)
    if smoothed:
        assert (low, high) == pytest.approx((1.0, 2.0), abs=0.3)
    else:
        assert (low, high) == pytest.approx(problem.density_range(), rel=1e-12)
    if COMM.rank == 0:
        assert found.growing.volume == pytest.approx(1.0, rel=1e-6)
        assert found.growing.extract_surface().area == pytest.approx(6.0, rel=1e-6)  # no inner sides
        assert found.resting is None and found.whole is found.growing


def test_a_slice_shows_the_densities_of_its_plane(monkeypatch, shared_folder):
    """Across x at 0.9 they are those of the last cells; by a point and a normal of any length."""
    problem, seen = layered(), []
    monkeypatch.setattr(panels, "render", lambda drawn, *rest: seen.extend(drawn))
    plots.slices(problem, shared_folder / "a.png", ["axial", ((0.9, 0.5, 0.5), (3.0, 0.0, 0.0))])
    if COMM.rank == 0:
        across, last = (panel.parts[0][0] for panel in seen)
        assert across.area == pytest.approx(1.0, rel=1e-5) and last.area == pytest.approx(1.0, rel=1e-5)
        assert np.unique(last.cell_data[body.VALUE].round(9)) == pytest.approx([1.875])
        assert np.unique(across.cell_data[body.VALUE].round(9)) == pytest.approx([1.125, 1.375, 1.625, 1.875])
        assert seen[1].toward == (1.0, 0.0, 0.0) and seen[1].up == (0.0, 0.0, 1.0)
        assert seen[0].label == "axial, z = 0.5   (x →, y ↑)"


def test_a_slice_is_drawn_where_the_body_has_moved_to(monkeypatch, shared_folder):
    """The plane cuts the body at rest; the displacement, magnified, carries what was cut."""
    problem, seen = layered(), []
    problem.displacement.interpolate(lambda x: np.array([0 * x[0], 0.1 * x[2], 0 * x[0]]))
    monkeypatch.setattr(panels, "render", lambda drawn, *rest: seen.extend(drawn))
    plots.slices(problem, shared_folder / "a.png", ["axial"], magnification=2.0)
    if COMM.rank == 0:
        points = seen[0].parts[0][0].points
        assert points[:, 1].min() == pytest.approx(0.1, abs=1e-4) and points[:, 1].max() == pytest.approx(1.1, abs=1e-4)


@pytest.mark.parametrize("smoothed", [False, True], ids=["raw", "smoothed"])
def test_a_threshold_shows_what_is_above(smoothed, monkeypatch, shared_folder):
    """Half of the cube is denser than 1.5: whole cells of the raw density, up to its surface of the smoothed one."""
    problem, seen = layered(gx.Q1P0), []
    monkeypatch.setattr(panels, "render", lambda drawn, *rest: seen.extend(drawn))
    plots.threshold(problem, shared_folder / "a.png", above=1.5, smoothed=smoothed)
    plots.threshold(problem, shared_folder / "a.png", above=1.2, below=1.5, smoothed=smoothed)
    if COMM.rank == 0:
        (upper, _), (middle, _) = (panel.parts[0] for panel in seen)
        assert upper.bounds[:2] == pytest.approx((0.5, 1.0), abs=1e-6)
        assert middle.bounds[:2] == pytest.approx((0.2125, 0.5) if smoothed else (0.25, 0.5), abs=0.1)
        assert seen[1].label == "density above 1.2 and below 1.5"
        assert seen[0].parts[1][1]["opacity"] < 0.5  # the rest, as a shade


def test_a_cut_away_body_has_its_loads(monkeypatch, shared_folder):
    """Half of it, with an arrow for each force: at the surface, where its boundary is curved, too, and not hidden."""
    loads = (
        gx.DistributedForce("back", (0.0, 0.0, -1.0), case="pushes"),
        gx.DistributedForce("right", (-0.1, 0.0, 0.6), case="pulls inwards"),
    )
    problem, seen = layered(loads=loads), []
    monkeypatch.setattr(panels, "render", lambda drawn, *rest: seen.extend(drawn))
    plots.cutaway(problem, shared_folder / "a.png", "coronal")
    if COMM.rank == 0:
        (panel,) = seen
        half = panel.parts[0][0]
        assert half.bounds[2:4] == pytest.approx((0.5, 1.0), abs=1e-5)  # seen from −y: what is behind is left
        push, pull = (mesh for mesh, look in panel.parts if look.get("color") in panels.COLOURS)
        assert push.bounds[4] == pytest.approx(1.0, abs=1e-5)  # its point is on that side
        assert pull.center[0] > 1.0  # outside, though it points into the body
        assert [name for name, _ in panel.legend] == ["pushes", "pulls inwards"]


def test_an_arrow_is_where_the_body_has_moved_to(monkeypatch, shared_folder):
    """Beside the deformed body an arrow at rest hangs in the air; a traction has one, too."""
    problem, seen = gx.solve(block(cube(2), loads=(gx.Traction("right", (0.3, 0.0, 0.0)),)), gx.Q1P0).problem, []
    monkeypatch.setattr(panels, "render", lambda drawn, *rest: seen.extend(drawn))
    plots.cutaway(problem, shared_folder / "a.png", "coronal")
    moved = problem.sample_displacement(np.array([[1.0, 0.5, 0.5]]))[0, 0]
    if COMM.rank == 0:
        (pull,) = (mesh for mesh, look in seen[0].parts if look.get("color") in panels.COLOURS)
        assert moved > 0.1 and pull.bounds[0] == pytest.approx(1.0 + moved, abs=1e-3)


def test_slices_in_grey_are_beside_the_coloured_ones(shared_folder):
    """Black at zero and behind the body, white at the densest, as a CT shows bone: nothing in it is coloured."""
    path = shared_folder / "grey.png"
    plots.slices(layered(), path, ["coronal"], grey=True)
    image = pixels(path)
    width = panels.PANEL_WIDTH
    left, right = image[:, :width], image[:, width : 2 * width]
    assert coloured(left).mean() > 0.2 and not coloured(right).any()
    assert np.all(right[-1, 0] == 0.0) and right.max() > 0.9
    row = right[image.shape[0] // 2, :, 0]
    body_of_it = row[row > 0.2]
    assert body_of_it[-1] > body_of_it[0] + 0.3  # denser to the right


def test_what_rests_is_plain_and_has_no_part_in_the_colours(monkeypatch, shared_folder):
    """An implant of another density would take the colours of the bone, and be taken for bone."""
    start = {"bone": 1.0, "implant": 7.0}
    problem, seen = layered(gx.Q1, initial_density=start, growing=("bone",)), []
    monkeypatch.setattr(panels, "render", lambda *arguments: seen.append(arguments))
    plots.slices(problem, shared_folder / "a.png", ["coronal"])
    plots.threshold(problem, shared_folder / "a.png", above=0.5)
    if COMM.rank == 0:
        (drawn, scales, rests, *_), (above, _, in_it, *_) = seen
        assert scales[0].high == pytest.approx(1.0) and rests and not in_it
        (bone, look), (implant, plain), *_ = drawn[0].parts
        assert look["scalars"] == body.VALUE and "scalars" not in plain and plain["color"] == panels.RESTING_COLOUR
        assert bone.area == pytest.approx(0.5, rel=1e-4) and implant.area == pytest.approx(0.5, rel=1e-4)
        assert above[0].parts[0][0].bounds[1] == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize("field", ["von_mises", "strain_energy", "young", "major_stress"])
@pytest.mark.parametrize("smoothed", [False, True], ids=["raw", "smoothed"])
def test_fields_are_drawn_by_name(field, smoothed, monkeypatch, shared_folder):
    """With the numbers of the field, and under its own title."""
    problem = gx.solve(block(cube(2)), gx.Q1P0).problem
    seen = []
    monkeypatch.setattr(panels, "render", lambda drawn, scales, *rest: seen.extend(scales))
    plots.slices(problem, shared_folder / "a.png", field=field, smoothed=smoothed)
    if smoothed:
        values = gx.results.node_fields(problem, (field,))[field]
    else:
        values = gx.results.cell_fields(problem, (field,))[field]
    low, high = (COMM.allgather(float(end)) for end in (values.min(initial=np.inf), values.max(initial=-np.inf)))
    if COMM.rank == 0:
        assert (seen[0].low, seen[0].high) == pytest.approx((min(low), max(high)), rel=1e-12)
        assert seen[0].title == gx.results.FIELDS[field].title


def test_a_relative_change_has_its_second_scale(monkeypatch, shared_folder):
    """As in the plane: [ρ − ρ*]/ρ* and ρ = ρ* (1 + change) beside it."""
    seen = []
    monkeypatch.setattr(panels, "render", lambda drawn, scales, *rest: seen.extend(scales))
    problem = layered()
    plots.density(problem, shared_folder / "a.png", relative=True, scale="density")
    low, high = problem.density_range()
    if COMM.rank == 0:
        change, density = seen
        assert (change.low, change.high) == pytest.approx((low / 1.2 - 1, high / 1.2 - 1))
        assert (density.low, density.high) == pytest.approx((low, high)) and density.title == "density"


def test_labels_of_planes_have_no_round_off():
    """What a user computed as zero is none to the last digit, and is no place to be told."""
    plane = planes.plane_of(((0.1 + 0.2 - 0.3, 0.3, 1e-17), (1e-17, -2.0, -1e-16)), cube(1))
    assert plane.label == "through (0, 0.3, 0), normal (0, -2, 0)"
    small = planes.plane_of(((0.5, 0.5, 0.5), (0.0, 3e-9, 1e-9)), cube(1))
    assert small.label == "through (0.5, 0.5, 0.5), normal (0, 3e-09, 1e-09)"


def test_the_middle_plane_is_across_the_shortest_extent():
    """Of a body that is flat in y the coronal plane shows most, and so with the others."""
    mesh = cube(2)
    for axis, name in enumerate(("sagittal", "coronal", "axial")):
        size = np.full(3, 2.0)
        size[axis] = 1.0
        mesh.domain.geometry.x[:] = cube(2).domain.geometry.x * size
        found = planes.plane_of(None, mesh)
        assert found.label.startswith(name) and found.point == pytest.approx(tuple(size / 2))


CALLS = {
    "slices": lambda problem, path: plots.slices(problem, path),
    "threshold": lambda problem, path: plots.threshold(problem, path, above=1.0),
    "cutaway": lambda problem, path: plots.cutaway(problem, path),
}


@pytest.mark.parametrize("name", CALLS)
def test_plane_bodies_are_refused(name):
    """They have no inside to be cut: a sentence says what draws them."""
    with pytest.raises(gx.InputError, match=r"the body has 2 dimensions: gx\.plots\.density draws it"):
        CALLS[name](gx.discretise(block(square(2)), gx.Q1P0), "never.png")


@pytest.mark.parametrize("name", [*CALLS, "density"])
def test_pictures_that_could_not_be_written_are_refused_before(name, monkeypatch, shared_folder):
    """As in the plane, before anything is gathered or drawn."""
    monkeypatch.setattr(pictures, "space_body", lambda *arguments: pytest.fail("this takes time"))
    with pytest.raises(gx.InputError, match=r"has the suffix '\.xyz'"):
        (CALLS | {"density": plots.density})[name](layered(), shared_folder / "a.xyz")


@pytest.mark.parametrize(
    ("draw", "sentence"),
    [
        (lambda p, f: plots.slices(p, f, ["frontal"]), "there is no plane 'frontal': one of coronal, axial, sagittal"),
        (lambda p, f: plots.slices(p, f, []), "no plane is named"),
        (lambda p, f: plots.slices(p, f, "axial"), "the planes is 'axial': a tuple of planes would be right"),
        (lambda p, f: plots.slices(p, f, [((0, 0, 3), (0, 0, 1))]), r"misses the body, which reaches from \(0, 0, 0\)"),
        (lambda p, f: plots.slices(p, f, [((0, 0, 0), (0, 0, 0))]), "not all zero, are needed"),
        (lambda p, f: plots.slices(p, f, [((0, 0), (0, 1))]), "three numbers for each"),
        (lambda p, f: plots.slices(p, f, [5]), "the plane is 5: one of coronal"),
        (lambda p, f: plots.slices(p, f, field="cauchy_stress"), "'cauchy_stress' has no single number .* von_mises"),
        (lambda p, f: plots.slices(p, f, field="mises"), "there is no field 'mises': one of density"),
        (lambda p, f: plots.slices(p, f, field="young", relative=True), "one of the density alone"),
        (lambda p, f: plots.slices(p, f, grey=1), "grey, of a picture, is 1"),
        (lambda p, f: plots.threshold(p, f), "neither a lower nor an upper bound"),
        (
            lambda p, f: plots.threshold(p, f, above=3.0),
            "nothing of the body is above 3: its density reaches from 1.12",
        ),
        (lambda p, f: plots.threshold(p, f, above="1"), "the lower bound of what is drawn is '1'"),
        (lambda p, f: plots.cutaway(p, f, arrows=0), "arrows, of a picture, is 0"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_one_sentence(draw, sentence, shared_folder):
    """The same on all ranks, with what would be right."""
    with pytest.raises(gx.InputError, match=sentence) as caught:
        draw(layered(), shared_folder / "never.png")
    assert len(set(COMM.allgather(str(caught.value)))) == 1
    COMM.barrier()
    assert not (shared_folder / "never.png").exists()
