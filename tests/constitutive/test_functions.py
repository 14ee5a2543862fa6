"""Functions near zero against arithmetic of sixty digits: energies of bone are differences of numbers near one."""

from decimal import Decimal, localcontext

import numpy as np
import pytest
import ufl
from test_material import numbers

from growthx.constitutive.functions import ln1p, ln1p_excess
from growthx.constitutive.kinematics import principal_changes
from growthx.constitutive.material import Material

SIZES = [float(size) for size in 10.0 ** np.arange(-16, 0.7, 0.3)]
NEAR_ZERO = [sign * size for size in SIZES for sign in (1, -1) if sign * size > -1]
SWITCH = [-0.10001, -0.1, -0.0999, 0.0999, 0.1, 0.1001]  # where the series ends
FAR = [4.0, 24.0, 124.0, -0.9, -0.99]
STRAINS = [1e-8, 1e-6, 1e-5, 1e-4, 3e-4, 1e-3, 1e-2, 0.1, 0.5, 4.0]


def precise(function, *arguments):
    """A function of `Decimal`s at floats, with sixty digits."""
    with localcontext() as context:
        context.prec = 60
        return function(*map(Decimal, arguments))


def relative_error(found, exact):
    """Of a float against a `Decimal`."""
    return abs(float(Decimal(float(found)) / exact - 1))


@pytest.mark.parametrize("x", NEAR_ZERO + SWITCH + FAR)
def test_logarithms_keep_their_digits(x):
    """ln(1 + x) and x − ln(1 + x), as floats, arrays and UFL, which has no such logarithm to go on with."""
    logarithm = precise(lambda x: (1 + x).ln(), x)
    excess = precise(lambda x: x - (1 + x).ln(), x)
    symbolic = ufl.as_ufl(x)
    assert relative_error(ln1p(x), logarithm) < 5e-16
    assert relative_error(ln1p_excess(x), excess) < 4e-15
    assert ln1p_excess(np.array([x]))[0] == ln1p_excess(x)
    assert relative_error(numbers(ln1p(symbolic)), logarithm) < 4e-15
    assert relative_error(numbers(ln1p_excess(symbolic)), excess) < 4e-14


@pytest.mark.parametrize("x", [-0.3, -0.0999, -1e-3, -1e-9, 1e-12, 1e-4, 0.05, 0.7])
def test_derivatives_keep_their_digits(x):
    """Stress and tangent come from them: x/(1 + x) and 1/(1 + x)²."""
    at = ufl.variable(ufl.as_ufl(x))
    first = ufl.diff(ln1p_excess(at), at)
    second = ufl.diff(first, at)
    assert relative_error(numbers(first), precise(lambda x: x / (1 + x), x)) < 1e-14
    assert relative_error(numbers(second), precise(lambda x: 1 / (1 + x) ** 2, x)) < 1e-12


def test_below_minus_one_is_no_number():
    """det F ≤ 0 shows by it."""
    with np.errstate(invalid="ignore"):
        assert np.isnan(ln1p_excess(-1.5)) and np.isnan(ln1p(-1.5))


def exact_energy(H, lam, mu):
    """½ λ ln²J + ½ μ [I₁ − 3 − 2 ln J] of a matrix of `Decimal`s, as the paper writes it."""
    dim = len(H)
    F = [[H[i][j] + (1 if i == j else 0) for j in range(dim)] for i in range(dim)]
    I1 = sum(entry * entry for row in F for entry in row) + (3 - dim)
    J = determinant(F)
    return lam / 2 * J.ln() ** 2 + mu / 2 * (I1 - 3 - 2 * J.ln())


def determinant(F):
    """By the first row."""
    if len(F) == 1:
        return F[0][0]
    minors = [[[*row[:j], *row[j + 1 :]] for row in F[1:]] for j in range(len(F))]
    return sum((-1) ** j * F[0][j] * determinant(minors[j]) for j in range(len(F)))


def exact(H, material):
    """Energy, and stress by central differences of forty digits, of the material at H, as arrays of `Decimal`."""
    lam, mu = (Decimal(float(value)) for value in material.lame)
    with localcontext() as context:
        context.prec = 90
        matrix = [[Decimal(float(entry)) for entry in row] for row in H]
        energy, step = exact_energy(matrix, lam, mu), Decimal(10) ** -30
        stress = np.empty(H.shape, dtype=object)
        for index in np.ndindex(H.shape):
            sides = []
            for sign in (1, -1):
                moved = [list(row) for row in matrix]
                moved[index[0]][index[1]] += sign * step
                sides.append(exact_energy(moved, lam, mu))
            stress[index] = (sides[0] - sides[1]) / (2 * step)
    return energy, stress


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
@pytest.mark.parametrize("strain", STRAINS)
@pytest.mark.parametrize("dim", [2, 3])
def test_energy_and_stress_keep_their_digits(dim, strain, poisson):
    """From strains of 1e-8 to stretches of 5: of I₁ − 3 − 2 ln J formed from F none would be left at the first."""
    material = Material(17000.0, poisson)
    H = strain * np.random.default_rng(dim).uniform(0.2, 1.0, (dim, dim)) * np.where(np.eye(dim), 1.0, 0.3)
    energy, stress = exact(H, material)
    symbolic = ufl.as_matrix(H.tolist())
    assert relative_error(numbers(material.energy_at(symbolic)), energy) < 1e-13
    found = numbers(material.stress(symbolic, 1.0))
    largest = max(abs(entry) for entry in stress.flat)
    apart = max(abs(Decimal(float(a)) - b) for a, b in zip(found.flat, stress.flat, strict=True))
    assert apart / largest < Decimal("1e-13")


@pytest.mark.parametrize("dim", [2, 3])
def test_small_strains_of_a_turned_body_keep_their_digits(dim):
    """A bone that bends turns far more than it strains: 0.1 against 1e-4."""
    from scipy.linalg import expm

    random = np.random.default_rng(dim)
    spin = random.uniform(-0.1, 0.1, (dim, dim))
    stretch = np.eye(dim) + 1e-4 * random.uniform(-1, 1, (dim, dim))
    H = expm(spin - spin.T) @ (stretch + stretch.T) / 2 - np.eye(dim)
    material = Material(17000.0, 0.3)
    energy, _ = exact(H, material)
    assert relative_error(numbers(material.energy_at(ufl.as_matrix(H.tolist()))), energy) < 1e-9


@pytest.mark.parametrize("strain", STRAINS)
def test_principal_states_keep_their_digits(strain):
    """Homogeneous states are found with them."""
    material = Material(17000.0, 0.3)
    extensions = (strain, -0.25 * strain / (1 + strain), 0.1 * strain)
    energy, stress = exact(np.diag(extensions), material)
    assert relative_error(material.elastic_energy(*principal_changes(extensions)), energy) < 1e-13
    for found, wanted in zip(material.principal_stresses(extensions, 1.0), stress.diagonal(), strict=True):
        assert abs(float(Decimal(found) - wanted)) < 1e-13 * float(stress[0, 0])
