"""Whatever is given to what makes a scene, it works or is refused in one sentence, on all ranks alike."""

from dataclasses import replace

import basix.ufl
import dolfinx
import numpy as np
import pytest
import ufl
from blocks import COMM, block, square
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

import growthx as gx
from growthx.common.errors import InputError
from growthx.meshing.mesh import Mesh
from growthx.scenes.bar import DISCONTINUOUS

# The same examples on all ranks and on all days; a failure is reported as found, since ranks must not shrink it apart.
FIXED = settings(
    derandomize=True,
    deadline=None,
    database=None,
    phases=[Phase.explicit, Phase.generate],
    suppress_health_check=list(HealthCheck),
)

NUMBERS = st.one_of(
    st.floats(),
    st.integers(),
    st.sampled_from([10**400, -(10**400), 1e308, 5e-324, np.float64("nan"), np.int8(3), np.True_, True]),
)
FUNCTIONS = st.sampled_from(
    [
        lambda x: x,
        lambda x: x[0],
        lambda x: x[:2],
        lambda x: 1.0,
        lambda x: -1.0,
        lambda x: np.full(x.shape[1], np.nan),
        lambda x: np.full((2, x.shape[1]), np.inf),
        lambda x: np.ones(7),
        lambda x: [1.0, 2.0],
        lambda x: [[1.0], [2.0, 3.0]],
        lambda x: 1j * x[0],
        lambda x: x[0] < 0.5,
        lambda x: x[0][x[0] < 0.4],
        lambda x: None,
        lambda x: "one",
        lambda x: {},
        lambda x: ufl.sqrt(2),
        lambda x: 1 / 0,
        lambda: 1.0,
    ]
)
LAWS = st.sampled_from(
    [
        lambda u, rho, x: u,
        lambda u, rho, x: rho,
        lambda u, rho, x: None,
        lambda u, rho, x: float("nan"),
        lambda u, rho, x: (u[0], u[1]),
        lambda u, rho, x: ufl.grad(u),
    ]
)
OTHERS = st.one_of(
    st.none(),
    st.text(max_size=6),
    st.binary(max_size=3),
    st.complex_numbers(),
    st.sampled_from(
        [
            *(object(), int, ..., range(3), set(), (), [], {}, "line\nbreak", "left", "bone", ("bone",)),
            *(np.array(1.0), np.ones(2), np.ones(3), np.ones((2, 2)), np.array("a"), np.array([])),
            *(ufl.Identity(2), ufl.as_ufl(2.0), ufl.triangle),
            *({"bone": 1.0, "implant": 2.0}, {"bone": 1.0}, {"bone": float("nan"), "implant": 1.0}, {3: None}),
        ]
    ),
)
VECTORS = st.one_of(
    st.tuples(NUMBERS), st.tuples(NUMBERS, NUMBERS), st.tuples(st.none(), NUMBERS), st.lists(OTHERS, max_size=3)
)
ANYTHING = st.one_of(
    NUMBERS, FUNCTIONS, LAWS, OTHERS, VECTORS, st.dictionaries(st.text(max_size=2), NUMBERS, max_size=2)
)


def one_sentence_at_most(make):
    """Call something that may refuse its input: on all ranks or none, and in one sentence."""
    sentence = ""
    try:
        make()
    except InputError as error:
        sentence = str(error)
        assert sentence and "\n" not in sentence and len(sentence) < 600
    assert len(set(COMM.allgather(bool(sentence)))) == 1  # sentences may show an object's place in memory


DOMAIN = dolfinx.mesh.create_unit_square(COMM, 2, 2)
TRACTION = gx.Traction("right", (0.1, 0.0))
OBJECTS = {
    gx.Material: {"young": 1.0, "poisson": 0.2, "reference_density": 1.0, "density_exponent": 2.0},
    gx.EnergyDrivenGrowth: {"attractor": 0.1, "rate": 1.0, "dead_zone": 0.0, "bounds": (None, None), "exponent": 3.0},
    gx.SpecificEnergyDrivenGrowth: {"attractor": 0.1, "rate": 1.0, "dead_zone": 0.0, "bounds": (0.5, None)},
    gx.Program: {"step": 0.1, "until": 1.0, "ramp": 0.5, "requested": (0.25,)},
    gx.Support: {"on": "left", "displacement": (0.0, None)},
    gx.PointSupport: {"at": (0.0, 0.0), "displacement": (0.0, None)},
    gx.Traction: {"on": "right", "value": (0.1, 0.0), "history": None},
    gx.DistributedForce: {"on": "right", "force": (0.1, 0.0), "weight": None, "case": "one", "history": None},
    gx.BodyForce: {"value": (0.1, 0.0), "region": None, "history": None},
    gx.OpenTraction: {"on": "right", "law": lambda u, rho, x: -u},
    gx.OpenBodyForce: {"law": lambda u, rho, x: -u},
    gx.Pressure: {"on": "right", "value": 0.1},
    gx.LoadCase: {"name": "one", "weight": 1.0, "loads": (TRACTION,)},
    gx.MassFlux: {"conduction": 1.0, "dependence": None},
    gx.PrescribedDensity: {"on": "left", "density": 1.0},
    gx.Influx: {"on": "right", "rate": 0.1},
    gx.Inertia: {"lumped": False},
    gx.FixedSteps: {"scheme": gx.IMPLICIT_EULER, "equilibrium": None, "predicted": True},
    gx.AdaptiveSteps: {
        **{"tolerance": 1e-3, "longest": 1.0, "scheme": gx.TR_BDF2, "equilibrium": None, "predicted": True}
    },
    gx.Mesh: {"domain": DOMAIN, "boundaries": {}, "regions": {}},
    Mesh.with_names: {"domain": DOMAIN, "boundaries": {}, "regions": {}},
}
PARAMETERS = [(make, name) for make, right in OBJECTS.items() for name in right]


@pytest.mark.parametrize(("make", "name"), PARAMETERS, ids=[f"{make.__name__}.{name}" for make, name in PARAMETERS])
def test_one_wrong_parameter(make, name):
    """Each in turn, the others right: else the first wrong one would hide the rest."""

    @settings(FIXED, max_examples=60)
    @given(ANYTHING)
    def with_value(value):
        one_sentence_at_most(lambda: make(**{**OBJECTS[make], name: value}))

    make(**OBJECTS[make])
    with_value()


def made(make, *parts):
    """Strategy of things to call that make an object of some parts, which may refuse them."""
    return st.tuples(*parts).map(lambda values: lambda: make(*values))


# Valid values that take no time; a mesh that is given spares another.
SCENES = {
    gx.scenes.bar: {"problem": DISCONTINUOUS, "elements": 10, "cells": "triangle", "n": 2.0, "m": 3.0, "step": 0.1},
    gx.scenes.plate: {"cells": 2, "shape": "triangle", "n": 2.0, "m": 3.0, "step": 0.1},
    gx.scenes.femur: {
        **{"mesh": gx.meshing.read(gx.meshing.locate("femur.geo"), size=9), "thickness": 30.0, "weights": (1, 0, 0)},
        **{"separate": False, "n": 2.0, "m": 3.0, "step": 4.0, "until": 8.0, "cells": "triangle", "refine": 1},
        **{"head": (43.0, 132.0, 24.0), "trochanter": ((-10.8, 134.7), (-29.2, 100.8))},
        "zones": {"canal": ((-5, 15), (4, 15), (4, 75))},
    },
}
SETTINGS = [(make, name) for make, right in SCENES.items() for name in right]


@pytest.mark.parametrize(("make", "name"), SETTINGS, ids=[f"{make.__name__}.{name}" for make, name in SETTINGS])
def test_one_wrong_setting_of_a_benchmark_scene(make, name):
    """What the command line and the demos pass on."""

    @settings(FIXED, max_examples=30)
    @given(
        ANYTHING.filter(lambda value: not (isinstance(value, int) and 100 < value <= 10**5))
    )  # of no use but to wait
    def with_value(value):
        one_sentence_at_most(lambda: make(**{**SCENES[make], name: value}))

    with_value()


SCENE = block(square(2))
GIVEN = made(lambda value: value, ANYTHING)
FIELDS = st.one_of(NUMBERS, FUNCTIONS, OTHERS)
# What passes the constructors must pass the discretisation, too, or be refused there.
PARTS = {
    "name": GIVEN,
    "mesh": GIVEN,
    "material": st.one_of(
        GIVEN,
        made(gx.Material, FIELDS),
        made(lambda poisson: gx.Material(1.0, poisson), FIELDS),
        made(lambda density: gx.Material(1.0, reference_density=density), FIELDS),
    ),
    "growth": st.one_of(GIVEN, made(gx.EnergyDrivenGrowth, FIELDS), made(gx.EnergyDrivenGrowth, st.just(0.1), FIELDS)),
    "supports": st.one_of(
        GIVEN,
        made(lambda on: (gx.Support(on),), st.sampled_from(["left", "lef", ""])),
        made(lambda at: (gx.PointSupport(at), gx.Support("left")), VECTORS),
        made(lambda values: (gx.Support("left", values),), VECTORS),
    ),
    "loads": st.one_of(
        GIVEN,
        made(lambda value: (gx.Traction("right", value),), st.one_of(FUNCTIONS, VECTORS)),
        made(lambda value: (gx.BodyForce(value),), FUNCTIONS),
        made(lambda weight: (gx.DistributedForce("right", (0.1, 0.0), weight),), FUNCTIONS),
        made(lambda law: (gx.OpenTraction("right", law),), LAWS),
    ),
    "program": GIVEN,
    "initial_density": made(lambda value: value, FIELDS),
    "growing": GIVEN,
    "flux": st.one_of(GIVEN, made(gx.MassFlux, FIELDS)),
    "prescribed_densities": st.one_of(GIVEN, made(lambda value: (gx.PrescribedDensity("left", value),), NUMBERS)),
    "influx": st.one_of(GIVEN, made(lambda rate: (gx.Influx("right", rate),), st.one_of(NUMBERS, LAWS))),
    "inertia": GIVEN,
    "cases": st.one_of(GIVEN, made(lambda weight: (gx.LoadCase("one", weight, (TRACTION,)),), NUMBERS)),
}


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1], ids=["Q1", "Q1Q1"])
@pytest.mark.parametrize("name", PARTS)
def test_one_wrong_part_of_a_scene(name, variant):
    """Functions of position show what they are only on a mesh, and each way to a density takes them its own way."""

    @settings(FIXED, max_examples=40)
    @given(PARTS[name])
    def with_part(make):
        one_sentence_at_most(lambda: gx.discretise(replace(SCENE, **{name: make()}), variant))

    with_part()


LOCATORS = st.one_of(FUNCTIONS, st.sampled_from([lambda x: x[0] < 0.3, lambda x: x[0] > 5, lambda x: True]))


@settings(FIXED, max_examples=60)
@given(st.dictionaries(st.text(max_size=3), LOCATORS, max_size=2), st.dictionaries(st.text(max_size=3), LOCATORS))
def test_names_of_parts_of_a_mesh(boundaries, regions):
    """C++ calls a locator, on each rank for its own points: whatever it returns or raises must not stay there."""
    one_sentence_at_most(lambda: Mesh.with_names(DOMAIN, boundaries, regions))


def test_a_function_that_fails_at_one_place_is_refused_on_all_ranks():
    """One rank would raise and the others wait for it."""

    def fails(x):
        if x.shape[1] and x[0].max() > 0.6:
            raise ZeroDivisionError("far out")
        return 1.0 + 0 * x[0]

    for refused in (
        lambda: gx.discretise(replace(SCENE, material=gx.Material(fails)), gx.Q1),
        lambda: gx.discretise(replace(SCENE, initial_density=fails), gx.Q1Q1),
        lambda: gx.discretise(replace(SCENE, loads=(gx.BodyForce(lambda x: [fails(x), fails(x)]),)), gx.Q1),
        lambda: Mesh.with_names(DOMAIN, {"right": lambda x: fails(x) > 0}),
    ):
        with pytest.raises(InputError, match=r"far out") as caught:
            refused()
        assert len(set(COMM.allgather(str(caught.value)))) == 1


@pytest.mark.parametrize(
    ("domain", "dims"),
    [
        (lambda: dolfinx.mesh.create_interval(COMM, 3, (0.0, 1.0)), "dimension 1 in a space of 1"),
        (lambda: _surface(), "dimension 2 in a space of 3"),
    ],
)
def test_meshes_of_no_body_are_refused(domain, dims):
    """A line or a shell has no deformation gradient of its own space."""
    with pytest.raises(InputError, match=dims):
        Mesh.with_names(domain(), {})


def _surface():
    """A triangle in space."""
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0]])
    cells = np.arange(3).reshape(1, 3)
    if COMM.rank:
        points, cells = points[:0], cells[:0]
    element = basix.ufl.element("Lagrange", "triangle", 1, shape=(3,))
    return dolfinx.mesh.create_mesh(COMM, cells=cells, x=points, e=ufl.Mesh(element))
