"""Movies of what a run has left: a picture of each state, all in the same colours and of the same part of the world."""

import numpy as np
import pytest
from blocks import COMM, block, cube, square

import growthx as gx
from growthx.common.errors import InputError, OutputError
from growthx.post import movie as movies

pytest.importorskip("pyvista")
Image = pytest.importorskip("PIL.Image")

PROGRAM = gx.Program(step=0.1, until=0.4, ramp=0.2)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The folder of a run in the plane, half of whose body rests, that has left five states."""
    folder = COMM.bcast(tmp_path_factory.mktemp("runs"))
    scene = block(square(4, 0.05), growing=("bone",), program=PROGRAM)
    gx.solve(scene, gx.Q1P0, out=folder / "plane", every=1)
    COMM.barrier()
    return folder / "plane"


def pictures(file):
    """All pictures of a movie, (pictures, height, width, 3), and how long each is shown (ms)."""
    with Image.open(file) as found:
        shown, durations = [], []
        for number in range(found.n_frames):
            found.seek(number)
            shown.append(np.array(found.convert("RGB")).astype(int))
            durations.append(found.info["duration"])
    return np.array(shown), durations


def share(picture, colour, slack=12):
    """How much of a picture is of a colour."""
    return float((np.abs(picture - colour).max(axis=-1) <= slack).mean())


def colours(value, low, high):
    """The colour of a value in the range of a movie."""
    from matplotlib import colormaps

    return 255 * np.array(colormaps[movies.COLOUR_MAP]((value - low) / (high - low))[:3])


def test_each_state_is_a_picture_in_the_same_colours(run, shared_folder):
    """A start that is grey-blue in one picture and yellow in the next would tell nothing of growth."""
    file = gx.plots.movie(run, shared_folder / "m.gif", title="ρ (g/cm³)", per_second=5)
    assert file == shared_folder / "m.gif"
    COMM.barrier()
    if COMM.rank:
        return
    shown, durations = pictures(file)
    assert len(shown) == 5 and durations == [200] * 4 + [1500]
    states = movies._read(run, "density")
    assert states.times == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])
    low, high = states.limits
    start = shown[0][:, : -movies.BAR_WIDTH]
    assert share(start, colours(1.2, low, high)) > 0.2  # all that grows begins with one density
    for picture in shown:
        assert share(picture[:, : -movies.BAR_WIDTH], (169, 169, 169)) > 0.15  # what rests is grey
        assert share(picture, (255, 255, 255), 0) > 0.2
        # bar and numbers beside the body are the same in all
        assert np.array_equal(picture[:, -movies.BAR_WIDTH :], shown[0][:, -movies.BAR_WIDTH :])
    assert share(shown[-1][:, : -movies.BAR_WIDTH], colours(1.2, low, high)) < 0.1


def test_what_is_drawn_is_what_is_in_the_files(run):
    """Of each state its own values, where nothing grows none, and the displacement of the points."""
    if COMM.rank:
        return
    import pyvista

    states = movies._read(run, "density")
    reader = pyvista.get_reader(run / "raw.pvd")
    for number, time in enumerate(states.times):
        reader.set_active_time_value(time)
        (grid,) = reader.read()
        grows = np.asarray(grid.cell_data["grows"]) == 1
        assert np.array_equal(states.values[number][grows], np.asarray(grid.cell_data["density"])[grows])
        assert np.isnan(states.values[number][~grows]).all() and 0 < grows.sum() < len(grows)
        moved = states.deformed(number, 2.0, "density").points - states.body.points
        assert moved == pytest.approx(2 * np.asarray(grid.point_data["displacement"]), abs=1e-12)
    everywhere = np.concatenate([values[~np.isnan(values)] for values in states.values])
    assert states.limits == (everywhere.min(), everywhere.max())


@pytest.mark.parametrize("kind", [False, True], ids=["pvd", "vtkhdf"])
@pytest.mark.parametrize("variant", [gx.Q1P0, gx.P2P2], ids=str)
def test_bodies_in_space_are_cut_open(variant, kind, shared_folder):
    """Across their thinnest extent; of either kind of files; density at the nodes of curved cells, too."""
    mesh = cube(2, shape=variant.cells[1])
    mesh.domain.geometry.x[:, 1] *= 0.4
    scene = block(mesh, program=gx.Program(step=0.1, until=0.2))
    gx.solve(scene, variant, out=shared_folder / "out", every=1, vtkhdf=kind)
    COMM.barrier()
    gx.plots.movie(shared_folder / "out", shared_folder / "m.gif")
    COMM.barrier()
    if COMM.rank:
        return
    states = movies._read(shared_folder / "out", "density")
    assert not states.flat and states.thin == 1
    half = states.deformed(0, 1.0, "density")
    assert half.volume == pytest.approx(states.body.volume / 2, rel=1e-6) and half.bounds[3] == pytest.approx(0.2)
    shown, _ = pictures(shared_folder / "m.gif")
    assert len(shown) == 3 and share(shown[0], (255, 255, 255), 0) < 0.8
    border = shown[:, :, :3].reshape(-1, 3)
    assert (border == 255).all()  # nothing is cut off


@pytest.mark.parametrize("field", ["displacement", "smoothed_density", "major_stress"])
def test_other_fields(field, run, shared_folder):
    """At points and in cells, of a vector its length; where what rests shares points with what grows, too."""
    gx.plots.movie(run, shared_folder / "m.ogv", field=field, magnification=3.0)
    COMM.barrier()
    assert (shared_folder / "m.ogv").stat().st_size > 1000
    if COMM.rank == 0:
        states = movies._read(run, field)
        assert np.isnan(states.values[-1]).any() == (field != "displacement" or "grows" in states.body.cell_data)
        assert states.limits[0] < states.limits[1]


def test_it_lands_beside_the_folder_over_nothing(run, monkeypatch):
    """Not in it, where a run that is resumed would take it for somebody's; and not over another one."""
    monkeypatch.chdir(run)
    names = []
    for _ in range(2):
        names.append(gx.plots.movie("."))
        COMM.barrier()
    assert [name.name for name in names] == ["plane.gif", "plane-2.gif"]
    assert all((run.parent / name.name).is_file() for name in names)
    assert not list(run.glob("*.gif"))


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (
            {"path": "m.avi"},
            r"the movie|the picture .* has the suffix '\.avi': one of \.gif, \.mp4, \.ogv would be right",
        ),
        ({"path": "none/m.gif"}, r"which is not there"),
        (
            {"field": "porosity"},
            r"^there is no field 'porosity' in \S+: one of density, .*major_stress.* would be right$",
        ),
        ({"per_second": 0}, r"^the number of states in a second of a movie is 0: a positive number would be right$"),
        ({"magnification": "2"}, r"^the magnification of the displacement is '2': a finite number would be right$"),
        ({"title": 5}, r"^the title of a movie is 5: a text would be right$"),
    ],
    ids=repr,
)
def test_what_cannot_be_drawn_is_refused(options, sentence, run, shared_folder):
    """One sentence on all ranks, and no file."""
    options = {"path": "m.gif", **options}
    options["path"] = shared_folder / options["path"]
    with pytest.raises(InputError, match=sentence):
        gx.plots.movie(run, **options)
    assert not list(shared_folder.iterdir())


def test_folders_without_a_series_are_refused(shared_folder):
    """A run of which only the end is there makes no movie; how it would is said."""
    with pytest.raises(InputError, match=r"^there are no states of a run in \S+: the folder of one with --out and --"):
        gx.plots.movie(shared_folder / "none", shared_folder / "m.gif")
    gx.solve(block(), gx.Q1P0, out=shared_folder / "out")
    COMM.barrier()
    with pytest.raises(
        InputError, match=r"^there is one state in \S+, at t = 0.4: a run with --every K, --times .* or "
    ):
        gx.plots.movie(shared_folder / "out", shared_folder / "m.gif")


def test_mp4_needs_a_program(run, shared_folder, monkeypatch):
    """Without it the other formats are named, before anything is drawn."""
    monkeypatch.setattr(movies, "find_spec", lambda name: None)
    with pytest.raises(
        InputError, match=r"^the movie \S+ needs imageio with its plugin imageio-ffmpeg, .*: a \.gif or \.ogv w"
    ):
        gx.plots.movie(run, shared_folder / "m.mp4")


def test_a_disk_that_is_full_is_one_sentence(run, shared_folder, monkeypatch):
    """On all ranks."""

    def full(*arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(movies, "_save_gif", full)
    with pytest.raises(OutputError, match=r"^the movie \S+ cannot be written \(No space left on device\): another "):
        gx.plots.movie(run, shared_folder / "m.gif")
