"""Plane stress as the limit of thin layers in space: pressures on the sides of a plate, and states that vary in it."""

from dataclasses import replace

import dolfinx
import numpy as np
import pytest
from blocks import (
    COMM,
    ROLLERS,
    assert_tangent_matches_differences,
    block,
    gathered,
    set_iterate,
    square,
    tangent,
)
from scipy.optimize import brentq

import growthx as gx

E, NU = 17e3, 0.3  # MPa: bone's
STILL = gx.EnergyDrivenGrowth(attractor=0.0, rate=0.0)
MIDDLE = tuple(  # held by three planes of symmetry
    gx.Support(name, tuple(0.0 if i == j else None for j in range(3)))
    for i, name in enumerate(("left", "bottom", "back"))
)


def layer(cells, thickness):
    """Half of a square plate, cells × cells × 1 hexahedra, above its middle plane."""
    ends = [np.zeros(3), np.array([1.0, 1.0, thickness / 2])]
    box = dolfinx.mesh.create_box(COMM, ends, [cells, cells, 1], dolfinx.mesh.CellType.hexahedron)
    sides = {"left": (0, 0.0), "right": (0, 1.0), "bottom": (1, 0.0), "top": (1, 1.0), "back": (2, 0.0)}
    return gx.Mesh.with_names(
        box, {name: lambda x, i=i, at=at: np.isclose(x[i], at) for name, (i, at) in sides.items()}
    )


@pytest.mark.parametrize("material", [gx.Material(1.0, NU, 1.2), gx.Hencky(1.0, NU, 1.2), gx.Ogden(1.0, NU, 1.2)])
def test_a_pressure_acts_on_the_thickness_as_it_is(material):
    """Squeezed to a tenth, and growing, as a layer of hexahedra that the same pressure squeezes on its sides."""
    common = {"material": material, "growth": gx.EnergyDrivenGrowth(0.02, rate=5.0)}
    common["loads"] = (gx.Pressure("right", 0.15), gx.Pressure("top", -0.1))
    plane = gx.solve(block(square(2), supports=ROLLERS, plane="stress", **common), gx.Q1, tolerance=1e-12)
    space = gx.solve(block(layer(2, 0.1), supports=MIDDLE, **common), gx.Q1, tolerance=1e-12)
    for one, other in zip(plane.steps, space.steps, strict=True):
        assert one.mass == pytest.approx(20 * other.mass, rel=1e-9)
        assert one.force_defect < 1e-9
    u, v = plane.problem.sample_displacement(np.array([[1.0, 1.0]]))[0]
    corner = space.problem.sample_displacement(np.array([[1.0, 1.0, 0.05]]))[0]
    assert corner[:2] == pytest.approx([u, v], rel=1e-9)
    assert max(abs(u), abs(v)) > 0.1
    stretch = gathered(gx.results.cell_fields(plane.problem, ["thickness_stretch"])["thickness_stretch"])
    assert stretch == pytest.approx(1 + 20 * corner[2], rel=1e-9)
    assert abs(stretch.mean() - 1) > 0.01, "else there would be nothing to see"


@pytest.mark.parametrize("pressure", [1e-4 * E, -1e-4 * E, 0.2 * E])
def test_a_pressed_strip_is_its_scalar_solution(pressure):
    """Of bone's modulus: P = −p b², b the stretch across and in the thickness, at small strains and large ones."""
    lam, mu = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))

    def across(a):
        return brentq(lambda b: lam * np.log(a * b * b) + mu * (b * b - 1), 0.5, 1.5, xtol=1e-16, rtol=1e-15)

    def out_by(a):
        b = across(a)
        return (lam * np.log(a * b * b) + mu * (a * a - 1)) / a + pressure * b * b

    along = brentq(out_by, 0.5, 1.5, xtol=1e-16, rtol=1e-15)
    scene = block(square(2, 0.1), material=gx.Material(E, NU), growth=STILL, supports=ROLLERS, plane="stress")
    scene = replace(scene, loads=(gx.Pressure("right", pressure),), program=gx.Program(0.25, 1.0, ramp=1.0))
    problem = gx.solve(scene, gx.Q1Q1, tolerance=1e-13).problem
    corner = problem.sample_displacement(np.array([[1.0, 1.0]]))[0]
    assert corner == pytest.approx([along - 1, across(along) - 1], rel=1e-8)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.Q1Q1, gx.S2Q1, gx.P1, gx.P2P1], ids=lambda v: v.name)
def test_newtons_method_knows_how_a_pressed_side_thickens(variant):
    """At a far iterate of a distorted body: the thickness on its sides is a part of the stiffness."""
    loads = (gx.Pressure("right", 0.3), gx.Pressure("top", -0.2), gx.Pressure("bottom", 0.1))
    scene = block(square(2, 0.06, shape=variant.cells[0]), loads=loads, plane="stress")
    problem = gx.discretise(scene, variant)
    problem.system.begin_step(0.1, 0.7)
    set_iterate(
        problem,
        lambda x: np.stack([0.3 * np.sin(2 * x[0]) + 0.1 * x[1], 0.2 * x[0] * x[1] - 0.15 * x[1]]),
        lambda x: 1.0 + 0.3 * np.cos(3 * x[0] + x[1]),
    )
    assert_tangent_matches_differences(problem, tangent(problem))


def test_a_free_plate_under_pressure_all_around_is_in_balance():
    """N dA of all sides is nothing where the thickness is one: on plates held at a corner no support bears anything."""
    around = tuple(gx.Pressure(name, 0.2) for name in ("left", "right", "bottom", "top"))
    pins = (gx.PointSupport((0.0, 0.0)), gx.PointSupport((1.0, 0.0), (None, 0.0)))
    scene = block(square(3, 0.08, shape="triangle"), growth=STILL, supports=pins, loads=around, plane="stress")
    result = gx.solve(scene, gx.P2P1, tolerance=1e-12)
    for force in result.steps[-1].reactions.values():
        assert force == pytest.approx([0.0, 0.0], abs=1e-10)
    u = result.problem.sample_displacement(np.array([[1.0, 1.0]]))[0]
    assert u[0] == pytest.approx(u[1]) and u[0] < -0.05


def test_a_state_that_varies_in_the_plate_is_the_limit_of_thin_layers():
    """Under a traction that varies along a side: displacements and mass of layers differ by the square of thickness."""
    growth = gx.EnergyDrivenGrowth(0.005, rate=5.0)

    def traction(dim):
        return gx.Traction("right", lambda x: np.outer(np.eye(dim)[0], 0.1 * (1 + 0.5 * np.cos(np.pi * x[1]))))

    flat = block(square(8), growth=growth, supports=ROLLERS, loads=(traction(2),), plane="stress")
    plane, points = gx.solve(flat, gx.Q2, tolerance=1e-12), np.array([[1.0, 1.0], [1.0, 0.0], [0.5, 0.5]])
    u, apart = plane.problem.sample_displacement(points), []
    for thickness in (0.1, 0.05, 0.025):
        thick = block(layer(8, thickness), growth=growth, supports=MIDDLE, loads=(traction(3),))
        space = gx.solve(thick, gx.Q2, tolerance=1e-12)
        moved = space.problem.sample_displacement(np.column_stack([points, np.full(3, thickness / 2)]))
        mass = space.problem.mean_density() - plane.problem.mean_density()
        apart.append([np.abs(moved[:, :2] - u).max() / np.abs(u).max(), abs(mass) / 1.2])
    orders = np.log2(np.array(apart[:-1]) / np.array(apart[1:]))
    assert np.all((orders > 1.7) & (orders < 2.1)), orders
    assert apart[-1][0] < 3e-5 and apart[-1][1] < 1e-8
