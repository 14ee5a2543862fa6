"""Tensors of arrays of entries: what is read off a stress or a strain, for as many points at once as there are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from growthx.common.arrays import Floats


def symmetric(entries: Floats) -> Floats:
    """Symmetric tensors, (…, dim, dim), of the entries on and above the diagonal, row by row, (…, 3 or 6)."""
    dim = {3: 2, 6: 3}[entries.shape[-1]]
    found = np.empty((*entries.shape[:-1], dim, dim))
    above = np.triu_indices(dim)
    found[..., above[0], above[1]] = found[..., above[1], above[0]] = entries
    return found


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
