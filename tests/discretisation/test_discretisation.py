"""The discretised scene: tangents, loads, regions that do not grow, fields and the initial density."""

from dataclasses import replace
from functools import cache

import dolfinx
import numpy as np
import pytest
from blocks import (
    COMM,
    assert_tangent_matches_differences,
    block,
    densities,
    differences,
    displacements,
    gathered,
    run,
    set_iterate,
    square,
    tangent,
)

import growthx as gx
from growthx.common.errors import InputError
from growthx.discretisation.variants import CATALOGUE

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
LOCAL = [variant for variant in CATALOGUE.values() if variant.density.local]
local_variants = pytest.mark.parametrize("variant", LOCAL, ids=lambda variant: variant.name)
# One for each way to come by a density, and one with displacements of a higher order on triangles.
KINDS = (gx.Q1Q1, gx.Q1P0, gx.Q1, gx.Q1sri, gx.P2P1)
kinds = pytest.mark.parametrize("variant", KINDS, ids=lambda variant: variant.name)

# -- the tangent -------------------------------------------------------------------------------------------------------


def iterate(variant, **changes):
    """A distorted block with varying E, Ψ₀* and ρ(0), at an iterate far from balance; one parameter may be changed."""
    change = {"E": 1.0, "nu": 1.0, "rho": 1.0, "n": 1.0, "c": 1.0, "m": 1.0, "psi": 1.0, "dt": 1.0} | changes
    scene = block(
        square(2, distortion=0.06, shape=variant.cells[0]),
        material=gx.Material(
            young=lambda x: change["E"] * (1 + x[0] + 0.5 * x[1]),
            poisson=0.25 * change["nu"],
            reference_density=1.2 * change["rho"],
            density_exponent=2.0 * change["n"],
        ),
        growth=gx.EnergyDrivenGrowth(
            attractor=lambda x: change["psi"] * (0.02 + 0.03 * x[1]), rate=5.0 * change["c"], exponent=3.0 * change["m"]
        ),
        supports=(gx.Support("left", (0.0, None)), gx.Support("bottom", (None, 0.05))),
        initial_density=lambda x: 1.1 + 0.2 * x[0] - 0.1 * x[1],
    )
    problem = gx.discretise(scene, variant)
    problem.system.begin_step(0.1 * change["dt"], 0.7)
    set_iterate(
        problem,
        lambda x: np.stack([0.3 * np.sin(2 * x[0]) + 0.1 * x[1], 0.2 * x[0] * x[1] - 0.15 * x[1]]),
        lambda x: 1.0 + 0.3 * np.cos(3 * x[0] + x[1]),
    )
    return problem


@variants
def test_tangent_is_the_derivative_of_the_forces(variant):
    """Newton is quadratic only with it; eliminated densities are solved anew for each difference."""
    problem = iterate(variant)
    exact, approximate = tangent(problem), differences(problem)
    assert exact == pytest.approx(approximate, rel=1e-6, abs=1e-8 * np.abs(exact).max())


@cache
def tangent_before_the_change(variant):
    """The tangent that no parameter of `iterate` was changed for."""
    return tangent(iterate(variant))


@kinds
@pytest.mark.parametrize("parameter", ["E", "nu", "rho", "n", "c", "m", "psi", "dt"])
def test_tangent_knows_each_parameter(variant, parameter):
    """A parameter frozen at its first value would pass a test at that value alone."""
    changed = iterate(variant, **{parameter: 1.25})
    exact = tangent(changed)
    assert_tangent_matches_differences(changed, exact)
    change = np.abs(exact - tangent_before_the_change(variant)).max()
    if variant.density.local or parameter != "psi":
        assert change > 1e-4 * np.abs(exact).max()
    else:  # ∂R₀ does not hold Ψ₀*: only through a density that has been solved for does it enter
        assert change < 1e-14


@local_variants
def test_condensed_tangents_are_symmetric_but_for_two_rules(variant):
    """With one rule they derive from an incremental potential, and the solver factorises them as symmetric unasked."""
    problem = iterate(variant)
    exact = tangent(problem)
    asymmetry = np.abs(exact - exact.T).max() / np.abs(exact).max()
    assert problem.system.symmetric == (variant is not gx.Q1sri)
    assert asymmetry < 1e-14 if problem.system.symmetric else asymmetry > 1e-3


@pytest.mark.parametrize("cells", [1, 3])
@pytest.mark.parametrize("distortion", [0.0, 0.06], ids=["regular", "distorted"])
def test_two_rules_are_summed_and_not_mixed(cells, distortion):
    """DOLFINx assembles a form with a one-point and another rule wrongly, silently: Q1sri's parts must stay apart."""
    problem = gx.discretise(block(square(cells, distortion)), gx.Q1sri)
    problem.system.begin_step(0.1, 0.5)
    sheared = lambda x: np.stack([0.4 * x[1] + 0.2 * x[0] * x[1], 0.3 * np.sin(3 * x[0]) - 0.1 * x[1] ** 2])  # noqa: E731
    set_iterate(problem, sheared, None)
    exact = tangent(problem)
    assert exact == pytest.approx(differences(problem), rel=1e-6, abs=1e-8 * np.abs(exact).max())


@variants
def test_tangent_where_a_region_does_not_grow(variant):
    """There the tangent is a sum of two forms, with supports in both, and some densities are held."""
    scene = block(
        square(2, distortion=0.06, shape=variant.cells[0]), growing=("bone",), supports=(gx.Support("bottom"),)
    )
    problem = gx.discretise(scene, variant)
    problem.system.begin_step(0.1, 1.0)
    # A held density must stay what it is, so the iterate's density is the start's.
    set_iterate(problem, lambda x: np.stack([0.3 * x[0] * x[1], -0.2 * x[1]]), lambda x: np.full_like(x[0], 1.2))
    exact = tangent(problem)
    assert_tangent_matches_differences(problem, exact)


# -- loads -------------------------------------------------------------------------------------------------------------


def work(problem, displacement):
    """Work of the nodal loads on a virtual displacement given by position."""
    set_iterate(problem, displacement, lambda x: np.ones_like(x[0]))
    size = problem.system.owned
    return COMM.allreduce(float(problem.system.loads.nodal_load @ problem.system.unknown.x.array[:size]))


@variants
def test_traction_is_integrated_over_its_own_boundary(variant):
    """A constant and a linear traction on a distorted mesh, each with its resultant known, and nothing elsewhere."""
    loads = (gx.Traction("right", (0.3, -0.2)), gx.Traction("top", lambda x: np.stack([0 * x[0], 2 * x[0]])))
    problem = gx.discretise(block(square(3, 0.05, shape=variant.cells[0]), loads=loads), variant)
    assert problem.system.loads.resultant(problem.system.loads.nodal_load) == pytest.approx(
        [0.3, -0.2 + 1.0], rel=1e-13
    )


@variants
def test_distributed_force_meets_its_resultant_and_its_weight(variant):
    """The resultant is exact whatever the weight's own size; its moment shows where the force acts."""
    force = gx.DistributedForce("right", (3.0, -1.0), weight=lambda x: 17.0 * x[1])
    problem = gx.discretise(block(square(3, 0.05, shape=variant.cells[0]), loads=(force,)), variant)
    assert problem.system.loads.resultant(problem.system.loads.nodal_load) == pytest.approx([3.0, -1.0], rel=1e-13)
    assert work(problem, lambda x: np.stack([x[1] * x[0], 0 * x[0]])) == pytest.approx(3.0 * 2 / 3, rel=1e-12)


def test_a_curved_weight_has_the_same_resultant_on_every_mesh():
    """The load is a function of position: facets must not change the force."""
    for cells in (2, 5):
        force = gx.DistributedForce("right", (0.0, -2.0), weight=lambda x: np.maximum(np.sin(9 * x[1]), 0))
        problem = gx.discretise(block(square(cells), loads=(force,)), gx.Q1)
        assert problem.system.loads.resultant(problem.system.loads.nodal_load) == pytest.approx([0.0, -2.0], abs=1e-14)


@pytest.mark.parametrize(
    ("load", "words"),
    [
        (gx.DistributedForce("right", (1.0, 0.0), weight=lambda x: 0 * x[0]), "no weight"),
        (gx.Traction("right", lambda x: np.full((2, x.shape[1]), np.nan)), "not a number"),
    ],
    ids=["no weight", "nan"],
)
def test_a_load_that_is_none_is_refused(load, words):
    """A force that cannot be spread, or that is not a number, would end as a failed step with another reason."""
    with pytest.raises(InputError, match=f"'right'.*{words}|{words}.*'right'|on 'right'.*{words}"):
        gx.discretise(block(loads=(load,)), gx.Q1)


# -- regions that do not grow ------------------------------------------------------------------------------------------


@variants
def test_only_the_growing_region_grows(variant):
    """An implant keeps its density exactly; nodes on the interface belong to the bone, too, and grow."""
    scene = block(square(4, shape=variant.cells[0]), growing=("bone",))
    _, problem = run(scene, variant)
    x, _, rho = densities(problem).T
    assert np.all(rho[x > 0.5 + 1e-9] == 1.2)
    assert np.all(np.abs(rho[x < 0.5 + 1e-9] - 1.2) > 1e-6)


@variants
def test_a_resting_region_costs_no_densities(variant):
    """Neither global unknowns nor local balances are spent on it: half of the cells, or their nodes, are left."""
    problem = gx.discretise(block(square(4, shape=variant.cells[0]), growing=("bone",)), variant)
    growing, cell = COMM.allreduce(len(problem.growing_dofs)), variant.cells[0]
    if variant.density.local:
        cells = 8 if cell == "quadrilateral" else 16
        assert growing == cells * variant.density_element(cell).dim
    else:
        p = variant.density.degree
        assert growing == (2 * p + 1) * (4 * p + 1)
    # Nodes at the ends of all 16 · (degree)² squares, but for serendipity those inside the cells.
    nodes = (4 * variant.displacement.degree + 1) ** 2 - 16 * variant.name.startswith("S2")
    assert problem.dofs == 2 * nodes + (0 if variant.density.local else growing)


@variants
def test_resting_everywhere_but_in_name(variant):
    """With c = 0 nothing grows: the split into regions must not change the mechanics."""
    still = block(square(4, 0.05, shape=variant.cells[0]), growth=gx.EnergyDrivenGrowth(attractor=0.01, rate=0.0))
    whole, split = (run(scene, variant)[1] for scene in (still, replace(still, growing=("bone",))))
    assert displacements(split) == pytest.approx(displacements(whole), rel=1e-10, abs=1e-12)


@variants
def test_growth_of_all_regions_is_growth_everywhere(variant):
    """Naming every region takes the path of marked cells to the same end."""
    scene = block(square(4, 0.05, shape=variant.cells[0]))
    plain, named = (run(s, variant)[1] for s in (scene, replace(scene, growing=("bone", "implant"))))
    assert named.dofs == plain.dofs
    assert densities(named) == pytest.approx(densities(plain), rel=1e-12)


@variants
def test_mass_is_that_of_the_growing_region(variant):
    """The balance of mass is drawn for what grows: half the square at 1.2."""
    problem = gx.discretise(block(square(4, shape=variant.cells[0]), growing=("bone",)), variant)
    assert problem.mass() == pytest.approx(0.6, rel=1e-13)


# -- fields ------------------------------------------------------------------------------------------------------------


def three_ways(mesh, left, right):
    """The same field per region, as a function of position and as a DOLFINx Function."""
    function = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("DG", 0)))
    by_place = lambda x: np.where(x[0] < 0.5, left, right)  # noqa: E731
    function.interpolate(by_place)
    return {"bone": left, "implant": right}, by_place, function


@kinds
@pytest.mark.parametrize("parameter", ["E", "psi", "c", "rho(0)"])
def test_a_field_may_be_given_in_three_ways(variant, parameter):
    """They mean the same, and not the same as a uniform value."""
    mesh = square(4, shape=variant.cells[0])
    base = block(mesh)

    def scene(value):
        return {
            "E": lambda: replace(base, material=replace(base.material, young=value)),
            "psi": lambda: replace(base, growth=replace(base.growth, attractor=value)),
            "c": lambda: replace(base, growth=replace(base.growth, rate=value)),
            "rho(0)": lambda: replace(base, initial_density=value),
        }[parameter]()

    left, right = {"E": (1.0, 2.0), "psi": (0.01, 0.02), "c": (5.0, 2.0), "rho(0)": (1.2, 1.0)}[parameter]
    values = three_ways(mesh, left, right)
    if not variant.density.local and parameter == "rho(0)":
        values = (values[0], values[2])  # at nodes a function of position is taken as it is, a jump is averaged
    results = [densities(run(scene(value), variant)[1]) for value in values]
    for other in results[1:]:
        assert other == pytest.approx(results[0], rel=1e-11)
    assert np.abs(results[0] - densities(run(scene(left), variant)[1])).max() > 1e-4


@local_variants
def test_what_does_not_touch_grows_by_its_own_law(variant):
    """Under no load the density falls by cΨ₀*Δt each step, region by region: each point must get its own parameters."""
    mesh = square(4, shape=variant.cells[0])
    law = gx.EnergyDrivenGrowth(attractor={"bone": 0.1, "implant": 0.3}, rate={"bone": 1.0, "implant": 0.5})
    _, problem = run(block(mesh, growth=law, loads=(), supports=(gx.Support("left"),)), variant)
    x, _, rho = densities(problem).T
    assert rho == pytest.approx(np.where(x < 0.5, 1.2 - 0.4 * 0.1, 1.2 - 0.4 * 0.15), rel=1e-13)


# -- the initial density -----------------------------------------------------------------------------------------------


@variants
def test_initial_density_as_a_function_of_position(variant):
    """Each density starts with the value at its own place."""
    problem = gx.discretise(
        block(square(3, 0.05, shape=variant.cells[0]), initial_density=lambda x: 1 + 0.5 * x[0] + 0.1 * x[1]), variant
    )
    x, y, rho = densities(problem).T
    assert rho == pytest.approx(1 + 0.5 * x + 0.1 * y, rel=1e-12)


@variants
def test_initial_density_per_region_keeps_the_mass(variant):
    """Nodes on an interface take a mean, and the mass is that of the regions exactly."""
    problem = gx.discretise(
        block(square(4, shape=variant.cells[0]), initial_density={"bone": 1.0, "implant": 2.0}), variant
    )
    assert problem.mass() == pytest.approx(1.5, rel=1e-13)
    assert problem.density_range() == (1.0, 2.0)


@variants
def test_a_field_of_reference_density_is_where_growth_starts(variant):
    """Without ρ(0) the density starts at ρ*, also where that varies."""
    material = gx.Material(young=1.0, reference_density={"bone": 1.0, "implant": 2.0})
    scene = block(square(4, shape=variant.cells[0]), material=material, loads=(), growth=gx.EnergyDrivenGrowth(0.0))
    steps, problem = run(scene, variant)
    assert problem.mass() == pytest.approx(1.5, rel=1e-13)
    assert len(steps) == 4


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=["Q1P0", "Q1Q1"])
def test_an_initial_density_of_another_unit_is_refused(variant):
    """HU or kg/m³ are far away nearly everywhere; a density that is so in a few cells is somebody's own."""
    mesh = square(4, shape="quadrilateral")
    with pytest.raises(InputError, match=r"is 1200 somewhere, where the reference density is 1\.2: one in"):
        gx.discretise(block(mesh, material=gx.Material(1.0, 0.3, 1.2), initial_density=1200.0), variant)
    some = np.where(np.arange(mesh.cell_count) == 3, 200.0, 1.2)
    problem = gx.discretise(block(mesh, material=gx.Material(1.0, 0.3, 1.2), initial_density=some), variant)
    assert max(COMM.allgather(problem.density.x.array.max())) > 50


@pytest.mark.parametrize("wrong", [lambda x: 0.5 - x[0], lambda x: x[0] * np.nan, {"bone": 1.0, "implant": -1.0}])
def test_initial_density_must_be_positive(wrong):
    """A density of zero or below has no weight: said at once, not after a failed step."""
    with pytest.raises(InputError, match=r"initial density ρ\(0\)|field has no value"):
        gx.discretise(block(square(4), initial_density=wrong), gx.Q1)


def test_a_region_left_out_is_named():
    """A mapping that forgets a region must not leave cells with whatever is in memory."""
    with pytest.raises(InputError, match=r"'bone' .*no value in 8 of 16 cells"):
        gx.discretise(block(square(4), initial_density={"bone": 1.0}), gx.Q1)


# -- supports ----------------------------------------------------------------------------------------------------------


@variants
def test_supports_that_share_nodes_bear_the_load_once(variant):
    """A corner held by two supports must not be counted twice in the reactions."""
    scene = block(square(3, shape=variant.cells[0]), supports=(gx.Support("left"), gx.Support("bottom", (None, 0.0))))
    steps, problem = run(scene, variant)
    total = sum(steps[-1].reactions.values())
    assert total == pytest.approx([-0.1, 0.02], abs=1e-9)
    assert len(gathered(problem.system.loads.nodal_load)) == problem.dofs


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.S2Q1, gx.P2P2], ids=lambda variant: variant.name)
def test_the_parts_of_a_mixed_unknown_are_owned_as_their_own_spaces_are(variant):
    """Bounds, prescribed densities and solvers take the owned part of one for that of the other."""
    problem = gx.discretise(block(square(4, shape=variant.cells[0])), variant)
    owned, count = problem.system.owned, len(problem.volumes)
    densities = problem.system.unknowns.density_part
    assert np.all(densities[:count] < owned) and np.all(densities[count:] >= owned)
    (part,), dofmap = problem.system.unknowns.parts, problem.displacement_space.dofmap
    count = dofmap.index_map.size_local * dofmap.index_map_bs
    assert np.all(part[:count] < owned) and np.all(part[count:] >= owned)
    assert len(np.unique(np.concatenate([densities, part]))) == len(densities) + len(part)


@pytest.mark.parametrize(
    "variant", [gx.Q1P0, gx.Q1Q1, gx.Q1Q1.lumped(with_source=True)], ids=lambda variant: variant.name
)
def test_before_the_first_step_there_is_an_answer_or_a_sentence(variant):
    """What is not borne yet is no attribute that is not there yet."""
    problem = gx.discretise(block(square(2)), variant)
    with pytest.raises(gx.InputError, match=r"reactions of .* before its first step.* would be right$"):
        problem.reactions()
    growth = problem.scene.growth
    assert problem.mass_rate() == pytest.approx(-growth.rate * growth.attractor, rel=1e-12)
    assert problem.mass() == problem.mean_density() * problem.spaces.growing_size()


def test_before_the_first_step_what_holds_densities_is_not_known():
    """A part of the mass rate for the whole would be a wrong number without a word."""
    scene = block(square(2), prescribed_densities=(gx.PrescribedDensity("top", 1.3),))
    problem = gx.discretise(scene, gx.Q1Q1)
    with pytest.raises(gx.InputError, match=r"^the mass rate of the scene 'block' .* before its first step, .* right$"):
        problem.mass_rate()
    next(gx.march(scene, gx.Q1Q1, problem))
    assert np.isfinite(problem.mass_rate())
