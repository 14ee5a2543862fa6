"""The momentum source b̄₀: its resultant, where it acts, a column that hangs by its own weight, and what is refused."""

import numpy as np
import pytest
from blocks import block, cube, displacements, run, square
from scipy.integrate import quad

import growthx as gx
from growthx.common.errors import InputError
from growthx.discretisation.variants import CATALOGUE

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)


def resultant(mesh, variant, *loads):
    """Sum of the nodal forces (force; per thickness in the plane)."""
    problem = gx.discretise(block(mesh, loads=loads), variant)
    return problem.system.loads.resultant(problem.system.loads.nodal_load)


@variants
def test_resultant_is_value_times_volume(variant):
    """On distorted cells, alone and on top of a traction, in the plane and in space."""
    force, traction = gx.BodyForce((0.3, -0.2)), gx.Traction("right", (0.1, 0.0))
    mesh = square(3, 0.06, length=2.0, shape=variant.cells[0])
    assert resultant(mesh, variant, force) == pytest.approx([4 * 0.3, 4 * -0.2], rel=1e-13)
    assert resultant(mesh, variant, force, traction) == pytest.approx([1.2 + 0.2, -0.8], rel=1e-13)


@pytest.mark.parametrize("variant", [gx.Q1, gx.S2fri, gx.P1P0, gx.P2P1], ids=lambda variant: variant.name)
def test_resultant_in_space(variant):
    """Three components, and a volume instead of an area."""
    mesh = cube(2, 0.1, variant.cells[1])
    assert resultant(mesh, variant, gx.BodyForce((0.3, -0.2, 1.5))) == pytest.approx([0.3, -0.2, 1.5], rel=1e-13)


@variants
def test_a_function_of_position_is_integrated(variant):
    """∫ (1 + x, 2y) over the unit square is (3/2, 1): linear functions must come out exactly on any mesh."""
    force = gx.BodyForce(lambda x: np.stack([1 + x[0], 2 * x[1]]))
    assert resultant(square(3, 0.06, shape=variant.cells[0]), variant, force) == pytest.approx([1.5, 1.0], rel=1e-13)


@variants
def test_a_region_alone_is_loaded(variant):
    """Half of the body: the sum is half, and the moment about the left side is that of the right half's middle."""
    mesh = square(4, shape=variant.cells[0])
    problem = gx.discretise(block(mesh, loads=(gx.BodyForce((0.0, -2.0), region="implant"),)), variant)
    assert problem.system.loads.resultant(problem.system.loads.nodal_load) == pytest.approx([0.0, -1.0], abs=1e-14)
    weighed = gx.BodyForce(lambda x: np.stack([0 * x[0], -2.0 * x[0]]), region="implant")
    assert resultant(mesh, variant, weighed) == pytest.approx([0.0, -0.75], abs=1e-13)


def hanging(variant, cells, value, young=2.0, **changes):
    """A column without lateral contraction that hangs from its top by its weight and does not grow."""
    return block(
        square(cells, shape=variant.cells[0]),
        material=gx.Material(young=young, poisson=0.0),
        growth=gx.EnergyDrivenGrowth(attractor=0.0, rate=0.0),
        supports=(gx.Support("top"),),
        loads=(gx.BodyForce((0.0, -value)),),
        program=gx.Program(step=1.0, until=1.0),
        **changes,
    )


def lowest(problem):
    """Displacement along the column of its lower end."""
    _, y, _, v = displacements(problem).T
    return v[np.isclose(y, 0.0)].mean()


HANGING = (gx.Q1, gx.S2fri, gx.Q2Q2, gx.P1P0, gx.P2P1)


@pytest.mark.parametrize("variant", HANGING, ids=lambda variant: variant.name)
def test_a_column_hangs_by_its_weight(variant):
    """With ν = 0, μ (λ − 1/λ) = g y bears what hangs below y: ∫ (1 − λ) dy is met to the order of the cells."""
    mu, weight = 1.0, 0.8

    def stretch(y):
        share = weight * y / mu
        return (share + np.sqrt(share**2 + 4)) / 2

    exact = quad(lambda y: 1 - stretch(y), 0, 1, epsabs=1e-14)[0]
    errors = []
    for cells in (4, 8):
        steps, problem = run(hanging(variant, cells, weight, young=2 * mu), variant, tolerance=1e-12)
        errors.append(abs(lowest(problem) - exact))
        assert steps[-1].reactions["top"] == pytest.approx([0.0, weight], abs=1e-9)
    order = np.log2(errors[0] / errors[1])
    assert order > variant.displacement.degree + 0.9
    assert errors[-1] < 1e-2 / 8 ** (variant.displacement.degree + 1)


@pytest.mark.parametrize("variant", [gx.Q1, gx.S2fri, gx.Q2Q2, gx.P2P1], ids=lambda variant: variant.name)
def test_a_light_column_follows_the_linear_theory(variant):
    """g L²/2E for small loads, exactly at these elements' nodes: what is left is of the second order in the load."""
    weight = 1e-4
    _, problem = run(hanging(variant, 3, weight), variant)
    assert lowest(problem) == pytest.approx(-weight / (2 * 2.0), rel=weight / 5)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), None, "1"], ids=repr)
def test_a_body_force_takes_finite_numbers_only(value):
    """The sentence says where, since a scene has many loads."""
    with pytest.raises(InputError) as caught:
        gx.BodyForce((1.0, value), region="bone")
    assert str(caught.value).startswith("a component of the body force in 'bone' is ")
    assert str(caught.value).endswith(": a finite number would be right")


@pytest.mark.parametrize(
    ("load", "sentence"),
    [
        (gx.BodyForce((1.0, 0.0), region="bne"), "the mesh has no region named 'bne'; it has 'bone', 'implant'"),
        (gx.BodyForce((1.0,)), "the load in the whole body has 1 entries: the mesh needs 2"),
        (gx.BodyForce((1.0, 0.0, 0.0), "bone"), "the load in 'bone' has 3 entries: the mesh needs 2"),
        (gx.BodyForce(lambda x: x), "the load in the whole body has 3 entries: the mesh needs 2"),
    ],
    ids=["unknown region", "too few", "too many", "function of three"],
)
def test_a_body_force_that_does_not_fit_is_refused(load, sentence):
    """It must be said with the scene, not when it is discretised."""
    with pytest.raises(InputError) as caught:
        block(square(2), loads=(load,))
    assert str(caught.value) == sentence


def test_a_body_force_that_is_no_number_is_refused():
    """A function of position shows its NaN only on the mesh; the step must not be what fails."""
    load = gx.BodyForce(lambda x: np.where(x[0] > 0.9, np.nan, 1.0) * np.ones((2, 1)))
    with pytest.raises(InputError) as caught:
        gx.discretise(block(square(2), loads=(load,)), gx.Q1)
    assert str(caught.value) == "the load in the whole body is not a number everywhere: finite forces would be right"
