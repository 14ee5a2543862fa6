"""A Cholesky factor in single precision, by CHOLMOD, of a matrix in double precision.

Newton's method that keeps its factor only steers by it: residuals, states and what ends the iteration stay in double
precision.  Such a factor is half as large, and made and applied in about half of the time.  PETSc's interface does not
know of it (SuiteSparse has it since 7.4), hence a few lines of C.  The matrix is scaled to a unit diagonal first, which
keeps its entries within what single precision can say whatever the units.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.communicators import steady
from growthx.common.errors import InputError
from growthx.fem import kernels

if TYPE_CHECKING:
    from petsc4py import PETSc

    from growthx.common.arrays import Floats, Indices

SMALLEST = 4_000  # unknowns from which on it is worth its setting up
POOR = 0.3  # ‖b − A x‖ over ‖b‖ of a solution that steers no more: less, and every step does most of its work
SPACE, BYTES_IN_SPACE = 3, 140.0  # of a factor in space, over the 4/3-th power of the number of unknowns
ENOUGH, MOST_ITERATIONS = 1e-6, 50  # of the conjugate gradients that stand in for a factor that is poor

DECLARATIONS = """
uintptr_t make(int n, uintptr_t starts, uintptr_t columns);
int factorise(uintptr_t factor, uintptr_t values);
int solve(uintptr_t factor, uintptr_t b, uintptr_t x);
double work(uintptr_t factor);
void destroy(uintptr_t factor);
"""

SOURCE = r"""
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <cholmod.h>

typedef struct {
    cholmod_common common;
    cholmod_sparse matrix;               /* its upper triangle, by columns */
    cholmod_factor *factor;
    cholmod_dense *b, *x, *y, *e;
    int n, *starts, *rows, *taken, *diagonal;  /* taken: place of each entry among those of the whole matrix */
    float *values;
    double *scale;
} single;

static void destroy(uintptr_t address)
{
    single *s = (single *)address;
    if (!s) return;
    cholmod_free_factor(&s->factor, &s->common);
    cholmod_free_dense(&s->b, &s->common);
    cholmod_free_dense(&s->x, &s->common);
    cholmod_free_dense(&s->y, &s->common);
    cholmod_free_dense(&s->e, &s->common);
    cholmod_finish(&s->common);
    free(s->starts); free(s->rows); free(s->taken); free(s->diagonal); free(s->values); free(s->scale);
    free(s);
}

/* starts, columns: of the rows of a symmetric matrix, which are its columns as well; zero where memory is short. */
static uintptr_t make(int n, uintptr_t starts_, uintptr_t columns_)
{
    const int *starts = (const int *)starts_, *columns = (const int *)columns_;
    single *s = calloc(1, sizeof(single));
    if (!s) return 0;
    cholmod_start(&s->common);
    s->common.print = 0;
    s->common.nmethods = 1;
    s->common.method[0].ordering = CHOLMOD_NESDIS;
    s->common.supernodal = CHOLMOD_SUPERNODAL;
    s->common.final_ll = 1;
    s->common.quick_return_if_not_posdef = 1;
    s->n = n;
    s->starts = malloc((n + 1) * sizeof(int));
    s->rows = malloc(starts[n] * sizeof(int));
    s->taken = malloc(starts[n] * sizeof(int));
    s->diagonal = malloc(n * sizeof(int));
    s->values = malloc(starts[n] * sizeof(float));
    s->scale = malloc(n * sizeof(double));
    if (!s->starts || !s->rows || !s->taken || !s->diagonal || !s->values || !s->scale) {
        destroy((uintptr_t)s);
        return 0;
    }
    int count = 0;
    for (int j = 0; j < n; ++j) {
        s->starts[j] = count;
        s->diagonal[j] = -1;
        for (int k = starts[j]; k < starts[j + 1]; ++k) {
            if (columns[k] > j) continue;
            if (columns[k] == j) s->diagonal[j] = k;
            s->rows[count] = columns[k];
            s->taken[count++] = k;
        }
    }
    s->starts[n] = count;
    s->matrix = (cholmod_sparse){.nrow = n, .ncol = n, .nzmax = count, .p = s->starts, .i = s->rows, .x = s->values,
        .stype = 1, .itype = CHOLMOD_INT, .xtype = CHOLMOD_REAL, .dtype = CHOLMOD_SINGLE, .sorted = 1, .packed = 1};
    for (int k = 0; k < count; ++k) s->values[k] = 0.0f;
    s->factor = cholmod_analyze(&s->matrix, &s->common);
    s->b = cholmod_zeros(n, 1, CHOLMOD_REAL + CHOLMOD_SINGLE, &s->common);
    if (!s->factor || !s->b) { destroy((uintptr_t)s); return 0; }
    return (uintptr_t)s;
}

/* Operations of a factorisation for each entry of the factor. */
static double work(uintptr_t address)
{
    const single *s = (const single *)address;
    return s && s->common.lnz > 0.0 ? s->common.fl / s->common.lnz : 0.0;
}

/* values: of all entries.  Whether there is a factor: not of a matrix that is not positive definite. */
static int factorise(uintptr_t address, uintptr_t values_)
{
    single *s = (single *)address;
    const double *values = (const double *)values_;
    for (int j = 0; j < s->n; ++j) {
        if (s->diagonal[j] < 0 || !(values[s->diagonal[j]] > 0.0)) return 0;
        s->scale[j] = 1.0 / sqrt(values[s->diagonal[j]]);
    }
    for (int j = 0; j < s->n; ++j)
        for (int k = s->starts[j]; k < s->starts[j + 1]; ++k)
            s->values[k] = (float)(values[s->taken[k]] * s->scale[j] * s->scale[s->rows[k]]);
    cholmod_factorize(&s->matrix, s->factor, &s->common);
    return s->common.status == CHOLMOD_OK && s->factor->minor == (size_t)s->n;
}

static int solve(uintptr_t address, uintptr_t b_, uintptr_t x_)
{
    single *s = (single *)address;
    const double *b = (const double *)b_;
    double *x = (double *)x_, size = 0.0;
    float *scaled = s->b->x;
    for (int j = 0; j < s->n; ++j) size = fmax(size, fabs(b[j] * s->scale[j]));
    if (!(size > 0.0) || isinf(size)) size = 1.0;
    for (int j = 0; j < s->n; ++j) scaled[j] = (float)(b[j] * s->scale[j] / size);
    if (!cholmod_solve2(CHOLMOD_A, s->factor, s->b, NULL, &s->x, NULL, &s->y, &s->e, &s->common)) return 0;
    const float *found = s->x->x;
    for (int j = 0; j < s->n; ++j) x[j] = found[j] * s->scale[j] * size;
    return 1;
}
"""


class SingleFactor:
    """The context of a PETSc PC of type "python": solves with a factor in single precision.

    On several ranks each has the whole matrix and makes the same factor of it: nobody waits for the others within a
    factorisation or a solution, which for systems that are not large costs more than the work that is shared.
    is_poor: whether the last matrix had none, or one that does not solve well; a factor in double precision then would.
    """

    name = "Cholesky (CHOLMOD, single precision)"

    def __init__(self, library: Any) -> None:
        """library: see `load`."""
        self._library, self._factor, self._fresh, self.is_poor = library, 0, False, False
        self._own, self._comm = slice(0), MPI.COMM_SELF
        self._rows: Indices = np.zeros(1, dtype=int)  # of each rank
        self._entries: Indices = np.zeros(1, dtype=int)

    def setUp(self, pc: PETSc.PC) -> None:
        """Factorise the matrix as it is now; PETSc calls this."""
        matrix = pc.getOperators()[0]
        starts, columns, values = matrix.getValuesCSR()
        if not self._factor:
            self._comm = steady(pc.comm.tompi4py())
            self._own = slice(*matrix.getOwnershipRange())
            self._rows, self._entries = (
                np.array(self._comm.allgather(each)) for each in (len(starts) - 1, len(columns))
            )
            lengths = self._gathered(np.diff(starts), self._rows)
            starts, columns = np.concatenate([[0], np.cumsum(lengths)]), self._gathered(columns, self._entries)
            starts = starts.astype(np.int32)
            self._factor = self._library.make(len(starts) - 1, starts.ctypes.data, columns.ctypes.data)
        values = self._gathered(values, self._entries)
        made = self._factor and self._library.factorise(self._factor, values.ctypes.data)
        self._fresh, self.is_poor = True, not self._comm.allreduce(bool(made), MPI.LAND)

    def apply(self, pc: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """X ≈ A⁻¹ b; PETSc calls this."""
        whole = self._gathered(b.array_r, self._rows)
        found = self._solve(whole)
        if self._fresh:
            self._fresh = False
            found = self._looked_at(pc.getOperators()[0], whole, found)
        x.array_w[:] = found[self._own]

    def _gathered(self, values: Any, counts: Any) -> Any:
        """What all ranks have, one after the other."""
        values = np.ascontiguousarray(values)
        if self._comm.size == 1:
            return values
        whole = np.empty(counts.sum(), dtype=values.dtype)
        self._comm.Allgatherv(values, (whole, counts))
        return whole

    def _solve(self, b: Floats) -> Floats:
        x = np.full(len(b), np.nan)
        if self._factor:
            self._library.solve(self._factor, b.ctypes.data, x.ctypes.data)
        return x

    def _looked_at(self, matrix: PETSc.Mat, b: Floats, x: Floats) -> Floats:
        """The first solution of a new factor; if it is none, conjugate gradients make one of it."""

        def times(vector: Floats) -> Floats:
            ours, product = matrix.createVecs()
            ours.array_w[:] = vector[self._own]
            matrix.mult(ours, product)
            whole = self._gathered(product.array_r, self._rows)
            ours.destroy()
            product.destroy()
            return np.array(whole)

        rest, size = b - times(x), float(np.linalg.norm(b))
        self.is_poor = not np.linalg.norm(rest) <= POOR * size
        direction: Floats = np.zeros(len(rest))
        slope = 1.0
        for _ in range(MOST_ITERATIONS if self.is_poor else 0):
            improved = self._solve(rest)
            former, slope = slope, float(rest @ improved)
            direction = improved + (slope / former) * direction
            product = times(direction)
            share = slope / float(direction @ product)
            x, rest = x + share * direction, rest - share * product
            if not np.linalg.norm(rest) > ENOUGH * size:
                break
        return x

    @property
    def work(self) -> float:
        """Operations of a factorisation for each entry of the factor; zero before the first one."""
        return float(self._library.work(self._factor))

    def destroy(self, pc: PETSc.PC) -> None:
        """Free the memory; PETSc calls this."""
        self._library.destroy(self._factor)
        self._factor = 0


def fits_into_memory(size: int, dim: int, ranks: int) -> bool:
    """Whether half of the memory that is free now holds a factor for each rank: in space it grows faster than the body.

    The same on all ranks of a machine, which ask at the same time.
    """
    try:
        free = os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (ValueError, OSError):  # not told here
        return True
    return dim < SPACE or BYTES_IN_SPACE * size ** (4 / 3) * ranks < free / 2


def load(comm: Any) -> Any:
    """The library, compiled on first use; None where CHOLMOD, or its header, is not there (collective)."""
    try:
        return kernels.library(comm, SOURCE, DECLARATIONS, "cholmod", libraries=("cholmod",))
    except InputError:
        return None
