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
    from collections.abc import Callable

    from petsc4py import PETSc

    from growthx.common.arrays import Floats, Indices, Marks

SMALLEST = 4_000  # unknowns from which on it is worth its setting up
POOR = 0.3  # ‖b − A x‖ over ‖b‖ of a solution that steers no more: less, and every step does most of its work
SPACE, BYTES_IN_SPACE = 3, 140.0  # of a factor in space, over the 4/3-th power of the number of unknowns
ENOUGH, MOST_ITERATIONS = 1e-6, 50  # of the conjugate gradients that stand in for a factor that is poor

DECLARATIONS = """
uintptr_t make(int n, uintptr_t starts, uintptr_t columns, int dim);
uintptr_t make_of_blocks(int nodes, int block, uintptr_t starts, uintptr_t columns, uintptr_t held, int dim);
int factorise(uintptr_t factor, uintptr_t values);
int solve(uintptr_t factor, uintptr_t b, uintptr_t x);
void multiply(uintptr_t factor, uintptr_t values, uintptr_t x, uintptr_t y);
double work(uintptr_t factor);
void destroy(uintptr_t factor);
"""

SOURCE = r"""
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cholmod.h>
#ifdef __SSE2__
#include <xmmintrin.h>
#endif

/* A factor's entries may fade with the distance of nodes, those of a mass matrix by half from one to the next, until
   single precision says them in fewer digits, which takes the processor a hundred times as long: such ones are zero
   while a factor is made and applied.  What was the rule before is returned. */
static unsigned take_the_least_for_zero(void)
{
#ifdef __SSE2__
    const unsigned rule = _mm_getcsr();
    _mm_setcsr(rule | 0x8040); /* results, and what is read */
    return rule;
#else
    return 0;
#endif
}

static void take_as_before(unsigned rule)
{
#ifdef __SSE2__
    _mm_setcsr(rule);
#else
    (void)rule;
#endif
}

typedef struct {
    cholmod_common common;
    cholmod_sparse matrix;               /* its upper triangle, by columns */
    cholmod_factor *factor;
    int n, *starts, *rows, *taken;  /* taken: place of each entry among the values that are given; -1 of a one */
    float *values, *x;              /* x: room for a solution and for the rows of one supernode */
    double *scale;
} single;

static void destroy(uintptr_t address)
{
    single *s = (single *)address;
    if (!s) return;
    cholmod_free_factor(&s->factor, &s->common);
    cholmod_finish(&s->common);
    free(s->starts); free(s->rows); free(s->taken); free(s->values); free(s->scale); free(s->x);
    free(s);
}

static single *begin(int n, int entries, int dim)
{
    single *s = calloc(1, sizeof(single));
    if (!s) return NULL;
    cholmod_start(&s->common);
    s->common.print = 0;
    s->common.nmethods = 1;
    /* In the plane as few entries either way, for a fifth of the time; in space one and a half times as many. */
    s->common.method[0].ordering = dim < 3 ? CHOLMOD_AMD : CHOLMOD_NESDIS;
    s->common.supernodal = CHOLMOD_SUPERNODAL;
    /* Larger supernodes than CHOLMOD's own, for a few more zeros: a sixth of a factor's time off (docs/speed.md). */
    for (int k = 0; k < 3; ++k) {
        s->common.nrelax[k] = (size_t[]){8, 24, 64}[k];
        s->common.zrelax[k] = (double[]){0.8, 0.15, 0.05}[k];
    }
    s->common.final_ll = 1;
    s->common.quick_return_if_not_posdef = 1;
    s->n = n;
    s->starts = malloc((n + 1) * sizeof(int));
    s->rows = malloc(entries * sizeof(int));
    s->taken = malloc(entries * sizeof(int));
    s->values = malloc(entries * sizeof(float));
    s->scale = malloc(n * sizeof(double));
    if (s->starts && s->rows && s->taken && s->values && s->scale) return s;
    destroy((uintptr_t)s);
    return NULL;
}

static uintptr_t analysed(single *s, int count)
{
    const int n = s->n;
    s->starts[n] = count;
    s->matrix = (cholmod_sparse){.nrow = n, .ncol = n, .nzmax = count, .p = s->starts, .i = s->rows, .x = s->values,
        .stype = 1, .itype = CHOLMOD_INT, .xtype = CHOLMOD_REAL, .dtype = CHOLMOD_SINGLE, .sorted = 1, .packed = 1};
    for (int k = 0; k < count; ++k) s->values[k] = 0.0f;
    s->factor = cholmod_analyze(&s->matrix, &s->common);
    s->x = malloc(2 * (size_t)n * sizeof(float));
    if (s->factor && s->factor->is_super && s->x) return (uintptr_t)s;
    destroy((uintptr_t)s);
    return 0;
}

/* starts, columns: of the rows of a symmetric matrix, which are its columns as well; zero where memory is short. */
static uintptr_t make(int n, uintptr_t starts_, uintptr_t columns_, int dim)
{
    const int *starts = (const int *)starts_, *columns = (const int *)columns_;
    single *s = begin(n, starts[n], dim);
    if (!s) return 0;
    int count = 0;
    for (int j = 0; j < n; ++j) {
        s->starts[j] = count;
        for (int k = starts[j]; k < starts[j + 1]; ++k) {
            if (columns[k] > j) continue;
            s->rows[count] = columns[k];
            s->taken[count++] = k;
        }
    }
    return analysed(s, count);
}

/* starts, columns: of the rows of blocks in the lower half, rising.  held: whether a row is one of the unit matrix. */
static uintptr_t make_of_blocks(int nodes, int block, uintptr_t starts_, uintptr_t columns_, uintptr_t held_, int dim)
{
    const int *starts = (const int *)starts_, *columns = (const int *)columns_;
    const char *held = (const char *)held_;
    single *s = begin(nodes * block, starts[nodes] * block * block, dim);
    if (!s) return 0;
    int count = 0;
    for (int node = 0; node < nodes; ++node)
        for (int i = 0; i < block; ++i) {
            const int row = node * block + i;
            s->starts[row] = count;
            if (held[row]) {
                s->rows[count] = row;
                s->taken[count++] = -1;
                continue;
            }
            for (int k = starts[node]; k < starts[node + 1]; ++k)
                for (int j = 0; j < block; ++j) {
                    const int column = columns[k] * block + j;
                    if (column > row || held[column]) continue;
                    s->rows[count] = column;
                    s->taken[count++] = (k * block + i) * block + j;
                }
        }
    return analysed(s, count);
}

static double entry(const single *s, const double *values, int k)
{
    return s->taken[k] < 0 ? 1.0 : values[s->taken[k]];
}

/* Operations of a factorisation for each entry of the factor. */
static double work(uintptr_t address)
{
    const single *s = (const single *)address;
    return s && s->common.lnz > 0.0 ? s->common.fl / s->common.lnz : 0.0;
}

/* values: of all entries or blocks.  Whether there is a factor: not of a matrix that is not positive definite. */
static int factorise(uintptr_t address, uintptr_t values_)
{
    single *s = (single *)address;
    const double *values = (const double *)values_;
    for (int j = 0; j < s->n; ++j) {
        const int last = s->starts[j + 1] - 1; /* on the diagonal, if that has an entry */
        if (last < s->starts[j] || s->rows[last] != j || !(entry(s, values, last) > 0.0)) return 0;
        s->scale[j] = 1.0 / sqrt(entry(s, values, last));
    }
    for (int j = 0; j < s->n; ++j)
        for (int k = s->starts[j]; k < s->starts[j + 1]; ++k)
            s->values[k] = (float)(entry(s, values, k) * s->scale[j] * s->scale[s->rows[k]]);
    const unsigned rule = take_the_least_for_zero();
    cholmod_factorize(&s->matrix, s->factor, &s->common);
    take_as_before(rule);
    return s->common.status == CHOLMOD_OK && s->factor->minor == (size_t)s->n;
}

/* y = A x with the matrix of some values, in double precision. */
static void multiply(uintptr_t address, uintptr_t values_, uintptr_t x_, uintptr_t y_)
{
    const single *s = (const single *)address;
    const double *values = (const double *)values_, *x = (const double *)x_;
    double *y = (double *)y_;
    for (int j = 0; j < s->n; ++j) {
        double sum = 0.0;
        for (int k = s->starts[j]; k < s->starts[j + 1]; ++k) {
            const double value = entry(s, values, k);
            sum += value * x[s->rows[k]];
            if (s->rows[k] != j) y[s->rows[k]] += value * x[j];
        }
        y[j] += sum;
    }
}

/* The four (or fewer) next columns of a supernode at a time, so that what they act on is read but once for all of them;
   many supernodes have a few columns only, which a call of BLAS for each would not be worth. */
enum { TOGETHER = 4 };

/* e -= the columns' entries below their triangle, times x. */
static void subtract(float *restrict e, const float *restrict column, int64_t rows, int columns, int64_t count,
                     const float *restrict x)
{
    if (columns < TOGETHER) {
        for (int k = 0; k < columns; ++k)
            for (int64_t i = 0; i < count; ++i) e[i] -= column[k * rows + i] * x[k];
        return;
    }
    const float *one = column + rows, *two = one + rows, *three = two + rows;
    for (int64_t i = 0; i < count; ++i)
        e[i] -= (column[i] * x[0] + one[i] * x[1]) + (two[i] * x[2] + three[i] * x[3]);
}

/* Products of each column's entries with e. */
static void products(const float *restrict e, const float *restrict column, int64_t rows, int columns, int64_t count,
                     float *restrict found)
{
    if (columns < TOGETHER) {
        for (int k = 0; k < columns; ++k) {
            found[k] = 0.0f;
            for (int64_t i = 0; i < count; ++i) found[k] += column[k * rows + i] * e[i];
        }
        return;
    }
    const float *one = column + rows, *two = one + rows, *three = two + rows;
    float sums[TOGETHER] = {0};
    for (int64_t i = 0; i < count; ++i) {
        sums[0] += column[i] * e[i];
        sums[1] += one[i] * e[i];
        sums[2] += two[i] * e[i];
        sums[3] += three[i] * e[i];
    }
    memcpy(found, sums, sizeof(sums));
}

/* x becomes L⁻ᵀ L⁻¹ x, in the order of the factor; e: room for the rows of a supernode. */
static void substitute(const cholmod_factor *of, float *restrict x, float *restrict e)
{
    const int *super = of->super, *pi = of->pi, *px = of->px, *row = of->s;
    const float *values = of->x;
    for (int s = 0; s < (int)of->nsuper; ++s) {
        const int first = super[s], columns = super[s + 1] - first, rows = pi[s + 1] - pi[s];
        const float *L = values + px[s];
        for (int i = 0; i < columns; ++i) e[i] = x[first + i];
        for (int i = columns; i < rows; ++i) e[i] = 0.0f;
        for (int j = 0; j < columns; j += TOGETHER) {
            const int last = j + TOGETHER < columns ? j + TOGETHER : columns;
            for (int k = j; k < last; ++k) {
                e[k] /= L[(int64_t)k * rows + k];
                for (int i = k + 1; i < last; ++i) e[i] -= L[(int64_t)k * rows + i] * e[k];
            }
            subtract(e + last, L + (int64_t)j * rows + last, rows, last - j, rows - last, e + j);
        }
        for (int i = 0; i < columns; ++i) x[first + i] = e[i];
        for (int i = columns; i < rows; ++i) x[row[pi[s] + i]] += e[i];
    }
    for (int s = (int)of->nsuper - 1; s >= 0; --s) {
        const int first = super[s], columns = super[s + 1] - first, rows = pi[s + 1] - pi[s];
        const float *L = values + px[s];
        for (int i = 0; i < columns; ++i) e[i] = x[first + i];
        for (int i = columns; i < rows; ++i) e[i] = x[row[pi[s] + i]];
        for (int j = (columns - 1) / TOGETHER * TOGETHER; j >= 0; j -= TOGETHER) {
            const int last = j + TOGETHER < columns ? j + TOGETHER : columns;
            float found[TOGETHER];
            products(e + last, L + (int64_t)j * rows + last, rows, last - j, rows - last, found);
            for (int k = last - 1; k >= j; --k) {
                float sum = e[k] - found[k - j];
                for (int i = k + 1; i < last; ++i) sum -= L[(int64_t)k * rows + i] * e[i];
                e[k] = sum / L[(int64_t)k * rows + k];
            }
        }
        for (int i = 0; i < columns; ++i) x[first + i] = e[i];
    }
}

static int solve(uintptr_t address, uintptr_t b_, uintptr_t x_)
{
    single *s = (single *)address;
    const double *b = (const double *)b_;
    double *x = (double *)x_, size = 0.0;
    if (s->factor->xtype != CHOLMOD_REAL) return 0; /* memory was short */
    const int *place = s->factor->Perm;
    float *found = s->x, *room = found + s->n;
    for (int j = 0; j < s->n; ++j) size = fmax(size, fabs(b[j] * s->scale[j]));
    if (!(size > 0.0) || isinf(size)) size = 1.0;
    for (int j = 0; j < s->n; ++j) found[j] = (float)(b[place[j]] * s->scale[place[j]] / size);
    const unsigned rule = take_the_least_for_zero();
    substitute(s->factor, found, room);
    take_as_before(rule);
    for (int j = 0; j < s->n; ++j) x[place[j]] = found[j] * s->scale[place[j]] * size;
    return 1;
}
"""


NAME = "Cholesky (CHOLMOD, single precision)"


class Factor:
    """A factor of this rank's own.

    is_poor: whether the last matrix had none, or one that does not solve well, as its first solution shows.
    """

    def __init__(self, library: Any, address: int) -> None:
        """library: see `load`.  address: what one of its functions has made."""
        self._library, self._address, self._fresh, self.is_poor = library, address, False, False

    @classmethod
    def of_rows(cls, library: Any, starts: Indices, columns: Indices, dim: int) -> Factor:
        """Of a symmetric matrix by rows, as PETSc has it, of a body of so many dimensions."""
        return cls(library, library.make(len(starts) - 1, starts.ctypes.data, columns.ctypes.data, dim))

    @classmethod
    def of_blocks(cls, library: Any, pairs: Indices, held: Marks, dim: int) -> Factor:
        """Of blocks of pairs of nodes, the higher one first, rising.

        held: rows of a unit matrix, whatever the blocks say, shape (nodes · block,).  dim: of the body.
        """
        nodes = int(pairs[-1, 0]) + 1  # each has a block of its own, the last in its row
        starts = np.searchsorted(pairs[:, 0], np.arange(nodes + 1)).astype(np.int32)
        columns, marks = np.ascontiguousarray(pairs[:, 1], dtype=np.int32), np.ascontiguousarray(held, dtype=np.int8)
        places = (each.ctypes.data for each in (starts, columns, marks))
        return cls(library, library.make_of_blocks(nodes, len(held) // nodes, *places, dim))

    def factorise(self, values: Floats) -> bool:
        """Whether a matrix, by its entries or blocks, has one."""
        self.is_poor = not (self._address and self._library.factorise(self._address, values.ctypes.data))
        self._fresh = True
        return not self.is_poor

    def solve(self, b: Floats, times: Callable[[Floats], Floats]) -> Floats:
        """X ≈ A⁻¹ b; times: product of the matrix with a vector, to look at the first solution with."""
        found = self.approximate(b)
        if self._fresh:
            self._fresh = False
            found = self._looked_at(times, b, found)
        return found

    def times(self, values: Floats, x: Floats) -> Floats:
        """The product of the matrix, by its entries or blocks, with a vector."""
        x, y = np.ascontiguousarray(x), np.zeros(len(x))
        self._library.multiply(self._address, values.ctypes.data, x.ctypes.data, y.ctypes.data)
        return y

    def approximate(self, b: Floats) -> Floats:
        """X ≈ A⁻¹ b, not looked at."""
        b, x = np.ascontiguousarray(b), np.full(len(b), np.nan)
        if self._address:
            self._library.solve(self._address, b.ctypes.data, x.ctypes.data)
        return x

    def _looked_at(self, times: Callable[[Floats], Floats], b: Floats, x: Floats) -> Floats:
        """The first solution of a new factor; if it is none, conjugate gradients make one of it."""
        rest, size = b - times(x), float(np.linalg.norm(b))
        self.is_poor = not np.linalg.norm(rest) <= POOR * size
        direction: Floats = np.zeros(len(rest))
        slope = 1.0
        for _ in range(MOST_ITERATIONS if self.is_poor else 0):
            improved = self.approximate(rest)
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
        return float(self._library.work(self._address))

    def destroy(self) -> None:
        """Free the memory."""
        self._library.destroy(self._address)
        self._address = 0


class SingleFactor:
    """The context of a PETSc PC of type "python": solves with a factor in single precision.

    On several ranks each has the whole matrix and makes the same factor of it: nobody waits for the others within a
    factorisation or a solution, which for systems that are not large costs more than the work that is shared.
    """

    name = NAME

    def __init__(self, library: Any, dim: int) -> None:
        """library: see `load`.  dim: of the body."""
        self._library, self._dim = library, dim
        self._factor: Factor | None = None
        self._own, self._comm = slice(0), MPI.COMM_SELF
        self._rows: Indices = np.zeros(1, dtype=int)  # of each rank
        self._entries: Indices = np.zeros(1, dtype=int)

    def setUp(self, pc: PETSc.PC) -> None:
        """Factorise the matrix as it is now; PETSc calls this."""
        matrix = pc.getOperators()[0]
        starts, columns, values = matrix.getValuesCSR()
        if self._factor is None:
            self._comm = steady(pc.comm.tompi4py())
            self._own = slice(*matrix.getOwnershipRange())
            self._rows, self._entries = (
                np.array(self._comm.allgather(each)) for each in (len(starts) - 1, len(columns))
            )
            lengths = gathered(self._comm, np.diff(starts), self._rows)
            starts = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32)
            columns = gathered(self._comm, columns, self._entries)
            self._factor = Factor.of_rows(self._library, starts, columns, self._dim)
        made = self._factor.factorise(gathered(self._comm, values, self._entries))
        self._factor.is_poor = not self._comm.allreduce(made, MPI.LAND)

    def apply(self, pc: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """X ≈ A⁻¹ b; PETSc calls this."""
        assert self._factor is not None
        matrix = pc.getOperators()[0]

        def times(vector: Floats) -> Floats:
            ours, product = matrix.createVecs()
            ours.array_w[:] = vector[self._own]
            matrix.mult(ours, product)
            whole = np.array(gathered(self._comm, product.array_r, self._rows))
            ours.destroy()
            product.destroy()
            return whole

        x.array_w[:] = self._factor.solve(gathered(self._comm, b.array_r, self._rows), times)[self._own]

    @property
    def is_poor(self) -> bool:
        """Whether a factor in double precision would do better."""
        return self._factor is not None and self._factor.is_poor

    @property
    def work(self) -> float:
        """Operations of a factorisation for each entry of the factor; zero before the first one."""
        return self._factor.work if self._factor else 0.0

    def destroy(self, pc: PETSc.PC) -> None:
        """Free the memory; PETSc calls this."""
        if self._factor is not None:
            self._factor.destroy()


def gathered(comm: MPI.Intracomm, values: Any, counts: Indices) -> Any:
    """What all ranks have, one after the other.  counts: how many values each has."""
    values = np.ascontiguousarray(values)
    if comm.size == 1:
        return values
    whole = np.empty(counts.sum(), dtype=values.dtype)
    comm.Allgatherv(values, [whole, counts])
    return whole


def fits_into_memory(size: int, dim: int, factors: int) -> bool:
    """Whether half of the memory that is free now holds some factors: in space they grow faster than the body.

    The same on all ranks of a machine, which ask at the same time.
    """
    try:
        free = os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (ValueError, OSError):  # not told here
        return True
    return dim < SPACE or BYTES_IN_SPACE * size ** (4 / 3) * factors < free / 2


def load(comm: Any) -> Any:
    """The library, compiled on first use; None where CHOLMOD, or its header, is not there (collective)."""
    try:
        return kernels.library(comm, SOURCE, DECLARATIONS, "cholmod", libraries=("cholmod",))
    except InputError:
        return None
