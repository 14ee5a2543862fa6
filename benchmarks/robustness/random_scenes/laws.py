"""What happens at a point, in NumPy from the paper's formulas: neo-Hookean energy and stress, mass sources.

All arrays begin with the same axes, those of cells and points; H = ∇u has two more, (…, dim, dim).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from growthx.common.arrays import Floats

NEAR = 1e-2  # |J − 1| below which J − 1 − ln J is summed as a series


def invariants(H: Floats) -> tuple[Floats, Floats, Floats]:
    """The three: tr H, c₂ = ½ (tr²H − tr H²) and c₃ = det H; in the plane c₂ is det H and c₃ zero."""
    trace = np.trace(H, axis1=-2, axis2=-1)
    if H.shape[-1] == 2:
        return trace, H[..., 0, 0] * H[..., 1, 1] - H[..., 0, 1] * H[..., 1, 0], np.zeros_like(trace)
    second = sum(H[..., i, i] * H[..., j, j] - H[..., i, j] * H[..., j, i] for i, j in ((0, 1), (1, 2), (0, 2)))
    return trace, np.asarray(second), np.linalg.det(H)


def volume_change(H: Floats) -> Floats:
    """J − 1."""
    trace, second, third = invariants(H)
    return trace + second + third


def excess(x: Floats) -> Floats:
    """X − ln(1 + x), by its series near zero."""
    with np.errstate(all="ignore"):
        series = sum((-1) ** k * x**k / k for k in range(12, 1, -1))
        return np.where(np.abs(x) < NEAR, series, x - np.log1p(x))


def energy(H: Floats, young: Floats, poisson: Floats) -> Floats:
    """Ψ₀ⁿᵉᵒ = ½ λ ln²J + ½ μ [I₁ − 3 − 2 ln J]."""
    lam, mu = lame(young, poisson)
    trace, second, third = invariants(H)
    x = trace + second + third
    if H.shape[-1] == 2:
        rest = (H[..., 0, 0] - H[..., 1, 1]) ** 2 + (H[..., 0, 1] + H[..., 1, 0]) ** 2
    else:
        symmetric = (H + np.swapaxes(H, -1, -2)) / 2
        rest = 2 * np.einsum("...ij,...ij->...", symmetric, symmetric) - trace**2 - 2 * third
    with np.errstate(all="ignore"):
        return lam / 2 * np.log1p(x) ** 2 + mu / 2 * (rest + 2 * excess(x))


def stress(H: Floats, young: Floats, poisson: Floats) -> Floats:
    """μ F + [λ ln J − μ] F⁻ᵀ, (…, dim, dim): F − F⁻ᵀ = [J F − cof F]/J without the difference of the two."""
    lam, mu = (each[..., None, None] for each in lame(young, poisson))
    trace, second, third = (each[..., None, None] for each in invariants(H))
    unit, transposed = np.eye(H.shape[-1]), np.swapaxes(H, -1, -2)
    x = trace + second + third
    cofactor = (1 + trace) * unit - transposed
    change = (second + third) * unit + (1 + x) * H + transposed
    if H.shape[-1] == 3:
        of_H = cofactors(H)
        cofactor, change = cofactor + of_H, change - of_H
    with np.errstate(all="ignore"):
        return (mu * change + lam * np.log1p(x) * cofactor) / (1 + x)


def cofactors(H: Floats) -> Floats:
    """Of matrices of three rows."""
    rows = [np.cross(H[..., (i + 1) % 3, :], H[..., (i + 2) % 3, :]) for i in range(3)]
    return np.stack(rows, axis=-2)


def lame(young: Floats, poisson: Floats) -> tuple[Floats, Floats]:
    """Lamé's parameters λ, μ."""
    return young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))


@dataclass(frozen=True)
class Source:
    """R₀ = c { [ρ/ρ*]^k D(Ψ) − S* }, which a dead zone flattens.

    kind: "energy", "specific", "strain" or "stress".  exponent: m; dead_zone: half-width w.
    """

    kind: str
    exponent: float
    dead_zone: float

    def power(self, n: Floats) -> Floats:
        """The exponent k of the relative density."""
        return {"energy": n - self.exponent, "stress": n - self.exponent, "specific": n - 1}.get(
            self.kind, 0 * n - self.exponent
        )

    def drive(self, psi: Floats, young: Floats, reference: Floats) -> Floats:
        """D, which roots of the energy have rounded at strains of 1e-10."""
        if self.kind == "energy":
            return psi
        if self.kind == "specific":
            return psi / reference
        square = 2 * psi / young
        strain = square / np.sqrt(square + 1e-20)
        return strain if self.kind == "strain" else young * strain

    def stimulus(self, density: Floats, psi: Floats, young: Floats, reference: Floats, n: Floats) -> Floats:
        """S = [ρ/ρ*]^k D(Ψ)."""
        with np.errstate(all="ignore"):
            return (density / reference) ** self.power(n) * self.drive(psi, young, reference)

    def response(self, difference: Floats) -> Floats:
        """What of S − S* lies outside of the dead zone, its edges rounded over a tenth of its half-width."""
        if self.dead_zone == 0:
            return difference
        w, soft = self.dead_zone, (0.1 * self.dead_zone) ** 2
        up, down = np.sqrt((difference - w) ** 2 + soft), np.sqrt((difference + w) ** 2 + soft)
        return difference + (up - down) / 2
