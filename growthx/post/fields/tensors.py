"""Tensors of arrays of entries: what is read off a stress or a strain, for as many points at once as there are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from growthx.common.arrays import Floats

AT_ONCE = 4096  # tensors whose numbers stay in the processor's cache


def symmetric(entries: Floats) -> Floats:
    """Symmetric tensors, (…, dim, dim), of the entries on and above the diagonal, row by row, (…, 3 or 6)."""
    dim = {3: 2, 6: 3}[entries.shape[-1]]
    found = np.empty((*entries.shape[:-1], dim, dim))
    above = np.triu_indices(dim)
    found[..., above[0], above[1]] = found[..., above[1], above[0]] = entries
    return found


def outer_values(entries: Floats) -> Floats:
    """The smallest and the largest principal value, (…, 2), of symmetric tensors by the entries of `symmetric`.

    In closed form: in the plane by Mohr's circle; in space by the angle 3φ of the deviator s, whose sine and cosine are
    both known with all digits, also where two values meet: the sine by √(4 J₂³ − 27 J₃²) = √3 |s ∧ dev s²|, a sum of
    squares.  Errors are a few units in the last digit of the tensor's largest entry.
    """
    of_each = _outer_in_plane if entries.shape[-1] == 3 else _outer_in_space
    rows = entries.reshape(-1, entries.shape[-1])
    found = np.empty((len(rows), 2))
    for start in range(0, len(rows), AT_ONCE):
        part = slice(start, start + AT_ONCE)
        found[part, 0], found[part, 1] = of_each(np.ascontiguousarray(rows[part].T))
    return found.reshape(*entries.shape[:-1], 2)


def _outer_in_plane(entries: Floats) -> tuple[Floats, Floats]:
    """Of entries by rows, (3, tensors)."""
    xx, xy, yy = entries
    middle, radius = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    return middle - radius, middle + radius


def _outer_in_space(entries: Floats) -> tuple[Floats, Floats]:
    """Of entries by rows, (6, tensors)."""
    xx, xy, xz, yy, yz, zz = entries
    middle = (xx + yy + zz) / 3
    parts = np.stack([xx - middle, yy - middle, zz - middle, xy, xz, yz])
    size = np.abs(parts).max(axis=0)
    a, b, c, d, e, f = parts / np.where(size > 0, size, 1.0)
    second = (a * a + b * b + c * c) / 2 + d * d + e * e + f * f
    third = a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e)
    cosine, sine = 3 * np.sqrt(3) * third, np.sqrt(3 * _parallelogram(a, b, c, d, e, f))
    angle, radius = np.arctan2(sine, cosine) / 3, 2 * size * np.sqrt(second / 3)
    return middle + radius * np.cos(angle + 2 * np.pi / 3), middle + radius * np.cos(angle)


def _parallelogram(a: Floats, b: Floats, c: Floats, d: Floats, e: Floats, f: Floats) -> Floats:
    """|s|² |t|² − (s : t)² as a sum of squares, of a deviator s, by its entries xx, yy, zz, xy, xz, yz, and t = dev s².

    Of the diagonals, which have no trace, one product tells all three: each of theirs is that one, up to its sign.
    """
    p, q, r = a * a + d * d + e * e, b * b + d * d + f * f, c * c + e * e + f * f
    mean = (p + q + r) / 3
    p, q, r = p - mean, q - mean, r - mean
    u, v, w = d * (a + b) + e * f, e * (a + c) + d * f, f * (b + c) + d * e
    found = 3 * (a * q - b * p) ** 2
    for one, other in ((d, u), (e, v), (f, w)):
        found += 2 * ((a * other - one * p) ** 2 + (b * other - one * q) ** 2 + (c * other - one * r) ** 2)
    return found + 4 * ((d * v - e * u) ** 2 + (d * w - f * u) ** 2 + (e * w - f * v) ** 2)


def principal_values(entries: Floats) -> Floats:
    """The principal values from the highest to the lowest, (…, dim)."""
    return np.asarray(np.linalg.eigvalsh(symmetric(entries))[..., ::-1])


def directions(entries: Floats) -> Floats:
    """The directions of the principal values, from that of the highest, as columns of length one, (…, dim, dim).

    Of the two ways along each, that whose largest component is positive.
    """
    axes = np.linalg.eigh(symmetric(entries))[1][..., ::-1]
    largest = np.take_along_axis(axes, np.abs(axes).argmax(axis=-2)[..., np.newaxis, :], axis=-2)
    return np.asarray(axes * np.where(largest < 0, -1.0, 1.0)) + 0.0  # no zero is negative


def component(number: int, values: Floats) -> Floats:
    """One of several numbers, or of several columns."""
    return np.asarray(values[..., number])


def von_mises(entries: Floats) -> Floats:
    """√(3/2 s : s), with the deviator s, of tensors in space by their six entries."""
    tensor = symmetric(entries)
    deviator = tensor - np.trace(tensor, axis1=-2, axis2=-1)[..., np.newaxis, np.newaxis] / 3 * np.eye(3)
    return np.asarray(np.sqrt(1.5 * np.sum(deviator**2, axis=(-2, -1))))


def logarithmic(entries: Floats) -> Floats:
    """½ ln C of Green–Lagrange strains ½ [C − I], (…, dim, dim), with the digits of small ones."""
    values, axes = np.linalg.eigh(symmetric(entries))
    return np.asarray((axes * (np.log1p(2 * values) / 2)[..., np.newaxis, :]) @ np.swapaxes(axes, -2, -1))


def principal_logarithmic(entries: Floats) -> Floats:
    """Their principal values from the highest to the lowest, (…, dim)."""
    return np.asarray(np.log1p(2 * principal_values(entries)) / 2)


def square(entries: Floats) -> Floats:
    """Tensors in space, (…, 3, 3), of all of their entries, row by row."""
    return entries.reshape(*entries.shape[:-1], 3, 3)


def in_space(vectors: Floats) -> Floats:
    """Vectors of a plane, (…, 2), with a third component of zero; those in space as they are."""
    return np.pad(vectors, [(0, 0)] * (vectors.ndim - 1) + [(0, 3 - vectors.shape[-1])])
