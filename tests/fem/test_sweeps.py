"""Several cells at once say what they say one by one: forces, energies, densities and tangents, to round-off."""

import dolfinx
import numpy as np
import pytest
import ufl
from blocks import COMM, block, cube, square

import growthx as gx
from growthx.fem import compat
from growthx.fem.assembly import Compiler, assemble
from growthx.fem.sums import sweeps
from growthx.fem.sums.cell_sums import CellSums, can_be_added

pytestmark = pytest.mark.skipif(
    not compat.CELLS_OF_INTEGRALS, reason="with this DOLFINx cells are taken one by one: see docs/versions.md"
)
NEVER = 10**12
EACH = [
    (variant, shape)
    for shape in ("quadrilateral", "triangle", "hexahedron", "tetrahedron")
    for variant in gx.variants.suited(shape)
]
BENT = {"quadrilateral": square, "triangle": square, "hexahedron": cube, "tetrahedron": cube}


@pytest.fixture
def looked_at(monkeypatch):
    """What a scene says at a bent iterate, with and without several cells at once, and how many forms are summed so."""
    monkeypatch.setattr(sweeps, "WIDTH", 1)  # whatever the CPU

    def look(scene, variant, strain=0.02):
        found = []
        for fewest in (0, NEVER):
            monkeypatch.setattr(sweeps, "FEWEST", fewest)
            found.append(_said(gx.discretise(scene, variant), strain))
        return found

    return look


def _said(problem, strain):
    dim, system = problem.scene.mesh.dim, problem.system
    system.begin_step(0.1, 0.5)
    bent, density = (dolfinx.fem.Function(space) for space in (problem.displacement_space, problem.density_space))
    bent.interpolate(lambda x: np.array([np.sin(2 * x[0] + x[1]), x[0] * x[1], x[1] * x[2] + x[0] ** 2])[:dim])
    for case, part in enumerate(system.unknowns.parts):
        system.unknown.x.array[part] = strain * (1 - 0.4 * case) * bent.x.array
    if system.unknowns.density_part is not None:
        density.interpolate(lambda x: 1.2 + 0.1 * np.sin(3 * x[0] + x[1]))
        system.unknown.x.array[system.unknowns.density_part] = density.x.array
    forces = system.out_of_balance()
    values = {"forces": forces, "borne": system.borne.copy(), "density": system.densities.iterate().copy()}
    if can_be_added(problem.displacement_space):
        sums = CellSums(problem.displacement_space)
        for case, forms in enumerate(system.own_tangents):
            values[f"tangent {case}"] = sums(forms)
    forms = [*system.residuals, *(form for forms in system.own_tangents for form in forms)]
    return values, [getattr(form, "sweep", None) is not None for form in forms]


def _assert_same(found, least):
    (values, swept), (expected, one_by_one) = found
    assert not any(one_by_one)
    assert sum(swept) >= least
    for name, value in expected.items():
        size = COMM.allreduce(np.abs(value).max(initial=0.0), max)
        assert size > 0
        assert np.abs(values[name] - value).max(initial=0.0) < 1e-12 * size, name


@pytest.mark.parametrize("variant, shape", EACH, ids=lambda value: getattr(value, "name", value))
def test_variants_say_the_same(looked_at, variant, shape):
    """In all discretisations, of cells that are no multiple of the lanes."""
    found = looked_at(
        block(BENT[shape](3 if shape in ("quadrilateral", "triangle") else 2, 0.03, shape=shape)), variant
    )
    _assert_same(found, least=1)


SCENES = {
    "a bone that is stiff and hardly strained": (
        {"material": gx.Material(young=17000.0, poisson=0.3, reference_density=1.2)},
        gx.Q1P0,
        1e-4,
    ),
    "powers that are not whole": (
        {"material": gx.Material(young=1.0, poisson=0.25, reference_density=1.2, density_exponent=2.5)},
        gx.Q1,
        0.02,
    ),
    "strains beyond the series of the logarithm": ({}, gx.Q1, 0.4),
    "a part that rests": ({"growing": ("bone",)}, gx.Q1P0, 0.02),
    "bounds": ({"growth": gx.EnergyDrivenGrowth(attractor=0.01, rate=5.0, bounds=(1.19, 1.3))}, gx.Q1P0, 0.02),
    "load cases": (
        {
            "loads": (),
            "cases": (
                gx.LoadCase("pulled", 3.0, (gx.Traction("right", (0.1, -0.02)),)),
                gx.LoadCase("bent", 1.0, (gx.Traction("right", (-0.03, 0.05)),)),
            ),
        },
        gx.Q1P0,
        0.02,
    ),
    "a field of stiffness": (
        {"material": gx.Material(young={"bone": 1.0, "implant": 3.0}, poisson=0.25, reference_density=1.2)},
        gx.Q1,
        0.02,
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_scenes_say_the_same(looked_at, name):
    """What scenes may have beside the plain one is gathered, too."""
    changes, variant, strain = SCENES[name]
    _assert_same(looked_at(block(square(6, 0.04), **changes), variant, strain), least=2)


def test_what_is_no_number_shows(looked_at):
    """Where cells are turned inside out nothing hides it."""
    (values, _), (expected, _) = looked_at(block(square(5)), gx.Q1P0, -3.0)
    assert np.array_equal(np.isnan(values["forces"]), np.isnan(expected["forces"]))
    assert COMM.allreduce(bool(np.isnan(values["forces"]).any()), max)


def test_runs_agree(monkeypatch):
    """A run ends where it ends cell by cell, by as many iterations, and twice at the same bits."""
    monkeypatch.setattr(sweeps, "WIDTH", 1)
    ends = []
    for fewest in (0, 0, NEVER):
        monkeypatch.setattr(sweeps, "FEWEST", fewest)
        result = gx.solve(block(square(7, 0.03)), gx.Q1)
        ends.append((result.problem.mass(), result.newton_iterations, result.problem.displacement.x.array.copy()))
    if COMM.size == 1:
        assert ends[0][0] == ends[1][0]
        assert np.array_equal(ends[0][2], ends[1][2])
    assert ends[0][0] == pytest.approx(ends[2][0], rel=1e-12)
    assert ends[0][1] == ends[2][1]


def test_sides_are_left_to_dolfinx(monkeypatch):
    """A form with an integral over sides is none of cells."""
    monkeypatch.setattr(sweeps, "FEWEST", 0)
    domain = square(5).domain
    space = dolfinx.fem.functionspace(domain, ("Lagrange", 1))
    form = Compiler().residual(ufl.TestFunction(space) * (ufl.dx + ufl.ds))
    assert form.sweep is None
    assert COMM.allreduce(float(assemble(form).sum())) == pytest.approx(5.0)


def test_small_bodies_are_taken_one_by_one():
    """Where there are few cells compilation is not worth it."""
    assert not any(_said(gx.discretise(block(square(5)), gx.Q1P0), 0.01)[1])
