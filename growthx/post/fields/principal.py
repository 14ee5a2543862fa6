"""The smallest and the largest principal value of symmetric tensors in closed form, for as many as there are.

In the plane by Mohr's circle; in space by the angle 3φ of the deviator s, whose sine and cosine are both known with all
digits, also where two values meet: the sine by √(4 J₂³ − 27 J₃²) = √3 |s ∧ dev s²|, a sum of squares.  Errors are a few
units in the last digit of the tensor's largest entry.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.fem import kernels

if TYPE_CHECKING:
    from growthx.common.arrays import Floats

DECLARATIONS = "void outer_values(uintptr_t entries, int64_t step, int64_t count, uintptr_t found);"

# In C, several at once: NumPy would go through the memory a hundred times.
SOURCE = """
#include <math.h>
#include <stdint.h>

enum { AT_ONCE = 64 };  /* whose numbers stay near the CPU */

static inline double square(double x) { return x * x; }

/* |s|² |t|² − (s : t)² as a sum of squares, of a deviator s and t = dev s².
   Of the diagonals, which have no trace, one product tells all three: each of theirs is that one, up to its sign. */
static inline double parallelogram(double a, double b, double c, double d, double e, double f)
{
  const double p = a * a + d * d + e * e, q = b * b + d * d + f * f, r = c * c + e * e + f * f;
  const double mean = (p + q + r) / 3, P = p - mean, Q = q - mean, R = r - mean;
  const double u = d * (a + b) + e * f, v = e * (a + c) + d * f, w = f * (b + c) + d * e;
  const double first = square(a * u - d * P) + square(b * u - d * Q) + square(c * u - d * R);
  const double second = square(a * v - e * P) + square(b * v - e * Q) + square(c * v - e * R);
  const double third = square(a * w - f * P) + square(b * w - f * Q) + square(c * w - f * R);
  const double rest = square(d * v - e * u) + square(d * w - f * u) + square(e * w - f * v);
  return 3 * square(a * Q - b * P) + 2 * (first + second + third) + 4 * rest;
}

static inline double larger(double x, double y) { return x > y ? x : y; }

/* Of entries xx, xy, xz, yy, yz, zz, each in a row of its own. */
static void of_some(const double entries[6][AT_ONCE], double smallest[AT_ONCE], double largest[AT_ONCE])
{
  for (int i = 0; i < AT_ONCE; ++i)
  {
    const double xx = entries[0][i] - entries[5][i], yy = entries[3][i] - entries[5][i];  /* 0 of a mere pressure */
    const double mean = (xx + yy) / 3, middle = entries[5][i] + mean;
    double a = xx - mean, b = yy - mean, c = -mean;
    double d = entries[1][i], e = entries[2][i], f = entries[4][i];
    const double normal = larger(larger(fabs(a), fabs(b)), fabs(c)), shear = larger(larger(fabs(d), fabs(e)), fabs(f));
    const double size = larger(normal, shear), scale = size > 0 ? size : 1;
    a /= scale, b /= scale, c /= scale, d /= scale, e /= scale, f /= scale;
    const double second = (a * a + b * b + c * c) / 2 + d * d + e * e + f * f;
    const double third = a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e);
    const double sine = sqrt(3 * parallelogram(a, b, c, d, e, f)), cosine = 3 * sqrt(3.0) * third;
    const double angle = atan2(sine, cosine) / 3, radius = 2 * size * sqrt(second / 3);
    smallest[i] = middle + radius * cos(angle + 2 * M_PI / 3);
    largest[i] = middle + radius * cos(angle);
  }
}

static void outer_values(uintptr_t entries_, int64_t step, int64_t count, uintptr_t found_)
{
  const double *entries = (const double *)entries_;
  double *found = (double *)found_, some[6][AT_ONCE], smallest[AT_ONCE], largest[AT_ONCE];
  for (int64_t first = 0; first < count; first += AT_ONCE)
  {
    const int here = count - first < AT_ONCE ? count - first : AT_ONCE;
    for (int i = 0; i < AT_ONCE; ++i)
      for (int j = 0; j < 6; ++j)
        some[j][i] = i < here ? entries[(first + i) * step + j] : 0;
    of_some(some, smallest, largest);
    for (int i = 0; i < here; ++i)
    {
      found[2 * (first + i)] = smallest[i];
      found[2 * (first + i) + 1] = largest[i];
    }
  }
}
"""


def outer_values(entries: Floats) -> Floats:
    """The smallest and the largest principal value, (…, 2), of symmetric tensors, (…, 3 or 6).

    entries: on and above the diagonal, row by row.
    """
    rows = entries.reshape(-1, entries.shape[-1])
    of_all = _in_plane if entries.shape[-1] == 3 else _in_space
    return of_all(rows).reshape(*entries.shape[:-1], 2)


def _in_plane(rows: Floats) -> Floats:
    xx, xy, yy = rows.T
    middle, radius = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    return np.column_stack([middle - radius, middle + radius])


def _in_space(rows: Floats) -> Floats:
    rows = np.asarray(rows, dtype=np.float64)
    if rows.strides[1] != rows.itemsize or rows.strides[0] % rows.itemsize:
        rows = np.ascontiguousarray(rows)
    found = np.empty((len(rows), 2))
    _library().outer_values(rows.ctypes.data, rows.strides[0] // rows.itemsize, len(rows), found.ctypes.data)
    return found


@cache
def _library() -> Any:
    """Of each rank by itself: those without cells have nothing to ask for."""
    return kernels.library(MPI.COMM_SELF, SOURCE, DECLARATIONS, "principal values", libraries=kernels.MATHEMATICS)
