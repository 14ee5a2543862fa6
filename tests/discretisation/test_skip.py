"""A scene pays for what it asks for: no integral, field, vector or module is there for an ingredient it has not."""

import subprocess
import sys
from collections import Counter
from dataclasses import replace

import dolfinx
import numpy as np
import pytest
import ufl
from blocks import COMM, block, square
from ufl.corealg.traversal import unique_pre_traversal

import growthx as gx


@pytest.fixture
def census(monkeypatch):
    """Counts, of one call: compiled forms by the kinds of their integrals, their parts, functions, vectors."""
    count = Counter()
    compile_form, make_function, make_vector = dolfinx.jit.ffcx_jit, dolfinx.fem.Function.__init__, dolfinx.la.vector

    def counting_compile(comm, compiled, *arguments, **options):
        if isinstance(compiled, ufl.Form):
            integrals = {(part.integral_type(), str(part.metadata())) for part in compiled.integrals()}
            count["forms"] += 1
            count["rules"] += len(integrals)
            count["facet forms"] += any(kind != "cell" for kind, _ in integrals)
            count["coefficients"] += len(compiled.coefficients())
            count["constants"] += len(compiled.constants())
            count["nodes"] += sum(1 for part in compiled.integrals() for _ in unique_pre_traversal(part.integrand()))
        return compile_form(comm, compiled, *arguments, **options)

    def counting_function(self, *arguments, **options):
        count["functions"] += 1
        make_function(self, *arguments, **options)

    def counting_vector(*arguments, **options):
        count["vectors"] += 1
        return make_vector(*arguments, **options)

    monkeypatch.setattr(dolfinx.jit, "ffcx_jit", counting_compile)
    monkeypatch.setattr(dolfinx.fem.Function, "__init__", counting_function)
    monkeypatch.setattr(dolfinx.la, "vector", counting_vector)

    def of(call):
        count.clear()
        made = call()
        if hasattr(made, "system"):  # tangents are compiled when they are asked for
            assert made.system.coupling and made.system.tangents
        return dict(count)

    return of


# What the plain plate needs, and no more:
# forms: the volume of each density, the forces, their tangent, the traction; the mean energy of each density (Q1), or
#   what nodes gain from the source and its size to measure by (Q1Q1).
# functions: displacement and density, the density before, the held value and the translation of each direction, the
#   traction; and the mixed unknown (Q1Q1).
# vectors: marks of what grows, one for each linear form that is assembled once; marks of what rests (Q1Q1); on several
#   ranks, whose part of the body a side belongs to, to see whether all of it is held.
SIDES = int(COMM.size > 1)
NEEDED = {
    gx.Q1: {"forms": 5, "facet forms": 1, "functions": 8, "vectors": 3 + SIDES, "coefficients": 7, "constants": 11},
    gx.Q1Q1: {"forms": 6, "facet forms": 1, "functions": 9, "vectors": 5 + SIDES, "coefficients": 6, "constants": 21},
}
plain_variants = pytest.mark.parametrize("variant", NEEDED, ids=lambda variant: variant.name)


@plain_variants
def test_a_plain_scene_needs_little(census, variant):
    """Another form, field or vector for a scene that has none of the ingredients is one too many."""
    found = census(lambda: gx.discretise(gx.scenes.plate(4), variant))
    assert {name: found[name] for name in NEEDED[variant] if found[name] > NEEDED[variant][name]} == {}


@plain_variants
def test_steps_compile_nothing(census, variant):
    """Compiling, and making fields, belongs before the march."""
    scene = gx.scenes.plate(4)
    problem = gx.discretise(scene, variant)
    steps = gx.march(scene, variant, problem)
    next(steps)
    found = census(lambda: next(steps))
    assert found.get("forms", 0) == found.get("functions", 0) == 0


# What each ingredient adds, of what is counted above ("nodes": of the expressions that are compiled).
ANY = (gx.Q1, gx.Q1Q1)
INGREDIENTS = {
    "flux": ({"flux": gx.MassFlux(0.3)}, (gx.Q1Q1,), ("constants", "nodes")),
    "influx": ({"influx": (gx.Influx("top", 0.2),)}, (gx.Q1Q1,), ("facet forms", "nodes")),
    "prescribed density": (
        {"prescribed_densities": (gx.PrescribedDensity("top", 1.5),)},
        (gx.Q1Q1,),
        ("functions",),
    ),
    "pressure": ({"loads": (gx.Traction("right", (0.1, 0.0)), gx.Pressure("top", 0.1))}, ANY, ("forms", "facet forms")),
    "weight": (
        {"loads": (gx.Traction("right", (0.1, 0.0)), gx.OpenBodyForce(lambda u, rho, x: -rho * u))},
        ANY,
        ("nodes",),
    ),
    "inertia": ({"inertia": gx.Inertia()}, ANY, ("functions", "coefficients", "nodes")),
    "dead zone": ({"growth": gx.EnergyDrivenGrowth(0.01, 5.0, dead_zone=0.005)}, ANY, ("nodes",)),
    "resting region": ({"growing": ("bone",)}, ANY, ("nodes",)),
    "attractor field": ({"growth": gx.EnergyDrivenGrowth({"bone": 0.01, "implant": 0.02}, 5.0)}, ANY, ("functions",)),
    "bounds": (
        {"growth": gx.EnergyDrivenGrowth(0.01, 5.0, bounds=(1.0, None))},
        (gx.Q1,),
        ("functions", "coefficients"),
    ),
}
CASES = [(name, variant) for name, (_, variants, _) in INGREDIENTS.items() for variant in variants]


@pytest.mark.parametrize(("name", "variant"), CASES, ids=[f"{name}-{variant.name}" for name, variant in CASES])
def test_each_ingredient_shows_in_the_census(census, name, variant):
    """Else the census would not notice if a plain scene paid for it."""
    changes, _, more = INGREDIENTS[name]
    plain = block(square(4), loads=(gx.Traction("right", (0.1, 0.0)),))
    without, with_it = (census(lambda s=s: gx.discretise(s, variant)) for s in (plain, replace(plain, **changes)))
    for counted in more:
        assert with_it.get(counted, 0) > without.get(counted, 0)


def test_only_bounded_densities_take_the_solver_of_inequalities():
    """It costs two vectors, and an active set in each iteration."""
    plain = block(square(2))
    assert gx.discretise(plain, gx.Q1Q1).system.limits() is None
    bounded = replace(plain, growth=replace(plain.growth, bounds=(1.0, None)))
    low, high = gx.discretise(bounded, gx.Q1Q1).system.limits()
    assert np.all(np.isin(low, (-np.inf, 1.0))) and np.all(high == np.inf)
    assert gx.discretise(bounded, gx.Q1).system.limits() is None  # they are clipped where they are solved for


@pytest.mark.serial
def test_a_plain_run_opens_no_module_it_has_no_use_for():
    """Meshes, pictures, tables and files are for runs that read, draw, print or write them; so are their libraries."""
    code = (
        "import sys, growthx as gx; next(gx.march(gx.scenes.plate(4), gx.Q1)); "
        "print(*(name.removeprefix('growthx.') for name in sys.modules))"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(answer.stdout.split())
    assert {"dolfinx", "stepping.marching", "discretisation.densities.condensed"} <= loaded, (
        "the run must have been one"
    )
    strangers = {"pyvista", "vtk", "matplotlib", "gmsh", "rich", "sympy", "h5py"}
    strangers |= {"post", "results", "baselines", "cli", "run"}
    assert loaded & strangers == set()
