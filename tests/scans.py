"""Scans that tests make: HU of a parametric body, and such as are linear in space, on grids in any frame."""

import numpy as np

import growthx as gx

A, B = 0.05, 0.0008  # ρ = A + B HU
SOFT, MARROW, CORTEX, SPONGY = 40.0, 60.0, 1900.0, 700.0  # HU


def centres(affine, shape):
    """Places of the centres of voxels, (i, j, k, 3)."""
    indices = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    return indices @ affine[:3, :3].T + affine[:3, 3]


def skewed():
    """An affine with axes in another order, one of them flipped, turned by 20° and of three spacings, and a shape.

    It covers [0, 1]³.
    """
    turn = np.radians(20)
    about = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    axes = about @ np.array([[0, 0.19, 0], [0, 0, -0.23], [0.31, 0, 0]])
    shape = (6, 13, 11)
    affine = np.eye(4)
    affine[:3, :3] = axes
    affine[:3, 3] = 0.5 - axes @ (np.array(shape) - 1) / 2
    return affine, shape


def linear(gradient=(100.0, -50.0, 200.0), offset=800.0, orientation="RAS"):
    """A scan of HU = offset + gradient · x on skewed voxels, and the function."""
    affine, shape = skewed()
    values = offset + centres(affine, shape) @ np.array(gradient)
    return gx.ct.from_array(values, affine, orientation), lambda x: offset + np.tensordot(gradient, x, axes=1)


def proximal_femur(spacing=2.0):
    """HU of a spongy head on a neck on a shaft with a cortex and a canal, in soft tissue; values and affine, in mm.

    The head, of radius 22, is at the origin, the shaft, of radii 13 and 7, at x = 40 from z = −120 to −20.
    """
    low, high = np.array([-26.0, -26.0, -120.0]), np.array([58.0, 26.0, 28.0])
    affine = np.diag([spacing] * 3 + [1.0])
    affine[:3, 3] = low
    x = centres(affine, np.round((high - low) / spacing).astype(int) + 1)
    from_axis = np.hypot(x[..., 0] - 40.0, x[..., 1])
    shaft = (from_axis < 13.0) & (x[..., 2] < -20.0)
    along = np.clip((x[..., 0] * 40 - x[..., 2] * 42) / (40**2 + 42**2), 0, 1)
    from_neck = np.linalg.norm(x - along[..., np.newaxis] * np.array([40.0, 0.0, -42.0]), axis=-1)
    values = np.full(x.shape[:3], SOFT)
    values[(from_neck < 12.0) | (np.linalg.norm(x, axis=-1) < 22.0)] = SPONGY
    values[shaft] = CORTEX
    values[shaft & (from_axis < 7.0)] = MARROW
    return values.astype(np.int16), affine
