"""Biological equilibrium without a march: the state that long marches, and homogeneous solutions, lead to."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import ROLLERS, block, densities, displacements, square

import growthx as gx
from growthx.common.errors import InputError
from growthx.constitutive.homogeneous import uniaxial_equilibrium
from growthx.discretisation.variants import CATALOGUE
from growthx.scenes.bar import DISCONTINUOUS, bar, equilibrium, midpoint_density_change
from growthx.scenes.plate import plate

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
FEW = (gx.Q1, gx.Q1P0, gx.Q1Q1, gx.P2)
few = pytest.mark.parametrize("variant", FEW, ids=lambda variant: variant.name)


@variants
@pytest.mark.parametrize("distortion", [0.0, 0.08], ids=["regular", "distorted"])
def test_a_homogeneous_block_is_in_uniaxial_equilibrium(variant, distortion):
    """Scalar equations know the density and both stretches: nothing of the path there may remain."""
    material, growth = gx.Material(3.0, 0.3, 1.2), gx.EnergyDrivenGrowth(0.05, 4.0)
    scene = block(
        square(2, distortion, shape=variant.cells[0]),
        material=material,
        growth=growth,
        supports=ROLLERS,
        loads=(gx.Traction("right", (0.9, 0.0)),),
    )
    problem, exact = gx.homeostasis(scene, variant, tolerance=1e-12), uniaxial_equilibrium(material, growth, 0.9)
    assert abs(exact.density - 1.2) > 0.1, "the density must move for the comparison to mean something"
    assert densities(problem)[:, 2] == pytest.approx(exact.density, rel=1e-9)
    x, y, u, v = displacements(problem).T
    assert u == pytest.approx((exact.stretch - 1) * x, abs=1e-9)
    assert v == pytest.approx((exact.transverse_stretch - 1) * y, abs=1e-9)


@few
@pytest.mark.parametrize("cells", [4, 8])
def test_it_is_where_a_long_march_ends(variant, cells):
    """The promise of the short way: same densities and displacements as forty thousand nominal steps.

    Its load grows in ten steps: under all of it at once, P2 comes to another equilibrium than that near rest.
    """
    scene = plate(cells, shape=variant.cells[0])
    short = gx.homeostasis(scene, variant)
    long = gx.solve(replace(scene, program=gx.Program(step=20.0, until=4000.0, ramp=200.0)), variant).problem
    # Nodal densities are known to the tolerance of their forces over the softest node's slope.
    assert densities(short) == pytest.approx(densities(long), abs=1e-8)
    assert displacements(short) == pytest.approx(displacements(long), abs=1e-8)


@few
def test_source_and_forces_vanish(variant):
    """Biological equilibrium is R₀ = 0 on the whole and, where densities are local, at each of them."""
    problem = gx.homeostasis(plate(6, shape=variant.cells[0]), variant)
    rate = abs(problem.mass_rate())
    assert rate < 1e-9
    reactions = problem.reactions()["left"]
    assert reactions == pytest.approx([0.0, 0.02], abs=1e-9)
    if variant.density.local:  # Ψ₀* = 0.02 and c = 10
        assert np.abs(gx.results.cell_fields(problem)["mass_source"]).max() < 1e-8


def test_with_flux_it_is_the_balance_of_source_and_flux():
    """Div R moves mass without making any: the total source vanishes still, and the densities are evened out."""
    scene = plate(6)
    with_flux = gx.homeostasis(replace(scene, flux=gx.MassFlux(0.05)), gx.Q1Q1)
    without = gx.homeostasis(scene, gx.Q1Q1)
    assert abs(with_flux.mass_rate()) < 1e-9
    assert np.ptp(with_flux.density_range()) < 0.8 * np.ptp(without.density_range())


def test_load_cases_have_one_equilibrium():
    """Equal cases must find that of their common load, through the same steps."""
    load = (gx.Traction("right", (0.1, -0.02)),)
    cases = tuple(gx.LoadCase(name, weight, load) for name, weight in (("walk", 3.0), ("run", 1.0)))
    plain, several = (gx.homeostasis(scene, gx.Q1P0) for scene in (block(loads=load), block(loads=(), cases=cases)))
    assert densities(several) == pytest.approx(densities(plain), rel=1e-8)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1P0], ids=lambda variant: variant.name)
def test_the_middle_of_the_bar_is_semi_analytic(variant):
    """Between two equal levels no neighbour disturbs the section: what is left comes from the steps a tenth away."""
    scene = bar(DISCONTINUOUS, 40)
    exact = equilibrium(scene, DISCONTINUOUS, 0.51).density
    assert 1 + midpoint_density_change(gx.homeostasis(scene, variant)) == pytest.approx(exact, abs=1e-5)


@few
def test_what_carries_no_load_has_no_equilibrium(variant):
    """Its density falls to zero in finite time: said in a sentence, after a few attempts, and not by a stuck loop."""
    with pytest.raises(gx.EndedEarly, match=r"^no biological equilibrium was found: .*; the march remains$"):
        gx.homeostasis(block(square(2, shape=variant.cells[0]), loads=()), variant)


@pytest.mark.parametrize("steps", [0, -1, 1.5])
def test_impossible_numbers_of_load_steps_are_refused(steps):
    """A load that never arrives would be taken for the full one."""
    with pytest.raises(InputError, match=r"the number of load steps is .*: a whole number from 1 would be right"):
        gx.homeostasis(block(), gx.Q1, load_steps=steps)


def test_a_way_in_circles_ends():
    """Where long steps fail and short ones do not lead to them (m < n), the search must give up with a sentence."""
    from scenes.test_cr02 import rod

    with pytest.raises(gx.EndedEarly, match="did not lead to one; the march remains"):
        gx.homeostasis(rod(4), gx.Q1P0)
