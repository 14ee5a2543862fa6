"""FEBio's verification problem cr02, a rod that grows denser under its own shear-fed axial force.

A rod of 1 × 1 × 10 with ν = 0 and E = 10⁴ stands on z = 0; (0, 0, −10) presses per area on its end at z = 10 and
(0, 0, −0.25) per area along its four sides, so that a section bears N(z) = −(20 − z) and nothing else.  With n = 2,
m = 1 (Weinans, Huiskes & Grootenboer), ρ* = c = 1 and Ψ₀* = 0.01 the steady state in small strains is
ρ(z) = [(20 − z)²/(2 E Ψ₀*)]^(1/3).  As m < n the model is not well posed; that the force is determined by statics saves
the problem as long as the sections of a mesh do not compete for it.
"""

import logging

import dolfinx
import numpy as np
import pytest
from blocks import COMM, densities
from scipy.optimize import brentq

import growthx as gx
from growthx.model import exponents

YOUNG, ATTRACTOR, LENGTH = 1e4, 0.01, 10.0


def rod(cells):
    """The rod in 1 × 1 × cells hexahedra, held so that it may become wider or narrower, over 15 rates of growth."""
    domain = dolfinx.mesh.create_box(
        COMM, ((0.0, 0.0, 0.0), (1.0, 1.0, LENGTH)), (1, 1, cells), dolfinx.mesh.CellType.hexahedron
    )
    # With one cell across, all nodes lie on the sides: a facet belongs to one of them by a condition of its own.
    sides = {f"side {i} {at}": (i, at) for i in (0, 1) for at in (0.0, 1.0)} | {"foot": (2, 0.0), "end": (2, LENGTH)}
    places = {name: lambda x, i=i, at=at: np.isclose(x[i], at) for name, (i, at) in sides.items()}
    shear = tuple(gx.Traction(name, (0.0, 0.0, -0.25)) for name in sides if name.startswith("side"))
    return gx.Scene(
        name="cr02",
        mesh=gx.Mesh.with_names(domain, places),
        material=gx.Material(young=YOUNG, poisson=0.0, reference_density=1.0, density_exponent=2.0),
        growth=gx.EnergyDrivenGrowth(attractor=ATTRACTOR, rate=1.0, exponent=1.0),
        supports=(
            gx.Support("foot", (None, None, 0.0)),
            gx.PointSupport((0.0, 0.0, 0.0), (0.0, 0.0, None)),
            gx.PointSupport((1.0, 0.0, 0.0), (None, 0.0, None)),
        ),
        loads=(gx.Traction("end", (0.0, 0.0, -10.0)), *shear),
        program=gx.Program(step=5.0, until=1500.0, ramp=25.0),
    )


def small_strains(z):
    """Ψ = N²/(2E ρ²) in (6) at rest, FEBio's closed form."""
    return ((20 - z) ** 2 / (2 * YOUNG * ATTRACTOR)) ** (1 / 3)


def finite_strains(z):
    """ρ Ψ₀ⁿᵉᵒ(λ) = Ψ₀* and ρ² μ [λ − 1/λ] = N(z), with a lateral stretch of one: ν = 0 makes λ of Lamé vanish."""
    mu = YOUNG / 2

    def density(stretch):
        return ATTRACTOR / (mu / 2 * (stretch**2 - 1 - 2 * np.log(stretch)))

    def excess(stretch):
        return density(stretch) ** 2 * mu * (stretch - 1 / stretch) + 20 - z

    return density(brentq(excess, 0.9, 1 - 1e-6, xtol=1e-15))


def steady(cells, variant):
    """Places along the rod and densities at the end of a long march: z, ρ."""
    problem = gx.discretise(rod(cells), variant)
    *_, last = gx.march(problem.scene, variant, problem)
    assert last.time == 1500.0
    assert abs(problem.mass_rate()) < 1e-9 * problem.mass()
    _, _, z, rho = densities(problem).T
    return z, rho


@pytest.mark.parametrize("z", [0.0, 5.0, 10.0])
def test_the_closed_form_is_the_limit_of_small_strains(z):
    """The finite-strain form differs from FEBio's by a fraction of the strain, N/(E ρ²) about 0.1 %: not by 0."""
    rho, strain = small_strains(z), (20 - z) / (YOUNG * small_strains(z) ** 2)
    difference = abs(finite_strains(z) / rho - 1)
    assert 1e-3 < strain < 2e-3
    assert 0.1 * strain < difference < strain


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1sri], ids=lambda variant: variant.name)
@pytest.mark.parametrize("cells", [10, 20, 40])
def test_one_density_per_cell_is_that_of_its_midpoint(variant, cells):
    """The strain is constant in a cell and the force linear along it: its balance is that of the midpoint, exactly."""
    z, rho = steady(cells, variant)
    assert len(z) == cells
    assert rho == pytest.approx([finite_strains(at) for at in z], rel=1e-9)
    # What is left to the small-strain form is the strain, on every mesh.
    difference = np.abs(rho / small_strains(z) - 1).max()
    assert 2e-4 < difference < 5e-4


def test_densities_at_points_converge_with_the_cells():
    """They feel one strain per cell, hence agree within it: exact for the midpoint, of first order at the points."""
    errors = []
    for cells in (10, 20, 40):
        z, rho = steady(cells, gx.Q1)
        assert len(z) == 8 * cells
        errors.append(np.abs(rho / [finite_strains(at) for at in z] - 1).max())
        cell = np.floor(z * cells / LENGTH).astype(int)
        means = [rho[cell == i].mean() for i in range(cells)]
        middles = (np.arange(cells) + 0.5) * LENGTH / cells
        assert means == pytest.approx([finite_strains(at) for at in middles], rel=1e-7)
    slopes = np.log2(errors[:-1]) - np.log2(errors[1:])
    assert slopes == pytest.approx([1.0, 1.0], abs=0.05)


def test_nodal_densities_fall_apart():
    """Densities shared between cells compete for the force: the ill-posed model ends before its steady state."""
    problem = gx.discretise(rod(10), gx.Q1Q1)
    with pytest.raises(gx.EndedEarly, match="no positive density balances the mass at"):
        list(gx.march(problem.scene, gx.Q1Q1, problem))


def test_the_ill_posed_model_is_warned_of(caplog, monkeypatch):
    """FEBio's manual does not say so; whoever changes the load to an undetermined one should have read it."""
    monkeypatch.setattr(exponents, "_said", set())
    with caplog.at_level(logging.WARNING, logger="growthx"):
        gx.discretise(rod(10), gx.Q1P0)
    assert [record.getMessage()[:60] for record in caplog.records] == [
        "growthx: the stimulus does not fall as the density rises (n "
    ] * (COMM.rank == 0)
