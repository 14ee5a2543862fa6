"""A run is known again by what it evaluates: code and constants of laws of one's own, not their names alone."""

import logging
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import dolfinx
import numpy as np
import pytest
import ufl
from blocks import COMM, block, cube, densities, gathered, square

import growthx as gx
from growthx.common.errors import InputError
from growthx.discretisation.trial import trial
from growthx.model.open_loads import OpenLoad
from growthx.results import fingerprint
from growthx.results.identity import identity
from growthx.solvers.settings import NewtonSettings
from growthx.stepping.control import Halving
from growthx.stepping.failure import inadmissible

PROGRAM = gx.Program(step=0.1, until=0.2, ramp=0.1)
FACTOR = 2.0  # a constant of this module, which a law uses


def growth(drive=None, power=None, **parts):
    """A law of one's own, always of the same name."""
    methods = {
        "drive": drive or (lambda self, energy, material: self.factor * energy),
        "power": power or (lambda self, material: -1.0),
        "factor": 2.0,
    }
    return type("Mine", (gx.GrowthLaw,), {**methods, **parts})(0.01, 5.0)


def material(energy):
    """A material of one's own, always of the same name."""
    return type("Mine", (gx.Material,), {"elastic_energy": energy})(1.0, 0.25, 1.2)


def stiffer(factor):
    """An energy of that name."""

    def elastic_energy(self, *strain):
        return factor * gx.Material.elastic_energy(self, *strain)

    return elastic_energy


@dataclass(frozen=True)
class Bedded(OpenLoad):
    """A load of one's own: a bedding whose stiffness is a class attribute."""

    on: str

    def force(self, u, rho, mesh):
        """Against the displacement."""
        return -self.stiffness * u


def bedded(stiffness):
    """That class, always of the same name."""
    return type("Mine", (Bedded,), {"stiffness": stiffness})("right")


def pushed(force):
    """A traction of one's own, by its code."""
    return type("Mine", (gx.Traction,), {"intensity": lambda self, x: np.outer(force, 1 + x[1])})("right", (0.1, 0.0))


def spring_of_a_constant(value, mesh):
    """An open load whose stiffness no form tells."""
    stiffness = dolfinx.fem.Constant(mesh.domain, value)
    return gx.OpenTraction("right", lambda u, rho, x: -stiffness * u)


def held_at(side, mesh):
    """The mesh with a boundary of one name at another place."""
    facets = dict(mesh.boundaries)
    return replace(mesh, boundaries={**facets, "there": facets[side]})


def cut(share):
    """Steps of one's own: a share of the program's."""

    class Control(Halving):
        def targets(self):
            return self._program.times()

        def end(self, time, target):
            return min(target, time + share * self.cut * self._program.step)

    return type("Mine", (gx.FixedSteps,), {"control": lambda self, program: Control(program)})()


def loads(*some):
    """Changes of a scene to these loads, with a dead one."""
    return {"loads": (gx.Traction("right", (0.1, -0.02)), *some)}


def late(share):
    """A history that differs only long after the first times."""
    return loads(gx.Traction("top", (0.0, 0.01), history=lambda t: t if t < 0.35 else share * t))


LONG = {"program": gx.Program(step=0.01, until=0.4)}
MASS = {"flux": gx.MassFlux(0.1)}

# What is changed: the scene of the checkpoint, that of the resumed run, the sentence, the variant.
CHANGED = {
    "class attribute of a law": (
        lambda mesh: {"growth": growth()},
        lambda mesh: {"growth": growth(factor=3.0)},
        "the drive of Mine at sample energies is .* somewhere, here",
    ),
    "drive": (
        lambda mesh: {"growth": growth(lambda self, energy, material: 2 * energy)},
        lambda mesh: {"growth": growth(lambda self, energy, material: 2 * energy + energy**2)},
        "the drive of Mine at sample energies is .* somewhere, here",
    ),
    "drive between samples": (
        lambda mesh: {"growth": growth(lambda self, energy, material: 2 * energy)},
        lambda mesh: {"growth": growth(lambda self, energy, material: energy + energy)},
        "the mass source of Mine is written otherwise: ",
    ),
    "power": (
        lambda mesh: {"growth": growth()},
        lambda mesh: {"growth": growth(power=lambda self, material: -2.0)},
        "the power of Mine is -1, here -2",
    ),
    "energy": (
        lambda mesh: {"material": material(stiffer(1.0))},
        lambda mesh: {"material": material(stiffer(1.1))},
        "a stress of Mine at sample stretches is .* somewhere, here",
    ),
    "open traction": (
        lambda mesh: loads(gx.OpenTraction("top", lambda u, rho, x: -u)),
        lambda mesh: loads(gx.OpenTraction("top", lambda u, rho, x: -1.1 * u)),
        "open load 1, on 'top', is written otherwise",
    ),
    "open body force": (
        lambda mesh: loads(gx.OpenBodyForce(lambda u, rho, x: 0.01 * rho * x)),
        lambda mesh: loads(gx.OpenBodyForce(lambda u, rho, x: -0.01 * rho * x)),
        "open load 1, in the whole body, is written otherwise",
    ),
    "open load of one's own": (
        lambda mesh: loads(bedded(1.0)),
        lambda mesh: loads(bedded(1.5)),
        "open load 1, on 'right', is written otherwise",
    ),
    "constant of a load": (
        lambda mesh: loads(spring_of_a_constant(1.0, mesh)),
        lambda mesh: loads(spring_of_a_constant(1.1, mesh)),
        "what the balance of momentum in a sample state is out by, form 2, is .* somewhere, here",
    ),
    "sign of a constant": (
        lambda mesh: loads(spring_of_a_constant(1.0, mesh)),
        lambda mesh: loads(spring_of_a_constant(-1.0, mesh)),
        "what the balance of momentum in a sample state is out by, form 2, is .* somewhere, here",
    ),
    "place of an open load": (
        lambda mesh: {"mesh": held_at("top", mesh), **loads(gx.OpenTraction("there", lambda u, rho, x: -u))},
        lambda mesh: {"mesh": held_at("right", mesh), **loads(gx.OpenTraction("there", lambda u, rho, x: -u))},
        "what the balance of momentum in a sample state is out by, form 2, is .* somewhere, here",
    ),
    "dead load of one's own": (
        lambda mesh: {"loads": (pushed((0.1, 0.0)),)},
        lambda mesh: {"loads": (pushed((0.1, 0.01)),)},
        "the nodal force of full dead loads is .* somewhere, here",
    ),
    "history": (
        lambda mesh: loads(gx.Traction("top", (0.0, 0.01), history=lambda t: t)),
        lambda mesh: loads(gx.Traction("top", (0.0, 0.01), history=lambda t: 2 * t)),
        "the history of load 1 is .* somewhere, here",
    ),
    "late in a history": (
        lambda mesh: {**late(1.0), **LONG},
        lambda mesh: {**late(1.5), **LONG},
        "the history of load 1 is .* somewhere, here",
    ),
    "influx": (
        lambda mesh: {"influx": (gx.Influx("right", lambda u, rho, x: 1.3 - rho),)},
        lambda mesh: {"influx": (gx.Influx("right", lambda u, rho, x: 1.4 - rho),)},
        "the influx on 'right' is written otherwise",
        gx.Q1Q1,
    ),
    "dependence of a flux": (
        lambda mesh: {"flux": gx.MassFlux(0.1, lambda relative: relative)},
        lambda mesh: {"flux": gx.MassFlux(0.1, lambda relative: relative**2)},
        "the mass flux is written otherwise",
        gx.Q1Q1,
    ),
    "conduction": (
        lambda mesh: {"flux": gx.MassFlux(lambda x: 0.1 + 0 * x[0])},
        lambda mesh: {"flux": gx.MassFlux(lambda x: 0.1 + 0.1 * x[0])},
        "the field 'conduction' is .* somewhere, here",
        gx.Q1Q1,
    ),
    "initial density": (
        lambda mesh: {"initial_density": lambda x: 1.0 + 0 * x[0]},
        lambda mesh: {"initial_density": lambda x: 1.0 + 0.1 * x[0]},
        "the initial density is .* somewhere, here",
    ),
    "place of a density": (
        lambda mesh: {"mesh": held_at("top", mesh), "prescribed_densities": (gx.PrescribedDensity("there", 1.3),)},
        lambda mesh: {"mesh": held_at("right", mesh), "prescribed_densities": (gx.PrescribedDensity("there", 1.3),)},
        "the number of conditions on an unknown is .* somewhere, here",
        gx.Q1Q1,
    ),
    "region that grows": (
        lambda mesh: {"growing": ("bone",)},
        lambda mesh: {"growing": ("bone",), "mesh": replace(mesh, regions={"bone": mesh.regions["implant"]})},
        "the volume that grows with a density is .* somewhere, here",
    ),
}
CASES = [pytest.param(*parts, *[gx.Q1P0][len(parts) - 3 :], id=name) for name, parts in CHANGED.items()]


@pytest.mark.parametrize(("first", "second", "sentence", "variant"), CASES)
def test_what_has_changed_is_refused_and_what_has_not_is_resumed(first, second, sentence, variant, shared_folder):
    """A law of the same name and parameters may be another law."""
    mesh = square(3, 0.05)
    all_changes = [{"mesh": mesh, "program": PROGRAM, **changes(mesh)} for changes in (first, first, second)]
    scene, same, other = (block(**changes) for changes in all_changes)
    every = len(scene.program.times()) - 1
    whole = gx.solve(scene, variant, out=shared_folder / "whole", checkpoint=every)
    last = shared_folder / "whole" / f"checkpoint-{every:06d}.npz"
    with pytest.raises(InputError, match=f"is of another run, where {sentence}.* would be right$"):
        gx.solve(other, variant, resume=last)
    resumed = gx.solve(same, variant, out=shared_folder / "resumed", checkpoint=every, resume=last)
    if COMM.size == 1:
        assert np.array_equal(densities(resumed.problem), densities(whole.problem))
    assert densities(resumed.problem) == pytest.approx(densities(whole.problem), rel=1e-12)


def test_a_changed_constant_of_a_module_is_refused(shared_folder, monkeypatch):
    """No class tells of it."""
    mine = growth(lambda self, energy, material: FACTOR * energy)
    scene = block(square(2), growth=mine, program=PROGRAM)
    gx.solve(scene, gx.Q1, out=shared_folder / "first", checkpoint=1)
    monkeypatch.setattr(sys.modules[__name__], "FACTOR", 2.5)
    with pytest.raises(InputError, match=r"the drive of Mine at sample energies is 2e-12 somewhere, here 2.5e-12"):
        gx.solve(scene, gx.Q1, resume=shared_folder / "first")


def test_other_steps_of_ones_own_are_refused(shared_folder):
    """The way through time is a part of a run."""
    scene = block(square(2), program=PROGRAM)
    gx.solve(scene, gx.Q1P0, out=shared_folder / "first", checkpoint=1, stepping=cut(0.5))
    assert gx.solve(scene, gx.Q1P0, resume=shared_folder / "first", stepping=cut(0.5)).converged
    with pytest.raises(InputError, match=r"the end of a step of Mine in a trial is 0.05 somewhere, here 0.025"):
        gx.solve(scene, gx.Q1P0, resume=shared_folder / "first", stepping=cut(0.25))


def test_another_variant_of_the_same_name_is_refused(shared_folder):
    """A copy with other rules keeps the name."""
    scene = block(square(2), program=PROGRAM)
    gx.solve(scene, gx.Q1P0, out=shared_folder / "first", checkpoint=1)
    with pytest.raises(InputError, match=r"the variant\.mass_degree is 3\.0, here 5\.0"):
        gx.solve(scene, replace(gx.Q1P0, mass_degree=5), resume=shared_folder / "first")
    assert gx.solve(scene, replace(gx.Q1P0, summary="mine"), resume=shared_folder / "first").converged


@pytest.mark.parametrize("first", [1, 8, 9, 98, 99, 999, 99999])
def test_the_signature_of_a_form_does_not_know_what_was_made_before(first):
    """By its number alone, the second of two constants would come first where it has a figure more."""

    def written(number):
        domain = square(1).domain
        one, other = (ufl.Constant(domain, count=number + place) for place in (0, 1))
        x = ufl.SpatialCoordinate(domain)
        return fingerprint.signature((one * other * x[0] + one**2 + other) * ufl.dx)

    assert written(first) == written(3)


def test_another_version_of_ufl_is_said_and_compared_by_values(shared_folder, monkeypatch, caplog):
    """It may write the same form otherwise: that alone makes no other run, and other values do."""
    scene = block(square(2), growth=growth(), program=PROGRAM)
    gx.solve(scene, gx.Q1, out=shared_folder / "first", checkpoint=1)
    monkeypatch.setattr(fingerprint.ufl, "__version__", "1.0")
    with caplog.at_level(logging.WARNING, logger="growthx"):
        same = growth(lambda self, energy, material: energy + energy)  # written otherwise
        assert gx.solve(replace(scene, growth=same), gx.Q1, resume=shared_folder / "first").converged
    said = [text for text in caplog.messages if "was left under UFL" in text]
    assert len(said) == (COMM.rank == 0) and all("here it is 1.0, with basix" in text for text in said)
    with pytest.raises(InputError, match="the drive of Mine at sample energies"):
        gx.solve(replace(scene, growth=growth(factor=3.0)), gx.Q1, resume=shared_folder / "first")


# -- the fingerprint itself --------------------------------------------------------------------------------------------

KINDS = {
    "Q1P0": (gx.Q1P0, {}),
    "Q1": (gx.Q1, {"inertia": gx.Inertia()}),
    "Q2Q2": (gx.Q2Q2, {**MASS, "inertia": gx.Inertia(), "growing": ("bone",)}),
    "S2fri": (gx.S2fri, {"growth": gx.EnergyDrivenGrowth(0.01, 5.0, bounds=(0.5, 2.0), dead_zone=0.01)}),
    "P2P1": (gx.P2P1, {"material": gx.Material(lambda x: 1 + x[0], 0.25, lambda x: 1.2 - 0.1 * x[0])}),
    "two cases": (
        gx.Q1Q1,
        {
            "cases": (
                gx.LoadCase("a", 2.0, (gx.Traction("right", (0.1, 0.0)),)),
                gx.LoadCase("b", 1.0, (gx.OpenTraction("top", lambda u, rho, x: -u),)),
            ),
            "loads": (),
        },
    ),
}


@pytest.mark.parametrize("name", KINDS)
def test_it_is_the_same_at_any_time_and_leaves_the_state_alone(name):
    """An interruption asks for it in the middle of a run."""
    variant, changes = KINDS[name]
    scene = block(square(3, 0.05, shape=variant.cells[0]), **changes)
    problem = gx.discretise(scene, variant)
    march, steps = gx.march(scene, variant, problem), gx.FixedSteps()
    first = identity(problem, steps, NewtonSettings())
    next(march), next(march)
    kept = [gathered(values) for values in state_of(problem)]
    rate, reactions = problem.mass_rate(), problem.reactions()
    again = identity(problem, steps, NewtonSettings())
    assert all(np.array_equal(one, gathered(other)) for one, other in zip(kept, state_of(problem), strict=True))
    assert problem.mass_rate() == rate
    assert all(np.array_equal(force, problem.reactions()[where]) for where, force in reactions.items())
    assert repr(first.numbers) == repr(again.numbers)
    for kind in ("unknowns", "densities"):
        for what, values in getattr(first, kind).items():
            assert np.array_equal(values, getattr(again, kind)[what], equal_nan=True), what


def state_of(problem):
    """Values that a step begins with."""
    arrays = [problem.system.unknown, problem.density, problem.state.old_density, *problem.displacements]
    constants = [problem.state.time_step.value, problem.state.share.value]
    return [*(function.x.array for function in arrays), np.ravel(constants), problem.state.accepted_density]


def test_it_has_no_state_that_is_not_admissible():
    """det F > 0 and positive densities, in 2D and 3D, or a sample would say nothing."""
    for variant, mesh in ((gx.Q1Q1, square(3)), (gx.S2fri, square(3)), (gx.P2, cube(1, shape="tetrahedron"))):
        problem = gx.discretise(block(mesh), variant)
        with trial(problem.system, *fingerprint._sample(problem)):
            assert inadmissible(problem) == ""
        found = fingerprint._values_of_balances(problem)
        assert np.all(np.isfinite([number for values in found.values() for number in values]))


SCRIPT = """
import sys
sys.path[:0] = [sys.argv[1], sys.argv[1] + "/results"]
from test_fingerprint import ranks_scene
import growthx as gx
variant = getattr(gx, sys.argv[2])
changes = {"resume": sys.argv[4]} if len(sys.argv) > 4 else {}
result = gx.solve(ranks_scene(variant, 0.4 if changes else 0.2), variant, out=sys.argv[3], checkpoint=1, **changes)
if result.problem.comm.rank == 0:
    print(result.time)
"""


def ranks_scene(variant, until):
    """A scene with all that users may write, for runs on other numbers of ranks."""
    extra = {"influx": (gx.Influx("right", lambda u, rho, x: 1.3 - rho),), **MASS} if not variant.density.local else {}
    return block(
        square(4, 0.05),
        growth=growth(),
        material=material(stiffer(1.1)),
        program=gx.Program(step=0.1, until=until),
        **loads(gx.OpenTraction("top", lambda u, rho, x: -u), bedded(1.0)),
        **extra,
    )


@pytest.mark.serial
@pytest.mark.parametrize("variant", ["Q1P0", "Q1Q1"])
@pytest.mark.parametrize(("first", "second"), [(1, 2), (2, 1)])
def test_it_is_the_same_on_other_numbers_of_ranks_and_in_other_processes(variant, first, second, tmp_path):
    """A run goes on where there is room."""

    def started(ranks, *arguments):
        command = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
        command += [sys.executable, "-c", SCRIPT, str(Path(__file__).parents[1]), variant, *map(str, arguments)]
        run = subprocess.run(command, capture_output=True, text=True, timeout=300)
        assert run.returncode == 0, run.stderr
        return run.stdout.split()[-1]

    assert started(first, tmp_path / "first") == "0.2"
    assert started(second, tmp_path / "second", tmp_path / "first") == "0.4"
