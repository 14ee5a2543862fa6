"""A density exponent n that varies in space: each place must grow as if its own n were everybody's."""

import logging
from dataclasses import replace

import dolfinx
import numpy as np
import pytest
from blocks import (
    COMM,
    assert_tangent_matches_differences,
    block,
    densities,
    displacements,
    run,
    set_iterate,
    square,
    tangent,
)

import growthx as gx
from growthx import wellposedness
from growthx.common.errors import InputError
from growthx.constitutive.growth import EnergyDrivenGrowth, StrainDrivenGrowth
from growthx.constitutive.homogeneous import uniaxial_equilibrium
from growthx.constitutive.local.balance import solve_density
from growthx.constitutive.local.power import alike
from growthx.constitutive.local.source import LocalSource
from growthx.discretisation.variants import CATALOGUE
from growthx.model import exponents

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
some = pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1P0, gx.Q1, gx.Q1sri, gx.P2P1], ids=lambda v: v.name)


def two_blocks(shape, dim=2, **changes):
    """Two blocks that have nothing in common, "one" clamped at its left end and "other" at its right, both pulled."""
    cell, make = getattr(dolfinx.mesh.CellType, shape), (dolfinx.mesh.create_rectangle, dolfinx.mesh.create_box)
    counts = [6, 2] if dim == 2 else [3, 1, COMM.size]
    whole = make[dim - 2](COMM, [[0.0] * dim, [3.0] + [1.0] * (dim - 1)], counts, cell)
    middles = dolfinx.mesh.compute_midpoints(whole, dim, np.arange(whole.topology.index_map(dim).size_local))
    domain = dolfinx.mesh.create_submesh(whole, dim, np.flatnonzero(np.abs(middles[:, 0] - 1.5) > 0.5))[0]
    ends = {"left": 0.0, "end of one": 1.0, "end of other": 2.0, "right": 3.0}
    mesh = gx.Mesh.with_names(
        domain,
        {name: lambda x, at=at: np.isclose(x[0], at) for name, at in ends.items()},
        {"one": lambda x: x[0] < 1.5, "other": lambda x: x[0] > 1.5},
    )
    force = (0.1, -0.02, 0.01)[:dim]
    changes = {"initial_density": 0.8, **changes}
    return block(
        mesh,
        supports=(gx.Support("left"), gx.Support("right")),
        loads=(gx.Traction("end of one", force), gx.Traction("end of other", tuple(-f for f in force))),
        **changes,
    )


def with_n(scene, n):
    """The scene with another density exponent."""
    return replace(scene, material=replace(scene.material, density_exponent=n))


def assert_each_as_alone(scene, variant, one, other):
    """With n by region, each block as in the scene in which its n is everybody's."""
    both, *alone = (
        run(with_n(scene, n), variant, tolerance=1e-12)[1] for n in ({"one": one, "other": other}, one, other)
    )
    for kind in (densities, displacements):
        found, first, second = (kind(problem) for problem in (both, *alone))
        left = found[:, 0] < 1.5
        assert found[left] == pytest.approx(first[left], rel=1e-10, abs=1e-11)
        assert found[~left] == pytest.approx(second[~left], rel=1e-10, abs=1e-11)
        assert np.abs(first - second).max() > 1e-4, "n must matter"


@variants
def test_each_region_as_if_it_were_alone(variant):
    """The paper's n = 2, whose balance has a closed form for m = 3, beside n = 2.5, whose has none."""
    assert_each_as_alone(two_blocks(variant.cells[0]), variant, 2.0, 2.5)


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1P0, gx.Q1, gx.P1P1, gx.P1], ids=lambda v: v.name)
def test_in_space_too(variant):
    """Hexahedra and tetrahedra."""
    assert_each_as_alone(two_blocks(variant.cells[1], 3), variant, 2.0, 1.0)


LAWS = {
    "m between": gx.EnergyDrivenGrowth(0.01, 5.0, exponent=2.5),
    "m = n of one": gx.EnergyDrivenGrowth(0.01, 5.0, exponent=3.0),
    "m below both": gx.EnergyDrivenGrowth(0.01, 2.0, exponent=1.0),
    "dead zone": gx.EnergyDrivenGrowth(0.01, 5.0, exponent=2.5, dead_zone=0.004),
    "bounds": gx.EnergyDrivenGrowth(0.01, 5.0, exponent=3.5, bounds=(1.15, 1.3)),
    "per mass": gx.SpecificEnergyDrivenGrowth(0.01, 1.0),
    "strain": gx.StrainDrivenGrowth(0.1, 1.0),
    "stress": gx.StressDrivenGrowth(0.1, 1.0, exponent=2.5),
}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1P0, gx.Q1], ids=lambda v: v.name)
def test_with_every_law(variant, law):
    """Also where one region is well posed and the other is not, and each takes another way to its density."""
    assert_each_as_alone(two_blocks("quadrilateral", growth=LAWS[law]), variant, 2.0, 3.0)


@some
def test_however_it_is_given(variant):
    """Dictionary, function of position and DOLFINx function are one field; a uniform one is the number."""
    scene = block(square(4, 0.04, shape=variant.cells[0]), growth=gx.EnergyDrivenGrowth(0.01, 5.0, exponent=3.5))
    step = lambda x: np.where(x[0] < 0.5, 2.0, 3.0)  # noqa: E731
    function = dolfinx.fem.Function(dolfinx.fem.functionspace(scene.mesh.domain, ("DG", 0)))
    function.interpolate(step)
    ways = ({"bone": 2.0, "implant": 3}, step, function)
    first, *others = (densities(run(with_n(scene, n), variant)[1]) for n in ways)
    for other in others:
        assert other == pytest.approx(first, rel=1e-14)
    number, everywhere = (densities(run(with_n(scene, n), variant)[1]) for n in (2, {"bone": 2, "implant": 2.0}))
    assert everywhere == pytest.approx(number, rel=1e-10)


def linear(mesh, value):
    """A DOLFINx function that varies inside cells."""
    function = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("Lagrange", 1)))
    function.interpolate(value)
    return function


@variants
@pytest.mark.parametrize("inside", [False, True], ids=["by cells", "inside cells"])
def test_tangent_is_the_derivative_of_the_forces(variant, inside):
    """Also of a field that varies inside cells: where a cell has one density, its mean counts in both balances."""
    mesh = square(2, 0.06, shape=variant.cells[0])
    n = linear(mesh, lambda x: 1.5 + x[0]) if inside else {"bone": 2.0, "implant": 2.7}
    problem = gx.discretise(with_n(block(mesh), n), variant)
    problem.system.begin_step(0.1, 0.5)
    set_iterate(problem, lambda x: np.stack([0.3 * x[0] * x[1], -0.2 * x[1]]), lambda x: 1.0 + 0.2 * x[0])
    exact = tangent(problem)
    assert_tangent_matches_differences(problem, exact)
    assert not problem.system.symmetric or np.abs(exact - exact.T).max() < 1e-13 * np.abs(exact).max()


@pytest.mark.parametrize("name", ["rate", "reference_density", "young"])
def test_other_parameters_that_vary_inside_cells(name):
    """One density per cell, driven by a mean source: what enters that otherwise than linearly must do so alike."""
    for growth in (gx.EnergyDrivenGrowth(0.01, 5.0), gx.StrainDrivenGrowth(0.1, 1.0)):
        mesh = square(2, 0.06)
        scene = block(mesh, growth=growth, initial_density=1.2)
        law = "growth" if name == "rate" else "material"
        base = getattr(getattr(scene, law), name)
        field = linear(mesh, lambda x, base=base: base * (1 + 0.5 * x[0]))
        problem = gx.discretise(replace(scene, **{law: replace(getattr(scene, law), **{name: field})}), gx.Q1P0)
        problem.system.begin_step(0.1, 0.5)
        set_iterate(problem, lambda x: np.stack([0.3 * x[0] * x[1], -0.2 * x[1]]), None)
        assert_tangent_matches_differences(problem, tangent(problem))


# -- the local balance -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "growth", [EnergyDrivenGrowth(0.7, 1.4, 2.0), StrainDrivenGrowth(0.7, 1.4)], ids=["energy", "strain"]
)
@pytest.mark.parametrize("dead_zone", [0.0, 0.1])
@pytest.mark.parametrize("bounds", [(None, None), (0.5, 2.0)], ids=["free", "bounds"])
@pytest.mark.parametrize("of_each", [None, 3])
def test_arrays_of_exponents_are_solved_as_each_alone(growth, dead_zone, bounds, of_each):
    """Of any sign, among them the three with closed forms; one by one they are numbers, which other tests know."""
    from growthx.constitutive.material import Material

    random = np.random.default_rng(1)
    exponents = np.repeat([0.0, 0.5, 1.0, 1.5, 2.0, 2.7, 3.0, 4.0], 12)
    random.shuffle(exponents)
    old, energy = 10 ** random.uniform(-1, 1, len(exponents)), 10 ** random.uniform(-4, 1, len(exponents))
    weights = None
    if of_each is not None:
        energy, weights = energy[:, np.newaxis] * [0.3, 1.0, 1.9], np.tile([0.2, 0.5, 0.3], (len(old), 1))
    growth = replace(growth, dead_zone=dead_zone, bounds=bounds)
    source = LocalSource(growth, Material(2.0, 0.3, 1.3, exponents), energy, weights)
    for time_step in (1e-3, 0.3, 30.0):
        found = solve_density(source, old, time_step, old)
        for n in np.unique(exponents):
            at = np.flatnonzero(exponents == n)
            one = LocalSource(
                growth, Material(2.0, 0.3, 1.3, float(n)), energy[at], None if weights is None else weights[at]
            )
            assert np.allclose(found[at], solve_density(one, old[at], time_step, old[at]), rtol=1e-11, equal_nan=True)


def test_exponents_are_told_apart_by_what_is_to_be_done():
    """However many values there are, the groups are few."""
    exponents = np.concatenate([np.linspace(-3, 3, 1000), [-1.0, 0.0, 1.0, -1.0]])
    groups = alike(exponents)
    assert len(groups) == 7 and sorted(np.concatenate(groups)) == list(range(len(exponents)))
    for group in groups:
        k = exponents[group]
        assert np.all(k == k[0]) or not np.any(np.isin(k, (-1.0, 0.0, 1.0)))
        assert np.ptp(np.sign(k)) == 0 and (np.all(np.abs(k) <= 1) or np.all(np.abs(k) > 1))


# -- what must know that n may vary ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("n", "sentence"),
    [
        ({"bone": -1, "implant": 2.0}, "the density exponent n of 'bone' is -1: a number of at least 0 would be right"),
        (
            {"bone": np.nan, "implant": 2.0},
            "the density exponent n of 'bone' is nan: a number of at least 0 would be right",
        ),
        ("two", "the density exponent n is 'two': a number of at least 0 would be right"),
    ],
    ids=repr,
)
def test_impossible_exponents_are_refused(n, sentence):
    """As soon as they are given."""
    with pytest.raises(InputError) as caught:
        gx.Material(1.0, density_exponent=n)
    assert str(caught.value) == sentence


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1P0], ids=lambda v: v.name)
def test_impossible_values_of_functions_are_refused(variant):
    """Known only on the mesh, on all ranks: the least value may be another rank's."""
    wrong = lambda x: 1.0 - 2 * x[0]  # noqa: E731
    with pytest.raises(InputError, match=r"^the density exponent n is -0\.\d+ somewhere: a number of at least 0 would"):
        gx.discretise(with_n(block(square(4)), wrong), variant)
    with pytest.raises(InputError, match=r"the regions 'bone' has no value in 8 of 16 cells: one in each is needed"):
        gx.discretise(with_n(block(square(4)), {"bone": 2.0}), variant)


def test_the_worst_region_decides_what_is_well_posed(caplog, monkeypatch):
    """m > n everywhere where anything grows; the message names the region that spoils it."""
    scene = with_n(block(square(4)), {"bone": 2.0, "implant": 3.5})
    assert not wellposedness.is_well_posed(scene)
    assert wellposedness.is_well_posed(replace(scene, growing=("bone",)))
    assert wellposedness.is_well_posed(with_n(scene, {"bone": 2.0, "implant": 2.9}))
    assert wellposedness.is_well_posed(with_n(scene, lambda x: 2 + 0.9 * x[0]))
    assert not wellposedness.is_well_posed(with_n(scene, linear(scene.mesh, lambda x: 2 + 1.1 * x[0])))
    monkeypatch.setattr(exponents, "_said", set())
    with caplog.at_level(logging.WARNING, logger="growthx"):
        gx.discretise(scene, gx.Q1P0)
        gx.discretise(with_n(scene, lambda x: np.full_like(x[0], 4.0)), gx.Q1P0)
    messages = [record.getMessage() for record in caplog.records]
    if COMM.rank == 0:
        assert "(n − m = 0.5 in 'implant', not below 0)" in messages[0]
        assert "(n − m = 1 somewhere, not below 0)" in messages[1]
    assert len(messages) == (2 if COMM.rank == 0 else 0)


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1P0, gx.Q1], ids=lambda v: v.name)
def test_a_check_of_each_region_is_that_of_it_alone(variant):
    """The margin is the lower one of the two blocks, the negative pivots those of both."""
    scene = two_blocks("quadrilateral", growth=gx.EnergyDrivenGrowth(0.01, 2.0, exponent=2.5))
    found = [wellposedness.check(run(with_n(scene, n), variant)[1]) for n in ({"one": 2.0, "other": 3.5}, 2.0, 3.5)]
    assert [each.exponents for each in found] == [False, True, False]
    assert found[0].margin == pytest.approx(min(found[1].margin, found[2].margin), rel=1e-8)
    assert found[1].negative == 0 and 0 < found[0].negative < found[2].negative


def test_homogeneous_states_want_a_number():
    """Of a body whose n varies there is none."""
    with pytest.raises(
        InputError, match=r"^the density exponent n of a homogeneous state is {'bone': 2.0}: a number of"
    ):
        uniaxial_equilibrium(gx.Material(1.0, density_exponent={"bone": 2.0}), EnergyDrivenGrowth(0.7), 0.4)


def test_another_exponent_is_another_run(shared_folder):
    """In a dictionary, and in a function of position, of which only its values tell."""
    for number, (n, same, other) in enumerate(
        (
            ({"bone": 2.0, "implant": 2.5}, {"bone": 2, "implant": 2.5}, {"bone": 2.0, "implant": 2.6}),
            (lambda x: 2 + 0.5 * x[0], lambda x: 2 + x[0] / 2, lambda x: 2 + 0.6 * x[0]),
        )
    ):
        scene, folder = block(square(2)), shared_folder / str(number)
        gx.solve(with_n(scene, n), gx.Q1P0, out=folder, checkpoint=2)
        gx.solve(with_n(scene, same), gx.Q1P0, resume=folder)
        with pytest.raises(InputError, match=r"density_exponent"):
            gx.solve(with_n(scene, other), gx.Q1P0, resume=folder)


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1P0], ids=lambda v: v.name)
def test_baselines_know_it(variant):
    """The update after equilibrium, each block as alone."""
    from growthx import baselines

    scene, found = two_blocks("quadrilateral"), []
    for n in ({"one": 2.0, "other": 2.5}, 2.0, 2.5):
        problem = baselines.frozen(with_n(scene, n), variant)
        list(baselines.update(with_n(scene, n), variant, problem, tolerance=1e-12))
        found.append(densities(problem))
    left = found[0][:, 0] < 1.5
    assert found[0][left] == pytest.approx(found[1][left], rel=1e-10)
    assert found[0][~left] == pytest.approx(found[2][~left], rel=1e-10)


def test_a_law_of_ones_own_is_told_by_its_power(caplog, monkeypatch):
    """It has no m: what it calls its power is what rises."""
    law = type("Root", (EnergyDrivenGrowth,), {"power": lambda self, material: material.density_exponent - 2})
    monkeypatch.setattr(exponents, "_said", set())
    with caplog.at_level(logging.WARNING, logger="growthx"):
        gx.discretise(block(square(2), growth=law(attractor=1.0, rate=1.0)), gx.Q1P0)
    assert COMM.rank or "(its power = 0, not below 0)" in caplog.records[0].getMessage()
