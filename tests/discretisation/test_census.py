"""Everything that can be given, in every way it can be given: what must agree, agrees to round-off.

A disagreement is a defect even if no one has met it.  What is tried:

- options: every kind of growth law, dead zone, bounds, exponent, load, support, history, program, scheme and stepping
  of a block that is homogeneous, by all discretisations of quadrilaterals against one another, and on triangles.
- fields: every parameter that may vary in space, as a number, a function, a DOLFINx function, a mapping of regions, and
  mappings of functions, over all and over some regions; by one discretisation of each kind, in the plane and in space.
- loads: every kind on an outer boundary, one inside and one that is both, against what statics says.
- exceptions in the middle of a run leave a problem that goes on.
"""

from dataclasses import replace

import dolfinx
import numpy as np
import pytest
import ufl
from blocks import COMM, ROLLERS, block, cube, densities, run, square

import growthx as gx
from growthx.common.errors import InputError
from growthx.discretisation.variants import CATALOGUE, suited
from growthx.stepping.time_schemes import SDIRK2

QUADRILATERALS = suited("quadrilateral")
KINDS = (gx.Q1, gx.Q1P0, gx.Q1sri, gx.Q1Q1)
kinds = pytest.mark.parametrize("variant", KINDS, ids=lambda variant: variant.name)

MATERIAL = gx.Material(3.0, 0.3, 1.2)
GROWTH = gx.EnergyDrivenGrowth(0.05, rate=4.0)
PULL = gx.Traction("right", (0.9, 0.0))


def history(t):
    """A load that comes and goes."""
    return min(2 * t, 1.0) * np.cos(t)


def strained(kind, zone):
    """A law driven by an equivalent strain or stress, near its set point under the pull."""
    attractor = 0.2 if kind is gx.StrainDrivenGrowth else 0.6
    return {"growth": kind(attractor, rate=1.0, exponent=1.5, dead_zone=zone)}


OPTIONS = {
    "plain": {},
    "dead zone": {"growth": replace(GROWTH, dead_zone=0.01)},
    "bounds": {"growth": replace(GROWTH, bounds=(1.1, 1.25))},
    "bounds and dead zone": {"growth": replace(GROWTH, dead_zone=0.01, bounds=(1.1, 1.25))},
    "energy per mass": {"growth": gx.SpecificEnergyDrivenGrowth(0.04, rate=4.0)},
    "strain": strained(gx.StrainDrivenGrowth, 0.0),
    "strain, dead zone": strained(gx.StrainDrivenGrowth, 0.02),
    "stress": strained(gx.StressDrivenGrowth, 0.0),
    "m of 4.5": {"growth": replace(GROWTH, exponent=4.5)},
    "m of 2, as n": {"growth": replace(GROWTH, exponent=2.0)},
    "m of 1, below n": {"growth": replace(GROWTH, exponent=1.0), "program": gx.Program(step=0.02, until=0.1)},
    "n of 0": {"material": replace(MATERIAL, density_exponent=0.0)},
    "n of 2.5": {"material": replace(MATERIAL, density_exponent=2.5)},
    "initial density": {"initial_density": 0.9},
    "history": {"loads": (replace(PULL, history=history),)},
    "moved": {"loads": (), "supports": (*ROLLERS, gx.Support("right", (0.3, None)))},
    "pressed": {"loads": (gx.Pressure("right", 0.3),)},
    "spring": {"loads": (PULL, gx.OpenTraction("right", lambda u, rho, x: ufl.as_vector([-0.5 * u[0], 0.0])))},
    "resultant": {"loads": (gx.DistributedForce("right", (0.9, 0.0)),)},
    "no ramp": {"program": gx.Program(step=0.1, until=0.4)},
    "requested": {"program": gx.Program(step=0.1, until=0.4, ramp=0.2, requested=(0.15, 0.33))},
    "cases": {
        "loads": (),
        "cases": (gx.LoadCase("pull", 3.0, (PULL,)), gx.LoadCase("press", 1.0, (gx.Pressure("right", 0.3),))),
    },
    "bone's strains": {
        "material": gx.Material(17000.0, 0.3, 1.8),
        "growth": gx.EnergyDrivenGrowth(1e-3, rate=200.0, dead_zone=1e-4),
        "loads": (gx.Traction("right", (5.0, 0.0)),),
    },
}
RUNS = {
    "full Newton": {"full_newton": True},
    "adaptive": {"stepping": gx.AdaptiveSteps(1e-3)},
    "SDIRK2": {"stepping": gx.FixedSteps(scheme=SDIRK2)},
    "TR-BDF2": {"stepping": gx.FixedSteps(scheme=gx.TR_BDF2)},
    "not predicted": {"stepping": gx.FixedSteps(predicted=False)},
}


def pulled(shape="quadrilateral", **changes):
    """A block in uniaxial tension on rollers."""
    scene = block(square(2, 0.06, shape=shape), material=MATERIAL, growth=GROWTH, supports=ROLLERS, loads=(PULL,))
    return replace(scene, **changes)


def one_density(scene, variant, **options):
    """The densities of all steps of a block that is homogeneous; they are the same everywhere."""
    steps, _ = run(scene, variant, tolerance=1e-12, **options)
    for step in steps:
        assert step.min_density == pytest.approx(step.max_density, rel=1e-9)
    return [step.mass for step in steps]  # of a unit square


QUICK = ("plain", "dead zone", "bounds", "n of 2.5", "moved", "cases", "bone's strains")  # the others compile for long
options = pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in OPTIONS]
)


@options
def test_all_discretisations_of_a_homogeneous_block_agree(name):
    """Under each option of a scene, to round-off."""
    expected = None
    for variant in QUADRILATERALS:
        found = one_density(pulled(**OPTIONS[name]), variant)
        expected = expected or found
        assert found == pytest.approx(expected, rel=1e-9), variant.name
    assert max(expected) - min(expected) > 1e-3, "the density must move for the comparison to mean something"


@pytest.mark.parametrize("name", RUNS)
def test_all_discretisations_agree_under_options_of_a_run(name):
    """… and of a march."""
    expected = None
    for variant in QUADRILATERALS:
        found = one_density(pulled(), variant, **RUNS[name])
        expected = expected or found
        assert found == pytest.approx(expected, rel=1e-4 if name == "adaptive" else 1e-9), variant.name


@pytest.mark.parametrize("name", ["plain", "dead zone", "bounds", "strain", "n of 2.5", "moved", "cases"])
def test_simplices_agree_with_quadrilaterals(name):
    """The same block in triangles."""
    expected = one_density(pulled(**OPTIONS[name]), gx.Q1)
    for variant in suited("triangle"):
        found = one_density(pulled("triangle", **OPTIONS[name]), variant)
        assert found == pytest.approx(expected, rel=1e-9), variant.name


# -- fields ------------------------------------------------------------------------------------------------------------

FIELDS = {  # where each is: a value in "bone" and one in "implant"
    "young": (3.0, 5.0),
    "poisson": (0.3, 0.1),
    "reference_density": (1.2, 1.5),
    "density_exponent": (2.0, 1.5),
    "attractor": (0.05, 0.03),
    "rate": (4.0, 1.0),
    "initial_density": (1.1, 1.3),
    "conduction": (1e-3, 5e-3),
}


def with_field(mesh, name, value):
    """A bent block with one of its parameters given so."""
    changes = {"material": MATERIAL, "growth": GROWTH}
    if name in ("young", "poisson", "reference_density", "density_exponent"):
        changes["material"] = replace(MATERIAL, **{name: value})
    elif name in ("attractor", "rate"):
        changes["growth"] = replace(GROWTH, **{name: value})
    elif name == "conduction":
        changes["flux"] = gx.MassFlux(value)
    else:
        changes[name] = value
    if name != "initial_density":
        changes["initial_density"] = 1.2
    return block(mesh, **changes)


def ways(mesh, bone, implant):
    """The same field, bone | implant left and right of the middle, in every way that it can be given."""
    cells = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("DG", 0)))
    cells.interpolate(lambda x: np.where(x[0] < 0.5, bone, implant))
    return {
        "mapping": {"bone": bone, "implant": implant},
        "mapping of functions": {"bone": lambda x: bone + 0 * x[0], "implant": lambda x: implant},
        "function": lambda x: np.where(x[0] < 0.5, bone, implant),
        "DOLFINx function": cells,
    }


def outcome(scene, variant):
    """Densities after two steps, in order."""
    _, problem = run(replace(scene, program=gx.Program(step=0.1, until=0.2, ramp=0.1)), variant, tolerance=1e-12)
    return densities(problem)[:, -1]


@pytest.mark.parametrize("name", FIELDS)
@pytest.mark.parametrize("dim", [2, pytest.param(3, marks=pytest.mark.slow)])
@kinds
def test_fields_mean_the_same_however_they_are_given(variant, dim, name):
    """Number against each other way of saying it everywhere; then two values, each way against the first."""
    if name == "conduction" and variant.density.local:
        pytest.skip("only densities that are continuous have a flux")
    mesh = square(4, shape=variant.cells[0]) if dim == 2 else cube(2, shape=variant.cells[1])
    bone, implant = FIELDS[name]
    number = outcome(with_field(mesh, name, bone), variant)
    expected = None
    for way, value in ways(mesh, bone, bone).items():
        assert outcome(with_field(mesh, name, value), variant) == pytest.approx(number, rel=1e-9), way
    for way, value in ways(mesh, bone, implant).items():
        if name == "initial_density" and not variant.density.local and way == "function":
            continue  # at nodes on the border a function says one thing, and the cells around two
        found = outcome(with_field(mesh, name, value), variant)
        expected = found if expected is None else expected
        assert found == pytest.approx(expected, rel=1e-9), way
    assert np.abs(expected - number).max() > 1e-6, "the second value must matter"


@pytest.mark.parametrize("name", FIELDS)
def test_fields_with_gaps_are_refused(name):
    """A region without a value, a name that is none, text, and a vector: sentences, in every place."""
    mesh = square(2)
    for value in ({"bone": FIELDS[name][0]}, {"bone": 1.0, "nowhere": 1.0}, {}, "stiff", (1.0, 2.0), None, True):
        if name == "initial_density" and value is None:
            continue  # the default
        with pytest.raises(InputError):
            run(with_field(mesh, name, value), gx.Q1Q1)


# -- loads -------------------------------------------------------------------------------------------------------------


def strip(dim):
    """Two units long, named at both ends, in the middle, and at middle and right end together."""
    kind = dolfinx.mesh.CellType.quadrilateral if dim == 2 else dolfinx.mesh.CellType.hexahedron
    low, high, count = [0.0] * dim, [2.0] + [1.0] * (dim - 1), [4] + [2] * (dim - 1)
    create = dolfinx.mesh.create_rectangle if dim == 2 else dolfinx.mesh.create_box
    domain = create(COMM, (low, high), count, kind)
    at = {"left": (0.0,), "interface": (1.0,), "right": (2.0,), "both": (1.0, 2.0)}
    facets = {
        name: dolfinx.mesh.locate_entities(
            domain, dim - 1, lambda x, places=places: np.any([np.isclose(x[0], place) for place in places], axis=0)
        )
        for name, places in at.items()
    }
    for axis, name in enumerate(("bottom", "front")[: dim - 1], start=1):
        facets[name] = dolfinx.mesh.locate_entities_boundary(
            domain, dim - 1, lambda x, axis=axis: np.isclose(x[axis], 0.0)
        )
    return gx.Mesh(domain, facets)


LOADS = {
    "Traction": lambda on: gx.Traction(on, (0.1, 0.02)),
    "Traction of position": lambda on: gx.Traction(on, lambda x: np.stack([0.1 + 0 * x[0], 0.02 + 0 * x[0]])),
    "DistributedForce": lambda on: gx.DistributedForce(on, (0.1, 0.02)),
    "OpenTraction": lambda on: gx.OpenTraction(on, lambda u, rho, x: ufl.as_vector([0.1, 0.02])),
}


@pytest.mark.parametrize("on", ["right", "interface", "both"])
@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1, gx.S2fri], ids=lambda variant: variant.name)
def test_every_load_acts_wherever_it_is(variant, load, on):
    """The support bears it once for each unit of length, outer, inner or both."""
    scene = block(strip(2), loads=(LOADS[load](on),), supports=(gx.Support("left"),))
    (*_, last), _ = run(scene, variant)
    count = 2 if on == "both" and load != "DistributedForce" else 1
    assert last.reactions["left"] == pytest.approx([-0.1 * count, -0.02 * count], rel=1e-7)
    assert last.force_defect < 1e-8


@pytest.mark.parametrize("on", ["interface", "both"])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_pressure_inside_has_no_side(dim, on):
    """Refused, whatever the discretisation."""
    for variant in (gx.Q1, gx.Q1Q1):
        with pytest.raises(InputError, match="inside the body"):
            run(block(strip(dim), loads=(gx.Pressure(on, 0.1),)), variant)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_pulled_strip_is_that_of_the_field_case(dim):
    """E = 1, ν = 0, no growth, a traction of 0.1 on the interface: both ends of the right half move by 0.1049876."""
    rollers = [gx.Support("left", (0.0,) + (None,) * (dim - 1)), gx.Support("bottom", (None, 0.0, None)[:dim])]
    rollers += [gx.Support("front", (None, None, 0.0))] if dim == 3 else []
    scene = block(
        strip(dim),
        material=gx.Material(1.0, 0.0),
        growth=gx.EnergyDrivenGrowth(0.01, rate=0.0),
        supports=tuple(rollers),
        loads=(gx.Traction("interface", (0.1,) + (0.0,) * (dim - 1)),),
    )
    (*_, last), problem = run(scene, gx.Q1, tolerance=1e-12)
    moved = problem.sample_displacement(np.array([[1.0] + [0.5] * (dim - 1), [2.0] + [0.5] * (dim - 1)]))
    assert moved[:, 0] == pytest.approx([0.1049875621, 0.1049875621], abs=1e-9)
    assert last.reactions["left"][0] == pytest.approx(-0.1, rel=1e-9)


# -- an exception in the middle ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
def test_what_is_raised_in_the_middle_leaves_the_last_state(variant):
    """A history that fails in the third step: what is raised comes out, and the state is that before it."""
    armed = []

    def failing(t):
        if t > 0.25 and armed:
            raise RuntimeError("the table of loads ends here")
        return min(5 * t, 1.0)

    scene = block(square(2, shape=variant.cells[0]), loads=(gx.Traction("right", (0.1, -0.02), history=failing),))
    problem = gx.discretise(scene, variant)
    march = gx.march(scene, variant, problem)
    mass = next(march).mass
    armed.append(True)
    with pytest.raises(RuntimeError, match="table of loads"):
        for step in march:
            mass = step.mass
    problem.system.reject_step()
    assert problem.mass() == pytest.approx(mass, rel=1e-14)
    assert np.isfinite(problem.system.unknown.x.array).all()
