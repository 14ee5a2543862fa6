"""The semi-analytic equilibrium that the bar is compared with: the published numbers, and its own equations."""

import numpy as np
import pytest
from scipy.optimize import brentq

from growthx.common.errors import InputError
from growthx.constitutive.growth import EnergyDrivenGrowth
from growthx.constitutive.homogeneous import uniaxial_equilibrium
from growthx.constitutive.material import Material

SPEC = {2.0: 1.152298, 1.75: 1.180700, 1.5: 1.214209, 1.25: 1.254861, 1.0: 1.306171}


@pytest.mark.parametrize(("attractor", "density"), SPEC.items())
def test_published_densities(attractor, density):
    """Spec §3's numbers at traction 2, to every printed digit."""
    assert round(uniaxial_equilibrium(Material(1.0), EnergyDrivenGrowth(attractor), 2.0).density, 6) == density


def test_published_end_displacement():
    """The ten levels of the discontinuous bar, each on a tenth of its length, add up to spec §3's 2.371652."""
    stretches = [uniaxial_equilibrium(Material(1.0), EnergyDrivenGrowth(attractor), 2.0).stretch for attractor in SPEC]
    assert round(2 * sum(stretches) / 10 - 1, 6) == 2.371652


@pytest.mark.parametrize(("n", "m"), [(2, 3), (1, 4), (3.5, 5), (0, 1)])
@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
def test_equations_hold(n, m, poisson):
    """Written out with (6) and (7): no mass source, no transverse stress, the wanted traction, in a stretched bar."""
    material, growth, traction = Material(500.0, poisson, 1.2, n), EnergyDrivenGrowth(0.01, 1.0, m), 3.0
    at = uniaxial_equilibrium(material, growth, traction)
    lam = 500 * poisson / ((1 + poisson) * (1 - 2 * poisson))
    mu = 250 / (1 + poisson)
    a, b = at.stretch, at.transverse_stretch
    weight = (at.density / 1.2) ** n
    energy = lam / 2 * np.log(a * b) ** 2 + mu / 2 * (a * a + b * b - 2 - 2 * np.log(a * b))
    assert (at.density / 1.2) ** (n - m) * energy == pytest.approx(0.01, rel=1e-9)
    assert weight * (mu * a + (lam * np.log(a * b) - mu) / a) == pytest.approx(traction, rel=1e-9)
    assert abs(weight * (mu * b + (lam * np.log(a * b) - mu) / b)) < 1e-9 * traction
    assert a > 1 >= b > 0


def test_uncoupled_material_without_poissons_effect():
    """With n = 0 and ν = 0 the stretch is that of an elastic bar, μ [λ − 1/λ] = t, whatever grows."""
    stretch = brentq(lambda a: 0.5 * (a - 1 / a) - 0.4, 1, 5, xtol=1e-15)
    at = uniaxial_equilibrium(Material(1.0, 0.0, density_exponent=0), EnergyDrivenGrowth(0.7), 0.4)
    assert (at.stretch, at.transverse_stretch) == pytest.approx((stretch, 1.0), rel=1e-12)


@pytest.mark.parametrize("traction", [0.0, -1.0, float("nan")])
def test_only_tension(traction):
    """An unloaded bar has no equilibrium: the root finder's own message would not say so."""
    with pytest.raises(InputError, match=f"^the traction is {traction:g}: a positive number would be right$"):
        uniaxial_equilibrium(Material(1.0), EnergyDrivenGrowth(1.0), traction)
