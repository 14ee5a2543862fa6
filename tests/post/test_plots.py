"""Pictures show what was computed: which values, on which shape."""

import inspect
import sys

import matplotlib.image
import numpy as np
import pytest
from mpi4py import MPI

import growthx as gx
from growthx import plots
from growthx.common.errors import OutputError
from growthx.scenes.bar import DISCONTINUOUS, lower_edge

COMM = MPI.COMM_WORLD


# Pieces of a cell that are drawn, each in one colour or, where the density is continuous, with colours at its corners.
PIECES = {"Q1Q1": 1, "Q2Q2": 16, "Q1P0": 1, "Q1": 4, "Q2": 9, "P2P2": 16, "P1": 1, "P2": 3}


@pytest.fixture(scope="module", params=PIECES)
def problem(request):
    """A small bent plate."""
    variant = gx.variants.named(request.param)
    return gx.solve(gx.scenes.plate(4, shape=variant.cells[0]), variant).problem


def test_picture_has_body_colours_and_background(problem, shared_folder):
    """A picture that is all white, or missing, would go unnoticed in a long run."""
    path = shared_folder / "density.png"
    plots.density(problem, path, title="density (-)")
    COMM.barrier()
    image = matplotlib.image.imread(path)[:, :, :3]
    coloured = np.abs(image - image.mean(axis=2, keepdims=True)).max(axis=2) > 0.1
    assert 0.05 < coloured.mean() < 0.9
    assert np.all(image[-1, -1] == 1.0)
    assert len(np.unique((image[coloured] * 16).astype(int), axis=0)) > 8  # a range of densities, not one


def test_values_drawn_are_those_of_the_variant(problem):
    """Raw values are drawn: each integration point's on its own part of the cell, and no averages."""
    parts, values = plots._values(problem, relative=False, smoothed=False)
    assert len(parts.pieces) == PIECES[problem.variant.name]
    drawn = COMM.allreduce(float(values.min()), MPI.MIN), COMM.allreduce(float(values.max()), MPI.MAX)
    assert drawn == pytest.approx(problem.density_range(), rel=1e-14)
    at = parts.X[parts.pieces].mean(axis=1) if problem.variant.density.local else parts.X
    assert values == pytest.approx(problem.density_at(at), rel=1e-14)


def test_smoothed_values_are_those_of_the_smoothed_density(problem):
    """One value for each corner of a cell, the same in all cells around it."""
    from growthx.post.smoothing import smoothed_density

    parts, values = plots._values(problem, relative=False, smoothed=True)
    assert len(parts.pieces) == 1
    smooth = smoothed_density(problem).x.array
    drawn = COMM.allreduce(float(values.min()), MPI.MIN), COMM.allreduce(float(values.max()), MPI.MAX)
    known = COMM.allreduce(float(smooth.min()), MPI.MIN), COMM.allreduce(float(smooth.max()), MPI.MAX)
    assert drawn == known


def test_relative_change_is_drawn_with_the_reference_of_its_place():
    """ρ* may vary: the change drawn is that of each piece from the ρ* there."""
    from blocks import block, square

    material = gx.Material(young=1.0, reference_density={"bone": 1.0, "implant": 2.0})
    still = gx.EnergyDrivenGrowth(0.0, rate=0.0)
    problem = gx.solve(block(square(4), material=material, growth=still), gx.Q1).problem
    body = plots._body(problem, relative=True, smoothed=False, magnification=1.0)
    assert body.values == pytest.approx(np.zeros(body.values.shape), abs=1e-14)


def halves(variant, **start):
    """A square with two references, at rest."""
    from blocks import block, square

    material = gx.Material(young=1.0, reference_density={"bone": 1.0, "implant": 2.0})
    return gx.discretise(block(square(4), material=material, **start), variant)


@pytest.mark.parametrize("smoothed", [False, True], ids=["raw", "smoothed"])
@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q2, gx.S2fri], ids=lambda variant: variant.name)
def test_changes_at_the_border_of_two_references(variant, smoothed):
    """Changes are averaged there, not densities: where ρ = 1.5 ρ* on either side, nothing but 0.5 is drawn."""
    problem = halves(variant, initial_density={"bone": 1.5, "implant": 3.0})
    _, values = plots._values(problem, relative=True, smoothed=smoothed)
    assert values == pytest.approx(np.full(values.shape, 0.5), abs=1e-12)


def test_a_continuous_density_changes_on_either_side_of_two_references():
    """It cannot jump with ρ*, and its change does: each cell draws the one of its own side, at the border, too."""
    _, values = plots._values(halves(gx.Q1Q1, initial_density=3.0), relative=True, smoothed=False)
    assert np.ptp(values, axis=1).max(initial=0.0) < 1e-12
    drawn = {value for part in COMM.allgather(values.round(12).ravel().tolist()) for value in part}
    assert drawn == {0.5, 2.0}


def test_changes_along_a_line(shared_folder, monkeypatch):
    """What is plotted is [ρ − ρ*]/ρ* with the ρ* of its place, under that name, and the densities' own name else."""
    problem = halves(gx.Q1, initial_density={"bone": 1.2, "implant": 3.0})
    seen = []
    monkeypatch.setattr(plots, "_plot", lambda curves, x, exact, title, path: seen.append((curves["a"], title)))
    for relative in (True, False):
        plots.along_length({"a": problem}, shared_folder / "a.png", [[0.1, 0.4], [0.9, 0.4]], relative=relative)
    if COMM.rank == 0:
        assert seen[0][0] == pytest.approx([0.2, 0.5], rel=1e-12) and seen[0][1] == "[ρ − ρ*]/ρ*"
        assert seen[1][0] == pytest.approx([1.2, 3.0], rel=1e-12) and seen[1][1] == "density"


def test_a_colour_bar_says_what_is_drawn(shared_folder, monkeypatch):
    """A change under the title of a density would be read as one; a title that was asked for is taken."""
    problem = gx.discretise(gx.scenes.plate(2), gx.Q1)
    seen = []
    monkeypatch.setattr(plots, "_draw", lambda panels, title, *rest: seen.append(title))
    for options in ({}, {"relative": True}, {"relative": True, "title": "growth"}):
        plots.density(problem, shared_folder / "a.png", **options)
        plots.densities({"one": problem}, shared_folder / "a.png", **options)
    names = ["density", "[ρ − ρ*]/ρ*", "growth"]
    assert COMM.rank > 0 or seen == [name for name in names for _ in range(2)]


def test_a_second_scale_tells_the_density_of_the_same_colours(shared_folder, monkeypatch):
    """Its ends are ρ* (1 + change) of the first one's; where ρ* varies no such scale could be right."""
    problem = gx.solve(gx.scenes.plate(2), gx.Q1).problem
    seen = []
    monkeypatch.setattr(plots, "add_colour_bars", lambda plotter, mapper, scales, rests: seen.append(scales))
    plots.density(problem, shared_folder / "a.png", relative=True, scale="density")
    if COMM.rank == 0:
        (change, density), low, high = *seen, *problem.density_range()
    else:
        problem.density_range()
        return
    assert (density.title, change.title) == ("density", "[ρ − ρ*]/ρ*")
    assert (density.low, density.high) == pytest.approx((low, high), rel=1e-12)
    assert (change.low, change.high) == pytest.approx((low - 1, high - 1), rel=1e-12)


def test_a_second_scale_of_several_references_is_refused(shared_folder):
    """Within a body, or between bodies."""
    varied, one = halves(gx.Q1, initial_density=1.5), gx.discretise(gx.scenes.plate(2), gx.Q1)
    for problems in ({"a": varied}, {"a": one, "b": varied}, {"a": one, "b": gx.discretise(gx.scenes.femur(), gx.Q1)}):
        with pytest.raises(gx.InputError, match="one number that all bodies have everywhere would be right"):
            plots.densities(problems, shared_folder / "a.png", relative=True, scale="density")


def test_greek_letters_are_drawn(shared_folder):
    """In titles and in the texts above panels: VTK's own fonts leave them out, and two names look alike."""
    problem = gx.discretise(gx.scenes.plate(2), gx.Q1)
    for name, title, label in (("none", "", "Q"), ("title", "Ψ₀", "Q"), ("other", "ρρ", "Q"), ("label", "ρρ", "Qρ")):
        plots.densities({label: problem}, shared_folder / f"{name}.png", title=title)
    COMM.barrier()
    images = [matplotlib.image.imread(shared_folder / f"{name}.png") for name in ("none", "title", "other", "label")]
    assert all((one != other).any() for i, one in enumerate(images) for other in images[:i])


def test_several_bodies_in_one_picture(shared_folder):
    """Panels side by side share one range of colours: a colour means the same density in all of them."""
    problems = {name: gx.solve(gx.scenes.plate(4), gx.variants.named(name)).problem for name in ("Q1Q1", "Q1P0", "Q1")}
    path = shared_folder / "panels.png"
    plots.densities(problems, path, columns=2)
    COMM.barrier()
    image = matplotlib.image.imread(path)[:, :, :3]
    coloured = np.abs(image - image.mean(axis=2, keepdims=True)).max(axis=2) > 0.1
    middle = image.shape[0] // 2, (image.shape[1] - plots.BAR_WIDTH) // 2
    for rows, columns in ((0, 0), (0, 1), (1, 0)):
        panel = coloured[rows * middle[0] : (rows + 1) * middle[0], columns * middle[1] : (columns + 1) * middle[1]]
        assert 0.05 < panel.mean() < 0.9
    assert not coloured[middle[0] :, middle[1] : 2 * middle[1]].any()  # the place of a fourth is empty
    assert coloured[:, 2 * middle[1] :].any()  # the colour bar


def test_a_failure_to_draw_is_one_on_all_ranks(problem, shared_folder, monkeypatch):
    """No rank waits for another, and each hears of it: of a full disk in a sentence, too."""
    for failure, kind in ((OSError(28, "no space"), OutputError), (RuntimeError("no picture"), Exception)):

        def fail(*arguments, failure=failure):
            raise failure

        monkeypatch.setattr(plots, "_draw", fail)
        with pytest.raises(kind, match=r"no space|no picture|could not be drawn"):
            plots.density(problem, shared_folder / "density.png")


@pytest.mark.parametrize("suffix", plots.IMAGES)
def test_every_format_of_images_can_be_written(suffix, shared_folder):
    """A sentence that lists them must be right."""
    problem = gx.discretise(gx.scenes.plate(2), gx.Q1P0)
    plots.density(problem, shared_folder / f"density{suffix}")
    COMM.barrier()
    assert (shared_folder / f"density{suffix}").stat().st_size > 1000


@pytest.mark.parametrize("suffix", plots.GRAPHS)
def test_every_format_of_graphs_can_be_written(suffix, shared_folder):
    """As above."""
    problem = gx.discretise(gx.scenes.plate(2), gx.Q1P0)
    plots.along_length({"density": problem}, shared_folder / f"along{suffix}", [[0.1, 0.5], [1.9, 0.5]])
    COMM.barrier()
    assert (shared_folder / f"along{suffix}").stat().st_size > 1000


@pytest.mark.parametrize(
    ("path", "sentence"),
    [
        ("nowhere/a.png", r"is to be in the folder .*nowhere, which is not there: a file in a folder that is there"),
        ("a.xyz", r"has the suffix '.xyz': one of .png, .*, .tiff? would be right|.*.webp would be right"),
        ("a", r"has the suffix '': one of .png"),
        ("folder.png", r"is a folder: a file in it would be right"),
    ],
)
def test_pictures_that_could_not_be_written_are_refused_before(path, sentence, shared_folder, monkeypatch):
    """A picture at the end of a long run is lost by a typing error in its name: it is said before anything is drawn."""
    if COMM.rank == 0:
        (shared_folder / "folder.png").mkdir()
    problem = gx.discretise(gx.scenes.plate(2), gx.Q1)
    monkeypatch.setattr(plots, "_body", lambda *arguments: pytest.fail("this takes time"))
    monkeypatch.setattr(type(problem), "sample_density", lambda *arguments: pytest.fail("so does this"))
    file = shared_folder / path
    for draw in (
        lambda: plots.density(problem, file),
        lambda: plots.densities({"one": problem}, str(file)),
        lambda: plots.along_length({"one": problem}, file, [[0.1, 0.5]]),
    ):
        with pytest.raises(gx.InputError, match=sentence):
            draw()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(
            ("title", 5),
            ("title", None),
            ("scale", 5),
            ("scale", None),
            ("scale", "g/cm³"),
            ("relative", 1),
            ("smoothed", "no"),
            ("arrows", 0),
        ),
        *(("magnification", "x"), ("magnification", np.nan), ("magnification", None)),
        *(("columns", 0), ("columns", -1), ("columns", 1.5), ("columns", "2"), ("columns", True)),
        *(("problems", {}), ("problems", []), ("problems", {"a": 3}), ("problems", {1: 2}), ("problem", "Q1")),
        *(("path", 5), ("path", ""), ("path", b"a.png"), ("exact", {"a": 1.0}), ("exact", [1]), ("exact", {1: abs})),
        *(("places", []), ("places", [0.5, 0.5]), ("places", np.empty((0, 2))), ("places", [[0.5, 0.5, 0.1]])),
    ],
)
def test_wrong_arguments_of_pictures_are_refused(name, value, shared_folder):
    """Each in turn, in every call that has it."""
    problem = gx.discretise(gx.scenes.plate(2), gx.Q1)
    right = {"problem": problem, "problems": {"one": problem}, "path": shared_folder / "a.png", "places": [[0.1, 0.5]]}
    calls = [
        call
        for call in (plots.density, plots.densities, plots.along_length)
        if name in inspect.signature(call).parameters
    ]
    assert calls
    for call in calls:
        needed = {key: right[key] for key in inspect.signature(call).parameters if key in right}
        with pytest.raises(gx.InputError, match=r"would be right$"):
            call(**{**needed, name: value})


def test_deformed_shape_reaches_the_tip(problem):
    """The shape drawn is the deformed one: its loaded end lies where the displacement says."""
    from growthx.scenes.plate import tip_displacement

    body = plots._body(problem, relative=False, smoothed=False, magnification=1.0)
    at_rest, deformed = body.reference.reshape(-1, 3), body.deformed.reshape(-1, 3)
    tip = np.flatnonzero(np.isclose(at_rest[:, 0], 2.0) & np.isclose(at_rest[:, 1], 0.5))
    reached = tip_displacement(problem)
    assert COMM.rank > 0 or len(tip)  # gathered on rank 0
    assert deformed[tip, 1] == pytest.approx(0.5 + reached, rel=1e-12)


@pytest.mark.parametrize("name", ["Q2Q2", "Q1", "Q2", "P1", "P2P1"])
def test_profile_of_the_bar(name, shared_folder):
    """From end to end on any number of ranks: piecewise constant for densities at points, continuous for nodal ones."""
    variant = gx.variants.named(name)
    problem = gx.solve(gx.scenes.bar(DISCONTINUOUS, 10, shape=variant.cells[0], until=0.2), variant).problem
    places = lower_edge(DISCONTINUOUS)
    rho = problem.sample_density(places)
    low, high = problem.density_range()
    assert np.all(rho >= low * (1 - 1e-3)) and np.all(rho <= high * (1 + 1e-3))
    jumps = np.abs(np.diff(rho))
    if variant.density.local:
        assert len(np.unique(rho.round(12))) <= 10 * len(problem.density_space.dofmap.list[0])
        assert np.count_nonzero(jumps > 1e-12) <= 3 * 10
    else:
        assert jumps.max() < 0.02 * (high - low)
    path = shared_folder / f"{name}.png"
    plots.along_length({name: problem}, path, places, exact={"one": lambda x: 1.0})
    COMM.barrier()
    assert path.stat().st_size > 10_000


@pytest.mark.parametrize(
    ("library", "name"), [("pyvista", "plate.png"), ("pyvista", "plate.gif"), ("matplotlib", "bar.pdf")]
)
def test_a_library_that_is_not_there_is_named_before_anything_is_drawn(library, name, shared_folder, monkeypatch):
    """The pictures' is one of those that pip installs on request; a long run must not end in an ImportError."""
    monkeypatch.setitem(sys.modules, library, None)
    draw = {
        "plate.png": lambda path: plots.density(gx.discretise(gx.scenes.plate(2), gx.Q1P0), path),
        "plate.gif": lambda path: plots.movie(shared_folder, path),
        "bar.pdf": lambda path: plots.along_length({"": gx.discretise(gx.scenes.plate(2), gx.Q1P0)}, path, np.eye(2)),
    }
    with pytest.raises(gx.InputError, match=f"is drawn by {library}, which is not installed: .* is needed"):
        draw[name](shared_folder / name)


def test_a_library_that_does_not_import_is_told(shared_folder, monkeypatch):
    """As pyvista beside a VTK that is newer than it knows: a sentence, and no traceback, on all ranks."""
    problem = gx.discretise(gx.scenes.plate(2), gx.Q1P0)

    def fail(*_):
        raise ImportError("no capsules here")

    monkeypatch.setattr("growthx.post.plots._draw", fail)
    with pytest.raises(OutputError, match=r"a library does not import \(no capsules here\): `growthx doctor` tells"):
        plots.density(problem, shared_folder / "plate.png")


def test_several_bodies_in_space_are_refused():
    """They are drawn one by one: a sentence says by what."""
    from blocks import block, cube

    problem = gx.discretise(block(cube(2)), gx.Q1P0)
    with pytest.raises(gx.InputError, match=r"the body has 3 dimensions: .* gx.plots.slices draw one of the others"):
        plots.densities({"one": problem}, "never.png")
