"""Random scenes, each from its number alone.

What compiles – variants, shapes of cells, laws, exponents m, dead zones, load cases – is one of a few; all that is data
is drawn at random, most of it over orders of magnitude.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import growthx as gx
from benchmarks.robustness.random_scenes import reference
from benchmarks.robustness.random_scenes.bodies import MOST, Body, random_body
from growthx.discretisation.variants import Nodal
from growthx.stepping.time_schemes import SDIRK2

if TYPE_CHECKING:
    from growthx.common.arrays import Floats

SHAPES, SHAPE_SHARES = ("quadrilateral", "triangle", "hexahedron", "tetrahedron"), (0.3, 0.3, 0.2, 0.2)
# What a scene is about, and how often.  "uniform": numbers for parameters, n = 2, m = 3; "ill": the same with m = 1; in
# all others the parameters vary from cell to cell, n among them, and m = 4.
RECIPES = {
    "uniform": 0.2,
    "ill": 0.05,
    "fields": 0.25,
    "bounds": 0.1,
    "dead zone": 0.08,
    "cases": 0.1,
    "strain": 0.05,
    "stress": 0.04,
    "specific": 0.03,
    "parts": 0.05,
    "transport": 0.1,
    "inertia": 0.02,
}
MOST_IN_SPACE, MOST_COSTLY = 30, 12  # cells in space, and of quadratic displacements there: most time is theirs
LUMPED = 0.25  # of node-based variants whose densities can be
FEW = ("uniform", "fields", "transport")  # what is lumped, and what quadratic displacements in space are about
DEAD_ZONE, INFLUX = 0.25, 0.1  # literals of the compiled forms: units of energy and of mass are such that they fit


@dataclass(frozen=True)
class Trial:
    """A scene and how it is run.

    strain: the nominal one of the loads, which the largest differs from by orders where moduli do.
    well_posed: whether m > n everywhere.
    """

    seed: int
    recipe: str
    scene: gx.Scene
    body: Body
    variant: gx.Variant
    stepping: Any
    tolerance: float
    full_newton: bool
    strain: float
    well_posed: bool


@dataclass(frozen=True)
class Units:
    """What numbers of a scene are measured in: stress, density, time."""

    stress: float
    density: float
    time: float


def decades(rng: np.random.Generator, low: float, high: float) -> float:
    """A number whose power of ten lies between two."""
    return float(10 ** rng.uniform(low, high))


def trial(seed: int) -> Trial:
    """The scene of a number."""
    rng = np.random.default_rng(seed)
    shape = str(rng.choice(SHAPES, p=SHAPE_SHARES))
    variants = gx.variants.suited(shape)
    variant = variants[rng.integers(len(variants))]
    nodal = not variant.density.local
    in_space = reference.DIMENSION[shape] == 3
    costly = in_space and variant.displacement.degree == 2
    names = [name for name in (FEW if costly else RECIPES) if nodal or name != "transport"]
    shares = np.array([RECIPES[name] for name in names])
    recipe = str(rng.choice(names, p=shares / shares.sum()))
    if variant.density == Nodal(1) and recipe in FEW and not costly and rng.random() < LUMPED:
        variant = variant.lumped(with_source=bool(rng.random() < 0.5))
    body = random_body(rng, shape, MOST_COSTLY if costly else MOST_IN_SPACE if in_space else MOST)
    return Draw(rng, recipe, body, variant).trial(seed)


class Draw:
    """Draws the parts of one scene, one after another."""

    def __init__(self, rng: np.random.Generator, recipe: str, body: Body, variant: gx.Variant) -> None:
        self._rng, self._recipe, self._body, self._variant = rng, recipe, body, variant
        self._varies = recipe not in ("uniform", "ill", "strain")
        scaled = recipe not in ("dead zone", "transport")
        powers = rng.uniform(-3, 3, 3) if scaled else np.zeros(3)
        self._units = Units(*(10**powers))
        self._strain = decades(rng, -5.5, 0.5)
        self._nodal = not variant.density.local

    def trial(self, seed: int) -> Trial:
        """All of it."""
        rng, body = self._rng, self._body
        material = self._material()
        growth = self._growth(material)
        program = self._program()
        supports, moved = self._supports()
        loads, cases = self._loads(material, moved)
        density = self._initial_density(material, growth)
        scene = gx.Scene(
            name=f"random {seed}",
            mesh=body.mesh(),
            material=material,
            growth=growth,
            supports=supports,
            loads=loads,
            cases=cases,
            program=program,
            initial_density=density,
            growing=("bone",) if self._recipe == "parts" else None,
            inertia=gx.Inertia(lumped=bool(rng.random() < 0.5)) if self._recipe == "inertia" else None,
            **self._transport(growth),
        )
        n = np.max(material.density_exponent)
        power = {"StrainDrivenGrowth": -1.0, "SpecificEnergyDrivenGrowth": n - 1}.get(
            type(growth).__name__, n - getattr(growth, "exponent", 0.0)
        )
        return Trial(
            seed=seed,
            recipe=self._recipe,
            scene=scene,
            body=body,
            variant=self._variant,
            stepping=self._stepping(),
            tolerance=1e-10 if rng.random() < 0.8 else decades(rng, -11, -6),
            full_newton=bool(rng.random() < 0.15),
            strain=self._strain,
            well_posed=bool(power < 0),
        )

    # -- laws ----------------------------------------------------------------------------------------------------------

    def _field(self, middle: float, orders: float) -> Any:
        """A number or, where parameters vary, one for each cell, within so many orders of magnitude to either side."""
        if not self._varies:
            return middle
        return middle * 10 ** self._rng.uniform(-orders, orders, len(self._body.cells))

    def _contrast(self, most: float) -> float:
        return float(self._rng.uniform(0, most))

    def _material(self) -> gx.Material:
        rng, units = self._rng, self._units
        n: Any = 2.0
        if self._varies:
            high = 6.0 if rng.random() < 0.15 else 3.9
            n = rng.uniform(0.5, high) + rng.uniform(-0.4, 0.4, len(self._body.cells))
        if self._recipe == "specific":
            n = n if rng.random() < 0.3 else 0.2 + 0.7 * rng.random(len(self._body.cells))
        return gx.Material(
            young=self._field(units.stress, self._contrast(2)),
            poisson=float(rng.choice([0.0, 0.2, 0.3, 0.45, 0.499, -0.3]))
            if rng.random() < 0.7
            else rng.uniform(0, 0.4),
            reference_density=self._field(units.density, self._contrast(1)),
            density_exponent=n,
        )

    def _growth(self, material: gx.Material) -> gx.GrowthLaw:
        rng, units, recipe = self._rng, self._units, self._recipe
        energy = units.stress * self._strain**2 / 2
        stimulus = {
            "specific": energy / units.density,
            "strain": self._strain,
            "stress": units.stress * self._strain,
        }.get(recipe, energy)
        attractor = stimulus * decades(rng, -2, 2)
        if recipe == "dead zone":  # its half-width is a number of the forms: the attractor is what varies
            attractor = DEAD_ZONE * decades(rng, -0.5, 2)
        # Of the density, what a time step resorbs without a stimulus.
        rate = units.density / units.time / attractor * decades(rng, -3, 1)
        given = {
            "attractor": self._field(attractor, self._contrast(1)),
            "rate": self._field(rate, self._contrast(0.5)),
            "bounds": self._bounds() if recipe == "bounds" else (None, None),
        }
        if recipe == "specific":
            return gx.SpecificEnergyDrivenGrowth(**given)
        if recipe == "strain":
            return gx.StrainDrivenGrowth(**given, exponent=1.0)
        if recipe == "stress":
            return gx.StressDrivenGrowth(**given, exponent=4.0)
        exponent = {"uniform": 3.0, "ill": 1.0}.get(recipe, 4.0)
        return gx.EnergyDrivenGrowth(**given, exponent=exponent, dead_zone=DEAD_ZONE if recipe == "dead zone" else 0.0)

    def _bounds(self) -> tuple[float | None, float | None]:
        rng, density = self._rng, self._units.density
        low, high = density * decades(rng, -3, -0.5), density * decades(rng, 0.3, 1.5)
        return (None if rng.random() < 0.2 else low, high)

    def _initial_density(self, material: gx.Material, growth: gx.GrowthLaw) -> Any:
        """None, a number, one for each cell over orders of magnitude, or waves in space."""
        rng, cells, density = self._rng, len(self._body.cells), self._units.density
        kind = rng.integers(4)
        orders = self._contrast(1.5)
        low, high = growth.limits
        if growth.is_bounded:  # within the bounds
            return np.clip(density * 10 ** rng.uniform(-orders, orders, cells), 1.01 * low, 0.99 * high)
        if kind == 0:
            return None
        if kind == 1:
            return density * decades(rng, -0.5, 0.5)
        if kind == 2:
            return density * 10 ** rng.uniform(-orders, orders, cells)
        wave = rng.normal(size=self._body.points.shape[1]) * 3 / self._body.size

        def waves(x: Floats) -> Floats:
            return np.asarray(density * 10 ** (orders / 2 * np.sin(wave @ x[: len(wave)])))

        return waves

    def _transport(self, growth: gx.GrowthLaw) -> dict[str, Any]:
        """Flux, influx and densities that are held."""
        if self._recipe != "transport":
            return {}
        rng, units, cells = self._rng, self._units, len(self._body.cells)
        conduction = self._body.size**2 / units.time * decades(rng, -5.5, 0.5)
        found: dict[str, Any] = {"flux": gx.MassFlux(conduction * 10 ** rng.uniform(-0.5, 0.5, cells))}
        if rng.random() < 0.5:
            found["influx"] = (gx.Influx("top", INFLUX if rng.random() < 0.5 else -INFLUX),)
        if rng.random() < 0.5:
            found["prescribed_densities"] = (gx.PrescribedDensity("right", units.density * decades(rng, -0.3, 0.3)),)
        return found

    # -- supports and loads --------------------------------------------------------------------------------------------

    def _supports(self) -> tuple[tuple[Any, ...], bool]:
        """What holds the body, and whether it moves it."""
        rng, dim = self._rng, self._body.points.shape[1]
        kind = rng.integers(4)
        if kind == 0:  # rollers on as many sides as there are directions
            rollers = [tuple(0.0 if i == k else None for k in range(dim)) for i in range(dim)]
            return tuple(
                gx.Support(side, held) for side, held in zip(("left", "bottom", "front"), rollers, strict=False)
            ), False
        if kind == 1:  # moved at the other end
            move = self._strain * self._body.size * rng.normal(size=dim)
            held = tuple(float(move[i]) if i == 0 or rng.random() < 0.5 else None for i in range(dim))
            return (gx.Support("left"), gx.Support("right", held)), True
        if kind == 2:  # clamped, and a corner held
            place = self._body.points[self._body.sides["top"][0]]
            return (gx.Support("left"), gx.PointSupport(tuple(map(float, place)), (None, 0.0, None)[:dim])), False
        return (gx.Support("left"),), False

    def _loads(self, material: gx.Material, moved: bool) -> tuple[tuple[Any, ...], tuple[gx.LoadCase, ...]]:
        rng = self._rng
        loads = [self._load() for _ in range(rng.integers(0 if moved else 1, 3))]
        if self._recipe != "cases":
            return tuple(loads), ()
        combined, common = rng.integers(3), tuple(loads) if rng.random() < 0.5 else ()
        counts = rng.integers(1, 3, 2)
        if combined < 2:  # superposed, or averaged by their weights, in one displacement
            shares = ((1.0, 1.0), (0.75, 0.25))[combined]
            of_cases = (self._load(share) for share, count in zip(shares, counts, strict=True) for _ in range(count))
            return (*common, *of_cases), ()
        return common, tuple(
            gx.LoadCase(name, weight, tuple(self._load() for _ in range(count)))
            for (name, weight), count in zip((("walking", 3.0), ("standing", 1.0)), counts, strict=True)
        )

    def _load(self, share: float = 1.0) -> Any:
        rng, dim = self._rng, self._body.points.shape[1]
        direction = rng.normal(size=dim)
        stress = share * self._units.stress * self._strain * direction / np.linalg.norm(direction)
        kind = rng.integers(3)
        if kind == 0:
            return gx.Traction(str(rng.choice(["right", "top"])), tuple(map(float, stress)))
        if kind == 1:
            sides = np.ptp(self._body.points, axis=0)
            force = stress * float(np.prod(sides[1:]))
            return gx.DistributedForce("right", tuple(map(float, force)))
        region = None if rng.random() < 0.5 else "implant"
        return gx.BodyForce(tuple(map(float, stress / self._body.size)), region)

    # -- time ----------------------------------------------------------------------------------------------------------

    def _program(self) -> gx.Program:
        rng, step = self._rng, self._units.time
        until = step * float(rng.integers(1, 5)) * (1.0 if rng.random() < 0.8 else rng.uniform(0.5, 1.5))
        ramp = (0.0, step, until * rng.uniform(0, 1))[rng.integers(3)]
        return gx.Program(step=step, until=until, ramp=ramp)

    def _stepping(self) -> Any:
        rng = self._rng
        scheme = (gx.IMPLICIT_EULER, gx.TR_BDF2, SDIRK2)[rng.integers(3)]
        if self._recipe == "inertia" or rng.random() < 0.6:
            return gx.FixedSteps(predicted=bool(rng.random() < 0.8))
        if rng.random() < 0.4:
            return gx.FixedSteps(scheme=scheme)
        return gx.AdaptiveSteps(decades(rng, -4, -1.5), scheme=scheme)


def dimension(each: Trial) -> int:
    """Directions of its body."""
    return reference.DIMENSION[each.body.shape]
