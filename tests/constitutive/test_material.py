"""One energy, one stress: every other formula of the material is checked against the energy and the paper's (7)."""

import numpy as np
import pytest
import ufl
from blocks import elastic_energy

from growthx.common.errors import InputError
from growthx.constitutive.expressions import exact_exponent
from growthx.constitutive.material import Material

MATERIAL = Material(young=2.0, poisson=0.3, reference_density=1.3, density_exponent=2.5)
DENSITY = 1.7


def numbers(expression):
    """The values of a UFL expression of numbers, as an array of its shape."""
    expression = ufl.algorithms.expand_derivatives(expression)
    values = [expression[index](()) for index in np.ndindex(expression.ufl_shape)] if expression.ufl_shape else None
    return np.reshape(values, expression.ufl_shape) if values else expression(())


def matrix(F):
    """An array as UFL."""
    return ufl.as_matrix(F.tolist())


def random_gradient(dim, seed):
    """A deformation gradient with det F > 0, far from symmetric and from small strains."""
    F = np.eye(dim) + np.random.default_rng(seed).uniform(-0.3, 0.3, (dim, dim))
    assert np.linalg.det(F) > 0.2
    return F


def energy(F, material=MATERIAL, density=DENSITY):
    """[ρ/ρ*]ⁿ Ψ₀ⁿᵉᵒ in NumPy, F of shape (dim, dim)."""
    return material.weight(density) * elastic_energy(material, F - np.eye(len(F)))


def stress(F, material=MATERIAL, density=DENSITY):
    """The stress of the module as an array."""
    return numbers(material.stress(matrix(F - np.eye(len(F))), density))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_stress_is_the_derivative_of_the_energy(dim, seed):
    """Growth is driven by the energy and equilibrium by the stress: two laws instead of one would lose symmetry."""
    F, step = random_gradient(dim, seed), 1e-5
    differences = np.empty_like(F)
    for index in np.ndindex(F.shape):
        shift = np.zeros_like(F)
        shift[index] = step
        differences[index] = (energy(F + shift) - energy(F - shift)) / (2 * step)
    assert np.allclose(stress(F), differences, rtol=0, atol=1e-8)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_stress_is_the_papers(dim, seed):
    """P̄ = [ρ/ρ*]ⁿ { μ F + [λ ln J − μ] F⁻ᵀ } (7), written out here with λ and μ of E = 2, ν = 0.3."""
    F = random_gradient(dim, seed)
    lam, mu = 2 * 0.3 / (1.3 * 0.4), 2 / 2.6
    formula = mu * F + (lam * np.log(np.linalg.det(F)) - mu) * np.linalg.inv(F).T
    assert np.allclose(stress(F), (1.7 / 1.3) ** 2.5 * formula, rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("dim", [2, 3])
def test_undeformed_and_rotated_bodies_store_nothing(dim):
    """An energy or a stress at rest would make bone grow without a load."""
    rotation = np.linalg.qr(np.random.default_rng(1).standard_normal((dim, dim)))[0]
    rotation[0] *= np.sign(np.linalg.det(rotation))
    for F in (np.eye(dim), rotation):
        assert abs(energy(F)) < 1e-14 and np.abs(stress(F)).max() < 1e-14


@pytest.mark.parametrize("dim", [2, 3])
def test_objectivity_and_isotropy(dim):
    """Ψ(QF) = Ψ(F) = Ψ(FQ) and P(QF) = Q P(F): the energy must not see how the body or its material is turned."""
    F = random_gradient(dim, 5)
    Q = np.linalg.qr(np.random.default_rng(2).standard_normal((dim, dim)))[0]
    Q[0] *= np.sign(np.linalg.det(Q))
    assert energy(Q @ F) == pytest.approx(energy(F), rel=1e-13) == energy(F @ Q)
    assert np.allclose(stress(Q @ F), Q @ stress(F), rtol=0, atol=1e-14)


def test_small_strains_are_hookes():
    """λ and μ must be those of E and ν: in uniaxial strain the modulus is E(1−ν)/((1+ν)(1−2ν))."""
    strain = 1e-7
    modulus = stress(np.diag([1 + strain, 1.0, 1.0]), density=1.3)[0, 0] / strain
    assert modulus == pytest.approx(2 * 0.7 / (1.3 * 0.4), rel=1e-6)


def test_floats_arrays_and_ufl_give_the_same():
    """The law is written once for all three: the pointwise Newton and the weak forms must not drift apart."""
    gradients = [random_gradient(2, seed) for seed in range(3)]
    volume = np.array([np.linalg.det(F) - 1 for F in gradients])
    shape = np.array([np.sum(F * F) + 1 - 3 for F in gradients]) - 2 * volume
    arrays = MATERIAL.elastic_energy(shape, volume)
    floats = [MATERIAL.elastic_energy(float(a), float(b)) for a, b in zip(shape, volume, strict=True)]
    symbolic = [numbers(MATERIAL.energy_at(matrix(F - np.eye(2)))) for F in gradients]
    assert np.allclose(arrays, floats, rtol=1e-15) and np.allclose(arrays, symbolic, rtol=1e-13)


@pytest.mark.parametrize("stretches", [(1.3, 0.8, 1.0), (0.6, 1.9, 1.1)])
def test_principal_stresses(stretches):
    """P̄ᵢ = [ρ/ρ*]ⁿ { μ λᵢ + [λ ln J − μ]/λᵢ }, (7) on the diagonal; the semi-analytic solutions rest on it."""
    expected = np.diag(stress(np.diag(stretches)))
    extensions = tuple(stretch - 1 for stretch in stretches)
    assert np.allclose(MATERIAL.principal_stresses(extensions, DENSITY), expected, rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("n", [0, 1, 2, 3.5])
def test_weight_is_the_power_n_of_relative_density(n):
    """A weight that ignored n would pass all tests at n = 2."""
    material = Material(young=1.0, reference_density=1.2, density_exponent=n)
    assert material.weight(1.2) == 1.0
    assert material.weight(2.4) == pytest.approx(2.0**n, rel=1e-15)
    assert np.allclose(material.weight(np.array([0.6, 2.4])), [0.5**n, 2.0**n], rtol=1e-15)


def test_whole_exponents_become_integers():
    """Compilers turn integer powers into products, which is what makes n = 2.0 as fast as n = 2."""
    assert [type(exact_exponent(value)) for value in (2.0, -1.0, 2.5)] == [int, int, float]


@pytest.mark.parametrize(
    ("parameters", "sentence"),
    [
        ({"young": 0.0}, "Young's modulus E is 0: a positive number would be right"),
        ({"young": -5}, "Young's modulus E is -5: a positive number would be right"),
        ({"young": float("nan")}, "Young's modulus E is nan: a positive number would be right"),
        ({"young": {"bone": 1.0, "stem": -1}}, "Young's modulus E of 'stem' is -1: a positive number would be right"),
        ({"poisson": 0.5}, "Poisson's ratio ν is 0.5: a number above -1 and below 0.5 would be right"),
        ({"poisson": -1.0}, "Poisson's ratio ν is -1: a number above -1 and below 0.5 would be right"),
        ({"reference_density": 0}, "the reference density ρ* is 0: a positive number would be right"),
        ({"density_exponent": -1}, "the density exponent n is -1: a number of at least 0 would be right"),
        ({"density_exponent": None}, "the density exponent n is None: a number of at least 0 would be right"),
    ],
)
def test_impossible_parameters_are_refused(parameters, sentence):
    """Each would run and give a wrong answer or fail far away; the sentence must name symbol, value and remedy."""
    with pytest.raises(InputError) as caught:
        Material(**{"young": 1.0, **parameters})
    assert str(caught.value) == sentence
