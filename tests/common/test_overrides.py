"""Classes of one's own: what they replace is obeyed by everything, or refused by name when the class is made."""

import math
from abc import ABC
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property, partial
from typing import Any, ClassVar, Generic, Protocol

import dolfinx
import numpy as np
import pytest
import ufl
from blocks import COMM, block, cube, densities, displacements, mass_residual, run, square
from scipy.optimize import root

import growthx as gx
from growthx import baselines, results, variants
from growthx.common import overrides
from growthx.common.errors import InputError
from growthx.constitutive import homogeneous
from growthx.constitutive.functions import sqrt
from growthx.constitutive.kinematics import principal_changes
from growthx.model.open_loads import OpenLoad
from growthx.stepping.control import Halving, Stepping


def logarithm(x):
    """Natural logarithm of a float, an array or a UFL expression."""
    return ufl.ln(x) if isinstance(x, ufl.core.expr.Expr) else np.log(x)


REMODELLING = (
    gx.Remodelling,
    gx.EnergyRemodelling,
    gx.SpecificEnergyRemodelling,
    gx.StrainRemodelling,
    gx.DailyStressRemodelling,
)
LAWS = (
    gx.GrowthLaw,
    gx.EnergyDrivenGrowth,
    gx.SpecificEnergyDrivenGrowth,
    gx.StrainDrivenGrowth,
    gx.StressDrivenGrowth,
)
DEAD_LOADS = (gx.Load, gx.Traction, gx.BodyForce, gx.DistributedForce)
OPEN_LOADS = (OpenLoad, gx.OpenTraction, gx.OpenBodyForce, gx.Pressure, gx.Spring, gx.Foundation)
NODAL_LOADS = (gx.NodalLoad, gx.PointForce, gx.NodalForces, gx.LineForce)
BASES = (gx.Load, OpenLoad)  # for loads of one's own, which may replace all of them
SPACES = (variants.Displacement, variants.Nodal, variants.PerCell, variants.AtPoints)
OTHERS = (
    gx.MassSource,
    gx.StoredEnergy,
    gx.Material,
    gx.MassFlux,
    gx.PrescribedDensity,
    gx.Influx,
    gx.Support,
    gx.PointSupport,
    gx.Rotation,
    gx.Moment,
    gx.Table,
    gx.LoadCase,
    gx.Program,
    gx.Inertia,
    gx.Scene,
    gx.Mesh,
    gx.Variant,
    gx.TimeScheme,
    Stepping,
    gx.FixedSteps,
    gx.AdaptiveSteps,
    baselines.NonLocal,
    baselines.Smoothed,
)
CLASSES = (*LAWS, *REMODELLING, *DEAD_LOADS, *OPEN_LOADS, *NODAL_LOADS, *SPACES, *OTHERS)

# What may be replaced; below, a test for each shows that it is obeyed.
OBEYED = {
    **{law: {"power", "drive", "linear", "coefficients"} for law in LAWS},
    **{law: {"power", "drive", "coefficients"} for law in REMODELLING},
    gx.MassSource: {"mass_source", "mass_source_slope", "resting_rate", "linear", "coefficients"},
    gx.StoredEnergy: {"energy", "energy_at", "stiffness", "coefficients"},
    gx.Material: {"elastic_energy", "lame", "coefficients"},
    gx.MassFlux: {"flux", "coefficients"},
    gx.Influx: {"value"},
    **{load: {"place", "measure", "intensity", "resultant", "history", "arrow"} for load in DEAD_LOADS},
    **{load: {"place", "force", "may_hold", "ramped", "history", "holds"} for load in OPEN_LOADS},
    **{load: {"place", "history", "arrow", "points", "within"} for load in NODAL_LOADS},
    gx.Moment: {"place", "history", "arrow"},
    **{steps: {"control", "newton_tolerance"} for steps in (Stepping, gx.FixedSteps, gx.AdaptiveSteps)},
    baselines.NonLocal: {"on", "weights"},
    baselines.Smoothed: {"on"},
}
# Names that Python keeps its books by.
BOOKS = {"_abc_impl", "_replaceable", "_final", "__module__", "__doc__", "__dict__", "__weakref__", "__annotations__"}
MEANT = {"__init__", "__eq__", "__hash__", "__setattr__"}


def named_parts(kind):
    """All that growthx's classes define for a class, but its parameters."""
    ours = [base for base in kind.__mro__ if base not in (object, ABC, Generic, Protocol)]
    names = {name for base in ours for name in vars(base)} - {"__init_subclass__", "__new__"}
    parameters = {part.name for part in fields(kind)} if is_dataclass(kind) else set()
    return sorted(name for name in names - parameters - BOOKS if name in MEANT or not name.startswith("__"))


def replacement(kind, name):
    """Something else of the same sort as a part of a class."""
    value = next(vars(base)[name] for base in kind.__mro__ if name in vars(base))
    if isinstance(value, property):
        return property(lambda self: None)
    if callable(value) or isinstance(value, classmethod):
        return lambda self, *values, **parameters: None
    return not value if isinstance(value, bool) else value


PARTS = [(kind, name) for kind in CLASSES for name in named_parts(kind)]


@pytest.mark.parametrize(("kind", "name"), PARTS, ids=lambda part: getattr(part, "__name__", part))
@pytest.mark.parametrize("way", ["itself", "by another base", "by a base of a base"])
def test_every_part_is_obeyed_or_refused_by_name(kind, name, way):
    """What is replaced and not used would be a result of another law than was written, without a word."""
    parts = {name: replacement(kind, name)}
    if way == "itself":
        bases = (kind,)
    else:
        mixin = type("Mixin", (), parts)
        bases, parts = (type("More", (mixin,), {}) if way == "by a base of a base" else mixin, kind), {}
    if name in OBEYED.get(kind, ()):
        type("Mine", bases, parts)
        return
    with pytest.raises(InputError, match=rf"^the class Mine replaces {name} of \w+, which is not used everywhere: "):
        type("Mine", bases, parts)


@pytest.mark.parametrize("kind", [kind for kind in CLASSES if kind not in BASES], ids=lambda kind: kind.__name__)
def test_the_sentence_says_what_may_be_replaced(kind):
    """Whoever is refused one way must learn of the right one."""
    refused = next(name for name in named_parts(kind) if name not in OBEYED.get(kind, ()))
    with pytest.raises(InputError) as caught:
        type("Mine", (kind,), {refused: replacement(kind, refused)})
    right = OBEYED.get(kind)
    assert str(caught.value).endswith(
        f"{', '.join(sorted(right))} would be right" if right else ": parameters of other values would be right"
    )


@pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)
def test_parts_of_ones_own_are_free(kind):
    """Methods that growthx does not know, and how an object shows itself, are the user's."""
    parts = {"more": lambda self: 1, "_more": 2, "__repr__": lambda self: "mine", "__doc__": "Mine."}
    mine = type("Mine", (kind,), parts)
    assert mine._more == 2 and mine.__mro__[1] is kind


# -- parameters --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Milder(gx.EnergyDrivenGrowth):
    """Another default, and a parameter of its own."""

    exponent: float = 2.5
    share: float = 0.5


def test_parameters_may_have_other_defaults():
    """The usual way to fix a parameter for many scenes."""
    law = Milder(0.01, 5.0)
    assert law.exponent == 2.5 and law.share == 0.5 and replace(law, exponent=4).exponent == 4
    assert not hasattr(gx.EnergyDrivenGrowth(0.01), "share")


@pytest.mark.parametrize(
    ("parts", "shown"),
    [
        ({"exponent": 2.5}, "2.5"),
        ({"attractor": 0.1}, "0.1"),
        ({"exponent": property(lambda self: 2.5)}, "<property"),
        ({"rate": cached_property(lambda self: 2.5)}, "<functools.cached_property"),
        ({"dead_zone": lambda self: 2.5}, "<function"),
    ],
)
def test_values_that_dataclasses_overlook_are_refused(parts, shown):
    """Without a type, Python's dataclasses take the base's default, and without a word."""
    (name,) = parts
    sentence = rf"^the class Mine replaces the parameter {name} by {shown}.*: a default, .* would be right$"
    with pytest.raises(InputError, match=sentence):
        type("Mine", (gx.EnergyDrivenGrowth,), parts)
    with pytest.raises(InputError, match=sentence):
        type("Mine", (type("Mixin", (), parts), gx.EnergyDrivenGrowth), {})


def test_parameters_in_a_class_that_is_no_dataclass_are_refused():
    """The decorator is easily forgotten, and the value then is not used."""

    class Undecorated(gx.EnergyDrivenGrowth):
        exponent: float = 2.5

    with pytest.raises(InputError, match="the class Undecorated states the parameter exponent but is no dataclass"):
        Undecorated(0.01)


def test_a_parameter_that_is_taken_away_is_refused():
    """Laws are made anew with their parameters in UFL, arrays or at a rate of zero."""

    @dataclass(frozen=True)
    class Fixed(gx.EnergyDrivenGrowth):
        attractor: ClassVar = 0.01

    with pytest.raises(InputError, match=r"^the class Fixed has no parameter attractor: "):
        Fixed()


@pytest.mark.parametrize("names", [("gain",), ("attractor", "rate", "lost"), ["attractor", "rate"], "gain"])
def test_coefficients_that_are_none_are_refused(names):
    """A field that is not turned into UFL would end in the middle of a form."""

    @dataclass(frozen=True)
    class Mine(gx.EnergyDrivenGrowth):
        gain: Any = 1.0

        coefficients = names

    with pytest.raises(InputError, match=r"^the coefficients of the class Mine are .*attractor, rate among them"):
        Mine(0.01)


def test_slots_do_no_harm():
    """Python makes such a class twice."""

    @dataclass(frozen=True, slots=True)
    class Slim(gx.EnergyDrivenGrowth):
        gain: float = 2.0

        def drive(self, elastic_energy, material):
            return self.gain * elastic_energy

    assert Slim(0.01).drive(3.0, None) == 6.0 and not Slim.linear


# -- growth laws are obeyed --------------------------------------------------------------------------------------------

N, YOUNG, POISSON, REFERENCE, TRACTION, STEP = 2.0, 3.0, 0.3, 1.2, 0.9, 0.25
LAM, MU = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON)), YOUNG / (2 * (1 + POISSON))
ALL = list(variants.CATALOGUE.values())
each_variant = pytest.mark.parametrize("variant", ALL, ids=lambda variant: variant.name)


class Minimal(gx.GrowthLaw):
    """What docs/theory.md asks of a law: the exponent of the density and the function of the energy."""

    def power(self, material):
        """−3/2."""
        return -1.5

    def drive(self, elastic_energy, material):
        """Ψ + 2 Ψ²/E."""
        return elastic_energy * (1 + 2 * elastic_energy / material.young)


@dataclass(frozen=True)
class Gained(gx.GrowthLaw):
    """The same with parameters of its own, one of which may vary in space."""

    gain: Any = 2.0
    k: float = -1.5

    coefficients = ("attractor", "rate", "gain")

    def power(self, material):
        """As given."""
        return self.k

    def drive(self, elastic_energy, material):
        """Ψ + gain Ψ²/E."""
        return elastic_energy * (1 + self.gain * elastic_energy / material.young)


class Mixed:
    """A base that has the methods, and is no growth law."""

    power, drive = Minimal.power, Minimal.drive


class MixedIn(Mixed, gx.EnergyDrivenGrowth):
    """Its drive and power are not those of the law that it builds on, nor is it linear."""


class Restated(gx.StrainDrivenGrowth):
    """A law of growthx with other methods."""

    power = Minimal.power

    def drive(self, elastic_energy, material):
        """The same by other means."""
        return elastic_energy + 2 * (sqrt(elastic_energy + material.young) ** 2 / material.young - 1) * elastic_energy


def block_of(law, mesh, **changes):
    """Pulled on rollers: a homogeneous state, of few numbers."""
    sides = [(name, i) for i, name in enumerate(("left", "bottom", "front")[: mesh.dim])]
    rollers = [gx.Support(name, tuple(0.0 if k == i else None for k in range(mesh.dim))) for name, i in sides]
    scene = block(
        mesh,
        material=gx.Material(YOUNG, POISSON, REFERENCE, N),
        growth=law,
        supports=tuple(rollers),
        loads=(gx.Traction("right", (TRACTION, 0.0, 0.0)[: mesh.dim]),),
        program=gx.Program(step=STEP, until=3 * STEP),
    )
    return replace(scene, **changes)


def recursion(source, dim=2):
    """Densities of three steps of implicit Euler of the block, by NumPy alone; source: R₀ of ρ and Ψ₀ⁿᵉᵒ."""

    def balances(state, old):
        a, b, rho = state
        c = b if dim == 3 else 1.0
        J, weight = a * b * c, (rho / REFERENCE) ** N
        energy = LAM / 2 * np.log(J) ** 2 + MU / 2 * (a**2 + b**2 + c**2 - 3 - 2 * np.log(J))
        return [
            weight * (MU * a + (LAM * np.log(J) - MU) / a) - TRACTION,
            weight * (MU * b + (LAM * np.log(J) - MU) / b),
            rho - old - STEP * source(rho, energy),
        ]

    state, found = np.array([1.2, 0.9, REFERENCE]), []
    for _ in range(3):
        solution = root(balances, state, args=(state[2],), tol=1e-14)
        assert np.abs(solution.fun).max() < 1e-12
        state = solution.x
        found.append(float(state[2]))
    return found


def minimal_source(rho, energy):
    """Of `Minimal(0.05, 4.0)`."""
    return 4.0 * ((rho / REFERENCE) ** -1.5 * (energy + 2 * energy**2 / YOUNG) - 0.05)


MINE = {
    "minimal": Minimal(0.05, 4.0),
    "with parameters": Gained(0.05, 4.0),
    "by a function": Gained(0.05, 4.0, gain=lambda x: 2.0 + 0.0 * x[0]),
    "by region": Gained(0.05, 4.0, gain={"bone": 2.0, "implant": 2.0}),
    "by another base": MixedIn(0.05, 4.0),
    "restated": Restated(0.05, 4.0),
}


@each_variant
@pytest.mark.parametrize("law", MINE.values(), ids=MINE)
def test_a_law_of_ones_own_is_obeyed_by_every_variant(law, variant):
    """Power and drive are all that a law states: each variant must find the same few numbers by them."""
    expected = recursion(minimal_source)
    assert np.ptp(expected) > 0.05
    steps, _ = run(block_of(law, square(2, 0.05, shape=variant.cells[0])), variant, tolerance=1e-13)
    for step, rho in zip(steps, expected, strict=True):
        assert (step.min_density, step.max_density) == pytest.approx((rho, rho), rel=1e-9)
        assert step.mass_defect < 1e-12


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.Q1Q1, gx.P1P0, gx.P1P1], ids=lambda variant: variant.name)
@pytest.mark.parametrize("name", ["minimal", "by a function"])
def test_a_law_of_ones_own_is_obeyed_in_space(name, variant):
    """The same in three dimensions."""
    steps, _ = run(block_of(MINE[name], cube(1, shape=variant.cells[1])), variant, tolerance=1e-13)
    rho = recursion(minimal_source, dim=3)[-1]
    assert (steps[-1].min_density, steps[-1].max_density) == pytest.approx((rho, rho), rel=1e-9)


def test_a_law_of_ones_own_has_a_dead_zone_and_bounds():
    """What growthx adds to a stimulus, it adds to one of the user's."""
    bounded = Minimal(0.05, 4.0, bounds=(0.5, 1.21))
    assert run(block_of(bounded, square(2)), gx.Q1P0)[0][-1].max_density == 1.21

    def lazy(rho, energy):
        excess, soft = minimal_source(rho, energy) / 4.0, 0.1 * 0.04
        edges = [(y + np.hypot(y, soft)) / 2 for y in (excess - 0.04, -excess - 0.04)]
        return 4.0 * (edges[0] - edges[1])

    for variant in (gx.Q1, gx.Q1P0, gx.Q1sri, gx.Q1Q1):
        steps, _ = run(block_of(Minimal(0.05, 4.0, dead_zone=0.04), square(2)), variant, tolerance=1e-13)
        assert steps[-1].max_density == pytest.approx(recursion(lazy)[-1], rel=1e-9)


VARYING = Gained(0.02, 4.0, gain=lambda x: 2.0 + 30.0 * x[0] * x[1])


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1sri], ids=lambda variant: variant.name)
def test_a_parameter_that_varies_stands_beside_its_own_points(variant):
    """Of a source that is not linear every point counts: a parameter must not meet the energies of other cells."""
    steps, problem = run(block(square(2), growth=VARYING), variant, tolerance=1e-12)
    assert steps[-1].mass_defect < 1e-11
    density = densities(problem)[:, 2]
    assert density.min() < 0.995 * density.max()
    assert np.abs(mass_residual(problem)).max(initial=0.0) < 1e-12


def test_a_drive_of_ones_own_is_not_taken_for_linear():
    """Q1P0 takes the drive of the mean energy for the mean of the drives only if they are the same."""
    assert gx.EnergyDrivenGrowth.linear and not gx.StrainDrivenGrowth.linear
    assert not (Minimal.linear or MixedIn.linear or Restated.linear)

    class Heir(MixedIn):
        pass

    class Linear(gx.GrowthLaw):
        linear = True
        power = Minimal.power

        def drive(self, elastic_energy, material):
            return 2 * elastic_energy

    assert not Heir.linear and Linear.linear
    mesh = square(2, 0.06)
    same = replace(gx.EnergyDrivenGrowth(0.01, 8.0), exponent=3.5)
    mine, theirs = (run(block(mesh, growth=law), gx.Q1P0)[1] for law in (Linear(0.02, 4.0), same))
    assert densities(mine) == pytest.approx(densities(theirs), rel=1e-9)
    assert mine.system.symmetric and theirs.system.symmetric


def test_a_law_of_ones_own_is_obeyed_by_the_baselines():
    """Explicit Euler of the block in one step."""
    scene = block_of(MINE["by a function"], square(2))
    steps = list(baselines.update(replace(scene, program=gx.Program(STEP, STEP)), gx.Q1P0, tolerance=1e-13))
    a, b = root(out_of_balance, [1.2, 0.9], tol=1e-14).x
    energy = LAM / 2 * np.log(a * b) ** 2 + MU / 2 * (a**2 + b**2 + 1 - 3 - 2 * np.log(a * b))
    expected = REFERENCE + STEP * minimal_source(REFERENCE, energy)
    assert steps[0].max_density == pytest.approx(expected, rel=1e-9)


def out_of_balance(stretches):
    """The stresses of the block at the reference density, less the load."""
    a, b = stretches
    return [MU * s + (LAM * np.log(a * b) - MU) / s - load for s, load in ((a, TRACTION), (b, 0.0))]


def test_a_law_of_ones_own_is_obeyed_by_outputs_and_checks():
    """Pictures, tables, the check of well-posedness and biological equilibrium speak of the same law."""
    law = Minimal(0.05, 4.0)
    scene = block_of(law, square(2), program=gx.Program(STEP, 400 * STEP))
    equilibrium = homogeneous.uniaxial_equilibrium(scene.material, law, TRACTION)
    for variant in (gx.Q1P0, gx.Q1Q1):
        problem = gx.homeostasis(scene, variant)
        assert problem.mean_density() == pytest.approx(equilibrium.density, rel=1e-8)
        means = results.cell_fields(problem)
        assert means["stimulus"] == pytest.approx(np.full_like(means["stimulus"], 0.05), rel=1e-6)
        problem.state.time_step.value = STEP
        slope = law.mass_source_slope(equilibrium.density, energy_of(scene, equilibrium), scene.material)
        assert gx.wellposedness.check(problem).margin == pytest.approx(1 - STEP * slope, rel=1e-6)


def energy_of(scene, equilibrium):
    """Ψ₀ⁿᵉᵒ of a homogeneous state."""
    strains = (equilibrium.extension, equilibrium.transverse_extension, 0.0)
    return scene.material.elastic_energy(*principal_changes(strains))


# -- nonsense of a law is said -----------------------------------------------------------------------------------------


def law_of(drive, power=lambda self, material: -1.0, **parts):
    """A class by its drive and power."""
    return type("Mine", (gx.GrowthLaw,), {"drive": drive, "power": power, **parts})


def undecided(self, energy, material):
    """A drive that is not the same for arrays and UFL."""
    return energy * (2 if isinstance(energy, np.ndarray) else 1)


NONSENSE = [
    (lambda self, energy, material: math.sqrt(energy), r"drive of Mine fails for an array of energies, TypeError"),
    (lambda self, energy: energy, r"drive of Mine fails for an array of energies, TypeError"),
    (lambda self, energy, material: np.maximum(energy, 0.1), r"drive of Mine fails for an energy in UFL, ValueError"),
    (lambda self, energy, material: sqrt(energy), r"drive of Mine has no finite slope at an elastic energy of 0"),
    (lambda self, energy, material: logarithm(energy), r"drive of Mine is -inf at an elastic energy of 0"),
    (lambda self, energy, material: energy - 0.01, r"drive of Mine is -0\.01 at an elastic energy of 0"),
    (lambda self, energy, material: energy * (energy - 1e-5) * (energy - 2e-5), r"drive of Mine is -.* at an elastic"),
    (lambda self, energy, material: energy * math.nan, r"drive of Mine is nan at an elastic energy"),
    (lambda self, energy, material: None, r"drive of Mine gives array\(None, dtype=object\) for 6 energies"),
    (lambda self, energy, material: 1.0, r"drive of Mine gives array\(1\.\) for 6 energies"),
    (lambda self, energy, material: 1j * energy, r"drive of Mine gives array\("),
    (lambda self, energy, material: energy + energy.sum(), r"drive of Mine is .* in an array and .* alone"),
    (undecided, r"drive of Mine is 2e-12 at an elastic energy of 1e-12 in an array and 1e-12 in UFL"),
]


@pytest.mark.parametrize(("drive", "sentence"), NONSENSE)
def test_a_drive_that_cannot_be_used_is_refused(drive, sentence):
    """On all ranks, before time is spent, and by the names of class and method."""
    with pytest.raises(InputError, match=f"^the {sentence}.* would be right$"):
        block(square(2), growth=law_of(drive)(0.01, 5.0))


@pytest.mark.parametrize("power", [math.nan, math.inf, None, "2", True, np.ones(2)])
def test_a_power_that_is_no_number_is_refused(power):
    """An exponent that varies, or is none, has no closed form for the density."""
    mine = law_of(Minimal.drive, lambda self, material: power)
    with pytest.raises(
        InputError, match=r"^the power of Mine is .*: a finite number, the same everywhere, would be right"
    ):
        block(square(2), growth=mine(0.01, 5.0))


def test_a_power_that_fails_is_refused():
    """With the user's own words."""
    mine = law_of(Minimal.drive, lambda self, material: material.exponent)
    with pytest.raises(
        InputError, match=r"^the power of Mine fails, AttributeError.*exponent.*: a number would be right"
    ):
        block(square(2), growth=mine(0.01, 5.0))


@each_variant
@pytest.mark.parametrize("young", [YOUNG, lambda x: YOUNG + 0.0 * x[0]], ids=["number", "function"])
def test_a_power_may_use_numbers_of_the_material(young, variant):
    """Which are UFL's by the time that forms are written."""
    mine = law_of(Minimal.drive, lambda self, material: -1.25 * material.reference_density)
    material = gx.Material(young, POISSON, REFERENCE, N)
    scene = block_of(mine(0.05, 4.0), square(2, shape=variant.cells[0]), material=material)
    steps, _ = run(scene, variant, tolerance=1e-13)
    assert steps[-1].max_density == pytest.approx(recursion(minimal_source)[-1], rel=1e-9)


@pytest.mark.parametrize("linear", [True, 1, None])
def test_a_drive_that_is_called_linear_is(linear):
    """Or else the mean energy of a cell would drive it, which means another law."""
    mine = law_of(Minimal.drive, linear=linear)
    sentence = "is said to be linear, and is" if linear is True else rf"^linear, of Mine, is {linear}: True or False"
    with pytest.raises(InputError, match=sentence):
        block(square(2), growth=mine(0.01, 5.0))


def test_methods_by_other_means():
    """A method may be anything that can be called, and nothing else."""
    partly = law_of(staticmethod(partial(lambda factor, energy, material: factor * energy, 2.0)))
    assert partly(0.01).drive(1.0, None) == 2.0
    for wrong in (2.0, property(lambda self: 2.0)):
        with pytest.raises(InputError, match=r"^power of the class Mine is .*: a method, as StimulusDriven has it"):
            law_of(Minimal.drive, wrong)


@pytest.mark.parametrize("gain", [{"bone": 1.0, "implant": 2.0}, "function"], ids=["regions", "DOLFINx"])
def test_a_field_that_is_no_coefficient_is_refused(gain):
    """It would meet the energies as a dictionary, or as UFL among arrays."""

    @dataclass(frozen=True)
    class Mine(gx.GrowthLaw):
        gain: Any = 1.0
        power = Minimal.power

        def drive(self, elastic_energy, material):
            return self.gain * elastic_energy

    mesh = square(2)
    if gain == "function":
        gain = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("DG", 0)))
    with pytest.raises(
        InputError, match=r"^the parameter gain of Mine is .*, a field, but not named in its coefficients"
    ):
        block(mesh, growth=Mine(0.01, 5.0, gain=gain))
    with pytest.raises(InputError, match="parameters that vary in space, gain perhaps, go into its coefficients"):
        block(mesh, growth=Mine(0.01, 5.0, gain=lambda x: x[0]))


def test_checks_of_ones_own_that_let_nothing_else_pass():
    """A law is made anew with its parameters in UFL: checks for numbers alone must not hang the other ranks."""

    @dataclass(frozen=True)
    class Strict(Gained):
        def __post_init__(self):
            super().__post_init__()
            if self.gain < 0:
                raise ValueError("negative")

    scene = block(square(2), growth=Strict(0.01, 5.0))
    with pytest.raises(InputError, match=r"^Strict cannot be made anew with .*gain as arrays or in UFL, ValueError"):
        gx.discretise(scene, gx.Q1)


# -- materials ---------------------------------------------------------------------------------------------------------


class Twice(gx.Material):
    """Twice as stiff."""

    def elastic_energy(self, *strain):
        """Twice the energy."""
        return 2 * super().elastic_energy(*strain)


class TwiceByLame(gx.Material):
    """The same by its parameters."""

    @property
    def lame(self):
        """Twice as large."""
        lam, mu = super().lame
        return 2 * lam, 2 * mu


@dataclass(frozen=True)
class Scaled(gx.Material):
    """The same by a field."""

    factor: Any = 2.0

    coefficients = (*gx.Material.coefficients, "factor")

    @property
    def lame(self):
        """Scaled."""
        return tuple(self.factor * value for value in super().lame)


MATERIALS = [Twice, TwiceByLame, Scaled, partial(Scaled, factor={"bone": 2.0, "implant": 2.0})]


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.Q1sri, gx.Q1Q1, gx.P1P0], ids=lambda variant: variant.name)
@pytest.mark.parametrize("kind", MATERIALS)
def test_a_material_of_ones_own_is_obeyed_by_everything(kind, variant):
    """Stress and stimulus come from one energy: the run is that of a stiffer material."""
    mesh = square(2, 0.05, shape=variant.cells[0])
    mine, same = (block(mesh, material=law(young, 0.25, 1.2)) for law, young in ((kind, 1.0), (gx.Material, 2.0)))
    one, other = (run(scene, variant, tolerance=1e-12)[1] for scene in (mine, same))
    assert densities(one) == pytest.approx(densities(other), rel=1e-9)
    assert displacements(one) == pytest.approx(displacements(other), abs=1e-9)
    for name, values in results.cell_fields(one).items():
        assert values == pytest.approx(results.cell_fields(other)[name], rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("kind", [Twice, TwiceByLame, Scaled])
def test_a_material_of_ones_own_in_homogeneous_states(kind):
    """Which are computed with numbers alone."""
    states = [
        homogeneous.uniaxial_equilibrium(material, gx.EnergyDrivenGrowth(0.05, 4.0), TRACTION)
        for material in (kind(YOUNG, POISSON), gx.Material(2 * YOUNG, POISSON))
    ]
    assert states[0].density == pytest.approx(states[1].density, rel=1e-12)
    assert states[0].stretch == pytest.approx(states[1].stretch, rel=1e-12)


@pytest.mark.parametrize(
    ("energy", "sentence"),
    [
        (lambda self, *strain: math.nan * strain[0], "is nan, with the stresses"),
        (lambda self, *strain: None, "fails at the stretches"),
        (lambda self, *strain: math.log(strain[1]), "fails at the stretches"),
    ],
)
def test_an_energy_that_cannot_be_used_is_refused(energy, sentence):
    """Before it is differentiated in the middle of a form."""
    mine = type("Mine", (gx.Material,), {"elastic_energy": energy})
    with pytest.raises(InputError, match=f"^the elastic energy of Mine {sentence}.* would be right$"):
        block(square(2), material=mine(1.0))


# -- loads, mass, steps ------------------------------------------------------------------------------------------------


def same_run(one, other, variant):
    """Whether two scenes have the same run, which is not that of a scene at rest."""
    first, second = (run(scene, variant, tolerance=1e-12)[1] for scene in (one, other))
    assert np.abs(displacements(first)[:, 2:]).max() > 1e-3
    assert densities(first) == pytest.approx(densities(second), rel=1e-9)
    assert displacements(first) == pytest.approx(displacements(second), abs=1e-9)


def push(u, rho, x):
    """A force that depends on the displacement."""
    return ufl.as_vector([0.02 - 0.1 * u[0], -0.01])


def pushed_twice(u, rho, x):
    """Twice as much."""
    return 2 * push(u, rho, x)


DOUBLED = {
    "Traction": (gx.Traction, ("right", (0.02, -0.01)), ("right", (0.04, -0.02))),
    "BodyForce": (gx.BodyForce, ((0.02, -0.01),), ((0.04, -0.02),)),
    "OpenTraction": (gx.OpenTraction, ("right", push), ("right", pushed_twice)),
    "OpenBodyForce": (gx.OpenBodyForce, (push,), (pushed_twice,)),
    "Pressure": (gx.Pressure, ("right", -0.02), ("right", -0.04)),
}


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)
@pytest.mark.parametrize("name", DOUBLED)
def test_a_load_of_ones_own_is_obeyed(name, variant):
    """Its intensity or force is what the body bears."""
    kind, single, double = DOUBLED[name]
    part = "force" if hasattr(kind, "force") else "intensity"
    mine = type("Mine", (kind,), {part: lambda self, *values: 2 * getattr(kind, part)(self, *values)})
    mesh = square(2, 0.05)
    same_run(block(mesh, loads=(mine(*single),)), block(mesh, loads=(kind(*double),)), variant)


def test_a_distributed_force_of_ones_own_is_obeyed():
    """It keeps its resultant, spread as it says."""

    class Uphill(gx.DistributedForce):
        def intensity(self, x):
            return np.outer(self.force, 1 + x[1])

    force, mesh = (0.05, -0.01), square(2, 0.05)
    mine, same = Uphill("right", force), gx.DistributedForce("right", force, weight=lambda x: 1 + x[1])
    same_run(block(mesh, loads=(mine,)), block(mesh, loads=(same,)), gx.Q1P0)


def test_a_name_of_ones_own_for_a_place_is_said():
    """Where a load acts is a part of sentences, and of those alone."""
    for kind, values in ((gx.Traction, ("right", (0.1,))), (gx.OpenTraction, ("right", lambda u, rho, x: u[0]))):
        mine = type("Mine", (kind,), {"place": property(lambda self: "on my side")})
        with pytest.raises(InputError, match="load on my side has"):
            gx.discretise(block(square(2), loads=(mine(*values),)), gx.Q1P0)


def test_a_load_that_says_it_may_not_hold_is_none_that_holds():
    """Free motions are refused unless something resists them."""
    spring = type("Spring", (gx.OpenTraction,), {"may_hold": False})
    scene = {"supports": (gx.Support("left", (0.0, None)),), "loads": ()}
    law = {"law": lambda u, rho, x: -u}
    gx.discretise(block(square(2), **{**scene, "loads": (gx.OpenTraction("left", **law),)}), gx.Q1P0)
    with pytest.raises(InputError, match="free to move"):
        gx.discretise(block(square(2), **{**scene, "loads": (spring("left", **law),)}), gx.Q1P0)


class Faster(gx.MassFlux):
    """Twice the flux."""

    def flux(self, density, material):
        """Twice as much."""
        return 2 * super().flux(density, material)


@dataclass(frozen=True)
class Scalable(gx.MassFlux):
    """Twice the flux by a field."""

    factor: Any = 2.0

    coefficients = ("conduction", "factor")

    def flux(self, density, material):
        """Scaled."""
        return self.factor * super().flux(density, material)


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.P1P1, gx.S2Q1], ids=lambda variant: variant.name)
def test_a_flux_and_an_influx_of_ones_own_are_obeyed(variant):
    """By the variants that know any."""
    influx = type("Mine", (gx.Influx,), {"value": lambda self, u, rho, mesh: 2 * gx.Influx.value(self, u, rho, mesh)})
    mesh = square(2, 0.05, shape=variant.cells[0])
    for flux in (Faster(0.1), Scalable(0.1), Scalable(0.1, factor={"bone": 2.0, "implant": 2.0})):
        mine = block(mesh, flux=flux, influx=(influx("right", 0.1),))
        same_run(mine, block(mesh, flux=gx.MassFlux(0.2), influx=(gx.Influx("right", 0.2),)), variant)


def test_a_flux_or_influx_of_another_kind_is_refused():
    """A scalar where a vector is meant, or the other way round, is an error of UFL's in the middle of a form."""
    flux = type("Mine", (gx.MassFlux,), {"flux": lambda self, density, material: density})
    with pytest.raises(InputError, match="the mass flux has values of shape"):
        gx.discretise(block(square(2), flux=flux(0.1)), gx.Q1Q1)
    influx = type("Mine", (gx.Influx,), {"value": lambda self, u, rho, mesh: u})
    with pytest.raises(InputError, match="the influx on 'right' has values of shape"):
        gx.discretise(block(square(2), influx=(influx("right", 0.1),)), gx.Q1Q1)


class Counting(Halving):
    """Steps of a third of the program's that hears all that is said to it."""

    said: ClassVar[list[str]] = []

    def targets(self):
        self.said.append("targets")
        return self._program.times()

    def end(self, time, target):
        self.said.append("end")
        return min(target, time + self._program.step / 3)

    @property
    def hopeless(self):
        self.said.append("hopeless")
        return True

    def solved(self):
        self.said.append("solved")
        super().solved()

    def accepts(self, time_step, error):
        self.said.append("accepts")
        super().accepts(time_step, error)
        return len(self.said) < 20

    def memory(self):
        self.said.append("memory")
        return super().memory()

    def recall(self, memory):
        self.said.append("recall")
        super().recall(memory)


class Thirds(gx.FixedSteps):
    """Uses them, with a tolerance of its own."""

    def control(self, program):
        """Thirds."""
        return Counting(program)

    def newton_tolerance(self, tolerance):
        """Coarse."""
        return 1e-3


def test_steps_of_ones_own_are_obeyed():
    """The way through time is the control's alone, and how well a step is solved the stepping's."""
    Counting.said.clear()
    march = gx.march(block(square(2)), gx.Q1P0, stepping=Thirds())
    assert next(march).time == pytest.approx(0.1 / 3)
    march.begin_anew()
    with pytest.raises(gx.EndedEarly, match="did not help"):
        list(march)
    assert set(Counting.said) >= {"targets", "end", "hopeless", "solved", "accepts", "memory", "recall"}
    coarse, fine = (run(block(square(2)), gx.Q1P0, stepping=steps)[0] for steps in (Plain(), gx.FixedSteps()))
    assert coarse[-1].newton_iterations < fine[-1].newton_iterations


class Plain(gx.FixedSteps):
    """A coarse tolerance alone."""

    def newton_tolerance(self, tolerance):
        """Coarse."""
        return 1e-3


def test_averages_of_ones_own_are_obeyed():
    """Of the baselines."""

    class Nothing(baselines.Smoothed):
        def on(self, problem):
            return lambda values: 0 * values

    class Alone(baselines.NonLocal):
        def weights(self, problem):
            weights = super().weights(problem)
            weights.data[:] = weights.data == np.repeat(weights.max(axis=1).toarray().ravel(), np.diff(weights.indptr))
            return weights

    scene = block(square(2))
    still = list(baselines.update(scene, gx.Q1P0, source_average=Nothing()))
    assert still[-1].min_density == still[-1].max_density == 1.2
    if COMM.size == 1:
        alone, none = (list(baselines.update(scene, gx.Q1P0, source_average=a)) for a in (Alone(0.2), None))
        assert alone[-1].mass == pytest.approx(none[-1].mass, rel=1e-12)


def test_densities_of_ones_own_are_refused_by_a_variant():
    """How a density is solved for is known of three kinds alone."""
    with pytest.raises(
        InputError, match=r"^the density of the variant Q1 is .*: a variants\.Nodal, PerCell or AtPoints"
    ):
        replace(gx.Q1, density=object())
    with pytest.raises(
        InputError, match=r"^the displacement of the variant Q1 is .*: a variants\.Displacement would be"
    ):
        replace(gx.Q1, displacement=2)


def test_growthx_s_own_laws_are_not_tried():
    """A plain run does not load what tries laws of one's own."""
    assert not any(overrides.is_foreign(kind) for kind in CLASSES)
    assert overrides.is_foreign(Minimal) and overrides.is_foreign(Twice)
