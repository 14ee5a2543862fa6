"""What the calls of a run are given: used, or refused in a sentence before any time is spent."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import COMM, block, cube, square

import growthx as gx
from growthx import baselines, meshing, results, variants, wellposedness, zones
from growthx.discretisation.variants import CATALOGUE
from growthx.fem.cells import SIMPLICES, TENSOR_CELLS

CALLS = {
    "solve": gx.solve,
    "march": gx.march,
    "discretise": gx.discretise,
    "homeostasis": gx.homeostasis,
    "frozen": baselines.frozen,
    "update": baselines.update,
}
calls = pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
SOLVING = ("solve", "march", "homeostasis", "update")


@pytest.fixture(scope="module")
def scene():
    """A clamped block."""
    return block(square(2))


@pytest.fixture(autouse=True)
def no_time_is_spent(monkeypatch):
    """The first thing that costs anything is looked for what is not convex."""
    spent = lambda mesh: pytest.fail("too late")  # noqa: E731
    monkeypatch.setattr("growthx.discretisation.discretise.check_cells", spent)


@calls
@pytest.mark.parametrize("name", ["Q1", "q1", "Q1P0"])
def test_the_name_of_a_variant_is_answered_with_the_variant(call, name, scene):
    """As on the command line, a name is what comes to mind first."""
    right = {"q1": "Q1"}.get(name, name)
    with pytest.raises(gx.InputError) as caught:
        call(scene, name)
    assert str(caught.value) == f"the variant is '{name}': gx.{right} would be right"


@pytest.mark.parametrize("mesh", [square, lambda: square(shape="triangle"), cube, lambda: cube(shape="tetrahedron")])
@pytest.mark.parametrize("given", ["Q7", None, 5, gx.Variant, "P1", "Q1"], ids=repr)
def test_other_variants_are_answered_with_those_for_the_mesh(mesh, given):
    """A list with those for other cells would be no help."""
    scene = block(mesh(), loads=())
    with pytest.raises(gx.InputError) as caught:
        gx.solve(scene, given)
    listed = str(caught.value).partition(": ")[2].removesuffix(" would be right").removeprefix("one of ").split(", ")
    cells = TENSOR_CELLS if scene.mesh.cell_name in TENSOR_CELLS else SIMPLICES
    suited = {f"gx.{name}" for name, variant in CATALOGUE.items() if variant.cells == cells}
    assert set(listed) == (suited if f"gx.{given}" not in suited else {f"gx.{given}"})


@calls
def test_swapped_arguments_are_told_so(call, scene):
    """The commonest slip, and the sentence about either of them would be hard to read."""
    with pytest.raises(gx.InputError, match=r"^the scene is the variant Q1 and .* the other way round would be right$"):
        call(gx.Q1, scene)


@calls
@pytest.mark.parametrize("given", [None, "femur", gx.scenes.plate, 3], ids=["None", "femur", "plate", "3"])
def test_what_is_no_scene_is_refused(call, given, scene):
    """Also the function that makes one, and its mesh."""
    for wrong in (given, scene.mesh):
        with pytest.raises(gx.InputError, match=r"^the scene is .*: a Scene, such as .* would be right$"):
            call(wrong, gx.Q1)


@calls
def test_a_variant_for_other_cells_is_refused(call, scene):
    """Before a folder is made for results."""
    with pytest.raises(gx.InputError, match="P1 is a discretisation for triangles"):
        call(scene, gx.P1)


@pytest.mark.parametrize("call", SOLVING)
@pytest.mark.parametrize("tolerance", [0, -1, np.nan, np.inf, 1, 2.0, "1e-8", True, None, [1e-8], 1e-8j], ids=repr)
def test_impossible_tolerances_are_refused(call, tolerance, scene):
    """Zero is never met; from one on, nothing is solved for."""
    with pytest.raises(gx.InputError, match=r"^the tolerance of Newton's method is .*: a number between 0 and 1 would"):
        CALLS[call](scene, gx.Q1, tolerance=tolerance)


@pytest.mark.parametrize("call", [gx.solve, gx.march], ids=["solve", "march"])
@pytest.mark.parametrize("stepping", [1e-3, "adaptive", gx.AdaptiveSteps, gx.IMPLICIT_EULER, 0, False], ids=str)
def test_what_is_no_stepping_is_refused(call, stepping, scene):
    """The tolerance alone is what comes to mind."""
    with pytest.raises(gx.InputError, match=r"^the stepping is .*: FixedSteps\(\) or AdaptiveSteps\(1e-3\) would be "):
        call(scene, gx.Q1, stepping=stepping)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(("full_newton", 1), ("full_newton", "yes"), ("full_newton", None)),
        *(("watch", 3), ("watch", "x"), ("watch", int), ("watch", [print])),
        *(("out", 5), ("out", b"x"), ("out", ""), ("out", ["a"]), ("out", "nul\0l"), ("out", True)),
        *(("resume", 5), ("resume", b"x"), ("resume", ""), ("refuge", 5), ("refuge", False)),
        *(("checkpoint", 0), ("checkpoint", -1), ("checkpoint", 1.5), ("checkpoint", "2"), ("checkpoint", True)),
    ],
)
def test_wrong_arguments_of_solve_are_refused(name, value, scene, tmp_path):
    """What is wrong with where results go would come out when hours have gone."""
    with pytest.raises(gx.InputError, match=r" would be right$"):
        gx.solve(scene, gx.Q1, **{"out": tmp_path / "never", name: value})
    assert not (tmp_path / "never").exists()


@pytest.mark.parametrize(
    ("name", "value"),
    [("floor", 0), ("floor", "x"), ("source_average", 3), ("density_average", baselines.Smoothed), ("problem", 3)],
)
def test_wrong_arguments_of_updates_are_refused_at_once(name, value, scene):
    """Not when the first step is asked for."""
    with pytest.raises(gx.InputError, match=r" would be right$"):
        baselines.update(scene, gx.Q1, **({"problem": object()} | {name: value}))


def test_a_floor_above_the_highest_density_is_refused(scene):
    """It would be ignored."""
    bounded = replace(scene, growth=replace(scene.growth, bounds=(None, 1.5)))
    with pytest.raises(gx.InputError, match=r"the lowest density is 2 and the law's highest is 1.5: one below"):
        baselines.update(bounded, gx.Q1, object(), floor=2.0)


def test_a_problem_of_another_scene_is_refused(scene, monkeypatch):
    """The steps would be those of one scene and the loads those of the other."""
    monkeypatch.undo()
    problem = gx.discretise(scene, gx.Q1)
    for other, what in (
        (block(square(2)), "mesh"),
        (replace(scene, program=gx.Program(step=0.05, until=0.4)), "program"),
        (replace(scene, growth=gx.EnergyDrivenGrowth(attractor=lambda x: 1.0)), "growth"),
        (replace(scene, loads=()), "loads"),
    ):
        with pytest.raises(gx.InputError, match=f"of another scene, 'block', than 'block', by its {what}: .* right$"):
            gx.march(other, gx.Q1, problem)
    with pytest.raises(gx.InputError, match="the problem is discretised by Q1 and the variant is Q1P0: the same one"):
        gx.march(scene, gx.Q1P0, problem)
    with pytest.raises(gx.InputError, match="the problem is 3: a discretised scene"):
        gx.march(scene, gx.Q1, 3)
    assert next(gx.march(replace(scene), gx.Q1, problem)).time == 0.1  # an equal one is the same


def test_updates_of_a_problem_of_another_scene_are_refused(scene, monkeypatch):
    """As above: the floor, the bounds and the source are the scene's, the loads the problem's."""
    monkeypatch.undo()
    problem = baselines.frozen(scene, gx.Q1P0)
    with pytest.raises(gx.InputError, match=r"of another scene, .*, by its loads"):
        baselines.update(replace(scene, loads=()), gx.Q1P0, problem)
    assert next(baselines.update(scene, gx.Q1P0, problem)).time == 0.1


@pytest.mark.parametrize(
    "call",
    [
        lambda scene: wellposedness.check(scene),
        lambda scene: wellposedness.is_well_posed(3),
        lambda scene: zones.area_means(scene, {}),
        lambda scene: results.cell_fields(scene),
        lambda scene: results.summary(scene),
        lambda scene: results.write("folder", scene),
        lambda scene: results.write_history("folder", scene),
        lambda scene: results.new_folder(5, COMM),
        lambda scene: results.free_folder(b"x", COMM),
        lambda scene: results.FieldWriter(5, scene),
        lambda scene: results.FieldWriter("folder", scene),
        lambda scene: baselines.checkerboard_index(scene),
        lambda scene: baselines.high_frequency_index(3),
        lambda scene: meshing.locate(5),
        lambda scene: meshing.read(5),
        lambda scene: meshing.read("meshes/bar.geo", comm=5),
        lambda scene: meshing.triangles(5),
        lambda scene: variants.named(5),
        lambda scene: gx.scenes.bar(1),
    ],
)
def test_other_calls_refuse_what_they_cannot_use(call, scene):
    """The scene for the problem, the problem for the result, a number for a name."""
    with pytest.raises(gx.InputError, match=r" would be right$"):
        call(scene)


@pytest.mark.parametrize(
    ("polygons", "sentence"),
    [
        ({"a": [[0, 0], [1, 1]]}, "the corners of the zone 'a' are 2: three or more would be right"),
        ({"a": [0, 0]}, r"the corners of the zone 'a' are of shape \(2,\): shape \(corners, 2\)"),
        ({"a": [[0, 0], [1, 0], [1, np.nan]]}, r"the corners of the zone 'a' have \[1.0, nan\] among them"),
        ({"a": 3}, "the corners of the zone 'a' are of shape"),
        ({3: [[0, 0], [1, 0], [1, 1]]}, "the name of a zone is 3"),
        ([1], r"what holds the zones is \[1\]"),
    ],
)
def test_what_are_no_zones_is_refused(polygons, sentence, scene, monkeypatch):
    """A corner that is no number made the zone one of no place."""
    monkeypatch.undo()
    with pytest.raises(gx.InputError, match=f"^{sentence}"):
        zones.area_means(gx.discretise(scene, gx.Q1), polygons)


@pytest.mark.parametrize(
    ("module", "name", "there"),
    [
        (gx, "XYZ", ("Scene", "Q1", "solve")),
        (gx.scenes, "femurr", ("femur", "bar", "plate", "CONTINUOUS", "DISCONTINUOUS")),
        (gx.variants, "X", ("Q1", "P2P2", "named")),
    ],
)
def test_names_that_are_not_there_are_answered_with_those_that_are(module, name, there):
    """Misspelling a name is the commonest slip of all."""
    with pytest.raises(AttributeError) as caught:
        getattr(module, name)
    said = str(caught.value)
    public = "growthx" if module is gx else f"growthx.{module.__name__.rpartition('.')[2]}"
    assert said.startswith(f"{public} has no '{name}'; it has ") and all(each in said for each in there)
    assert all(hasattr(module, each) for each in said.partition("it has ")[2].split(", "))


def test_the_problems_of_the_bar_are_among_the_scenes():
    """What the function needs must be where the function is."""
    assert gx.scenes.bar(gx.scenes.CONTINUOUS, 10).name == "bar, continuous"
    assert gx.scenes.bar(gx.scenes.DISCONTINUOUS, 10).name == gx.scenes.bar(elements=10).name
