"""Whatever takes a discretised scene takes the result of a run as well: a newcomer has nothing else in hand."""

import pytest

import growthx as gx

LEFT = {"left": [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]}


@pytest.fixture(scope="module")
def result():
    """A small bent plate."""
    return gx.solve(gx.scenes.plate(4), gx.Q1P0)


@pytest.mark.parametrize(
    "read",
    [
        lambda each: gx.zones.area_means(each, LEFT),
        lambda each: gx.results.cell_fields(each, ("density",))["density"].tolist(),
        lambda each: gx.results.node_fields(each, ("density",))["density"].tolist(),
        lambda each: gx.results.point_fields(each, ("density",))["density"].tolist(),
        gx.baselines.checkerboard_index,
        gx.baselines.high_frequency_index,
        gx.wellposedness.check,
    ],
)
def test_a_result_is_read_as_its_problem(result, read):
    """The same numbers."""
    assert read(result) == read(result.problem)


def test_results_are_drawn(result, shared_folder):
    """In the plane, alone and side by side, and in space."""
    gx.plots.density(result, shared_folder / "one.png")
    gx.plots.densities({"one": result, "two": result.problem}, shared_folder / "two.png")
    block = gx.solve(gx.scenes.block(2), gx.Q1P0)
    gx.plots.density(block, shared_folder / "block.png")
    gx.plots.slices(block, shared_folder / "slices.png", ("axial",))
    gx.plots.cutaway(block, shared_folder / "cut.png")
    block.problem.comm.barrier()
    assert {path.name for path in shared_folder.iterdir()} >= {"one.png", "two.png", "slices.png", "cut.png"}


@pytest.mark.parametrize("given", [None, 3, "run", gx.Q1P0, gx.Result])
def test_what_has_no_density_is_refused(given):
    """With what would be right."""
    with pytest.raises(gx.InputError, match="a result, or a scene that is discretised, would be right"):
        gx.zones.area_means(given, LEFT)
