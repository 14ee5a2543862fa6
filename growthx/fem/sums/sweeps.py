"""Sums over cells, several cells at once: forms and condensed tangents with a lane of a vector for each cell.

One statement of the weak form serves both: `fem.sums.lanes` makes the kernels from what FFCx has written.  What
the cells need is gathered from the functions themselves, and what they say is added cell by cell, in their order, so
that two runs do the same.  Where that cannot be, or is not worth its compilation, there is none, and DOLFINx takes the
cells one by one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np

from growthx.common.communicators import steady
from growthx.fem import compat, kernels
from growthx.fem.sums import lanes

if TYPE_CHECKING:
    from collections.abc import Sequence

    import ufl

    from growthx.common.arrays import Floats, Indices

FEWEST = 4000  # cells of a rank, on the average, from which on the compilation is worth it
FEWEST_ENTRIES = 250  # so many times as many entries, of all cells' matrices: a tangent is made more seldom
MOST_ENTRIES = 4096  # of a cell's matrix, and of what it gathers: more would not stay near the CPU
WIDTH = 4  # lanes that are worth it

GATHER = """
typedef struct { int64_t values, places, nodes, block; } field;
typedef struct { int64_t x, corners, corners_of_cell, fields, width; } body;

/* What LANES cells from the first one on have, of `count`; the last one fills up what is missing. */
static void gather(const body *of, const field *fields, const int32_t *cells, int count, int first,
                   lanes *coordinates, lanes *w)
{
  const double *x = (const double *)of->x;
  for (int l = 0; l < LANES; ++l)
  {
    const int64_t cell = cells[first + l < count ? first + l : count - 1];
    const int32_t *corners = (const int32_t *)of->corners + cell * of->corners_of_cell;
    double *to = (double *)coordinates + l;
    for (int i = 0; i < of->corners_of_cell; ++i)
      for (int j = 0; j < 3; ++j, to += LANES)
        *to = x[3 * (int64_t)corners[i] + j];
    to = (double *)w + l;
    for (const field *f = fields; f < fields + of->fields; ++f)
    {
      const double *values = (const double *)f->values;
      const int32_t *places = (const int32_t *)f->places + cell * f->nodes;
      for (int i = 0; i < f->nodes; ++i)
        for (int j = 0; j < f->block; ++j, to += LANES)
          *to = values[places[i] * f->block + j];
    }
  }
}

static int width(void) { return LANES; }
"""

OF_VECTORS = """
typedef void kernel(lanes *restrict, const lanes *restrict, const double *restrict, const lanes *restrict);
static kernel *const kernels[] = {%(names)s};

static void add_vectors(int integral, uintptr_t cells_, int count, uintptr_t body_, uintptr_t fields, uintptr_t c,
                        uintptr_t sum_)
{
  const body *of = (const body *)body_;
  const field *sum = (const field *)sum_;
  const int32_t *cells = (const int32_t *)cells_;
  const int entries = sum->nodes * sum->block;
  lanes coordinates[3 * of->corners_of_cell], w[of->width + 1], A[entries];
  for (int first = 0; first < count; first += LANES)
  {
    gather(of, (const field *)fields, cells, count, first, coordinates, w);
    memset(A, 0, entries * sizeof(lanes));
    kernels[integral](A, w, (const double *)c, coordinates);
    for (int l = 0; l < LANES && first + l < count; ++l)
    {
      const int32_t *places = (const int32_t *)sum->places + (int64_t)cells[first + l] * sum->nodes;
      const double *from = (const double *)A + l;
      for (int i = 0; i < sum->nodes; ++i)
        for (int j = 0; j < sum->block; ++j, from += LANES)
          ((double *)sum->values)[places[i] * sum->block + j] += *from;
    }
  }
}
"""
ADD_VECTORS = """
int width(void);
void add_vectors(int integral, uintptr_t cells, int count, uintptr_t body, uintptr_t fields, uintptr_t c,
                 uintptr_t sum);
"""

OF_MATRICES = """
enum { U = %(displacements)d, R = %(densities)d, N = U + R };

/* The tangents of LANES cells, with densities eliminated as fem.condensation does it. */
static void tangents(lanes *restrict K, const lanes *restrict w, const double *restrict c,
                     const lanes *restrict coordinates)
{
  memset(K, 0, N * N * sizeof(lanes));
%(calls)s
  for (int r = U; r < N; ++r)
  {
    const lanes inverse = 1.0 / K[r * N + r];
    for (int i = 0; i < U; ++i)
    {
      const lanes factor = inverse * K[i * N + r];
      for (int j = 0; j < U; ++j)
        K[i * N + j] -= factor * K[r * N + j];
    }
  }
}

/* pairs: as the places in fem.sums.cell_sums, but of all cells. */
static void add_matrices(uintptr_t cells_, int count, uintptr_t body_, uintptr_t fields, uintptr_t c, int nodes,
                         int block, uintptr_t pairs, uintptr_t K_, uintptr_t values)
{
  const body *of = (const body *)body_;
  const int32_t *cells = (const int32_t *)cells_;
  lanes coordinates[3 * of->corners_of_cell], w[of->width + 1];
  lanes *K = (lanes *)K_;
  for (int first = 0; first < count; first += LANES)
  {
    gather(of, (const field *)fields, cells, count, first, coordinates, w);
    tangents(K, w, (const double *)c, coordinates);
    for (int l = 0; l < LANES && first + l < count; ++l)
    {
      const int32_t *place = (const int32_t *)pairs + (int64_t)cells[first + l] * (nodes * (nodes + 1) / 2);
      const double *from = (const double *)K + l;
      for (int a = 0; a < nodes; ++a)
        for (int b = 0; b <= a; ++b, ++place)
        {
          double *to = (double *)values + (int64_t)(*place >> 1) * block * block;
          const int row = (*place & 1 ? a : b) * block, column = (*place & 1 ? b : a) * block;
          for (int i = 0; i < block; ++i)
            for (int j = 0; j < block; ++j)
              *to++ += from[((row + i) * N + column + j) * LANES];
        }
    }
  }
}
"""
ADD_MATRICES = """
int width(void);
void add_matrices(uintptr_t cells, int count, uintptr_t body, uintptr_t fields, uintptr_t c, int nodes, int block,
                  uintptr_t pairs, uintptr_t K, uintptr_t values);
"""


@dataclass(frozen=True)
class _OfVectors:
    """The recipe of a library that adds up a form's vectors."""

    declarations: str = ADD_VECTORS

    @property
    def frame(self) -> str:
        return lanes.TYPES + lanes.FUNCTIONS + GATHER + OF_VECTORS

    def source(self, codes: list[str]) -> str | None:
        return of_one_form(codes[0], OF_VECTORS)


@dataclass(frozen=True)
class _OfMatrices:
    """The recipe of a library that adds up condensed tangents.

    sizes: numbers of displacements and densities of a cell.  starts: of each tangent among coefficients and constants.
    """

    sizes: tuple[int, int]
    starts: tuple[tuple[int, int], ...]
    declarations: str = ADD_MATRICES

    @property
    def frame(self) -> str:
        return lanes.TYPES + lanes.FUNCTIONS + GATHER + OF_MATRICES + repr((self.sizes, self.starts))

    def source(self, codes: list[str]) -> str | None:
        functions: dict[str, str] = {}
        calls = []
        try:
            for i, (code, (coefficient, constant)) in enumerate(zip(codes, self.starts, strict=True)):
                functions |= lanes.translated(code, f"lanes_{i}")
                calls.append(f"  lanes_{i}_0(K, w + {coefficient}, c + {constant}, coordinates);")
        except lanes.NotTranslatedError:
            return None
        displacements, densities = self.sizes
        rest = OF_MATRICES % {"displacements": displacements, "densities": densities, "calls": "\n".join(calls)}
        return lanes.TYPES + lanes.FUNCTIONS + "".join(functions.values()) + GATHER + rest


def of_one_form(code: str, rest: str) -> str | None:
    """C code of FFCx's for a form, and what calls its kernels by their names; None where it is not known."""
    try:
        found = lanes.translated(code, "lanes")
    except lanes.NotTranslatedError:
        return None
    names = {"names": ", ".join(found)}
    return lanes.TYPES + lanes.FUNCTIONS + "".join(found.values()) + GATHER + rest % names


class Body:
    """What cells gather: their corners, and the values of some functions.  Keeps what it has the addresses of."""

    def __init__(self, domain: dolfinx.mesh.Mesh, coefficients: Sequence[dolfinx.fem.Function]) -> None:
        self._domain, self._coefficients = domain, coefficients
        self._corners = np.ascontiguousarray(compat.geometry_nodes(domain), dtype=np.int32)
        self._places = [_places(coefficient.function_space) for coefficient in coefficients]
        self.fields = np.zeros((len(coefficients), 4), dtype=np.int64)
        for row, coefficient, places in zip(self.fields, coefficients, self._places, strict=True):
            row[1:] = places.ctypes.data, places.shape[1], coefficient.function_space.dofmap.bs
        width = int((self.fields[:, 2] * self.fields[:, 3]).sum())
        self.table = np.array([0, self._corners.ctypes.data, self._corners.shape[1], len(coefficients), width])

    def look(self) -> tuple[int, int]:
        """Addresses of the body and of its fields, as these are now."""
        self.table[0] = self._domain.geometry.x.ctypes.data
        self.fields[:, 0] = [coefficient.x.array.ctypes.data for coefficient in self._coefficients]
        return self.table.ctypes.data, self.fields.ctypes.data


class VectorSweep:
    """Adds up a linear form of cells."""

    def __init__(self, library: Any, weak_form: ufl.Form, form: dolfinx.fem.Form, coefficients: list[Any]) -> None:
        """library: by `_OfVectors`.  coefficients: of the compiled form, in its order."""
        self._library, self._form = library, form
        space = weak_form.arguments()[0].ufl_function_space()
        self._body = Body(space.mesh, coefficients)
        self._places = _places(space)
        self._sum = np.array([0, self._places.ctypes.data, self._places.shape[1], space.dofmap.bs])
        self._cells = compat.cells_of_integrals(form)

    def __call__(self, total: Floats) -> None:
        """Add what the form is now to the local entries of a vector."""
        constants = dolfinx.cpp.fem.pack_constants(self._form._cpp_object)
        body, fields = self._body.look()
        self._sum[0] = total.ctypes.data
        for integral, cells in enumerate(self._cells):
            self._library.add_vectors(
                integral, cells.ctypes.data, len(cells), body, fields, constants.ctypes.data, self._sum.ctypes.data
            )


class MatrixSweep:
    """Adds up condensed tangents of cells, as `cell_sums` has them."""

    def __init__(self, library: Any, form: dolfinx.fem.Form, space: Any, coefficients: list[Any], entries: int) -> None:
        """library: by `_OfMatrices`.  form: by `condensed_tangent`.  entries: of the matrix of a cell."""
        self._library, self._form = library, form
        self._block = space.dofmap.bs
        self._nodes = space.dofmap.list.shape[1]
        self._body = Body(space.mesh, coefficients)
        room = np.empty((entries + 1) * library.width())
        self._matrix = room[-room.ctypes.data % 64 // room.itemsize :]

    def __call__(self, cells: Indices, pairs: Indices, values: Floats) -> None:
        """Add what the form is now to blocks.  pairs: places of all cells' pairs of nodes."""
        constants = dolfinx.cpp.fem.pack_constants(self._form._cpp_object)
        self._library.add_matrices(
            cells.ctypes.data,
            len(cells),
            *self._body.look(),
            constants.ctypes.data,
            self._nodes,
            self._block,
            pairs.ctypes.data,
            self._matrix.ctypes.data,
            values.ctypes.data,
        )


def of_matrices(
    tangents: Sequence[ufl.Form], form: dolfinx.fem.Form, space: Any, densities: int, coefficients: list[list[Any]]
) -> MatrixSweep | None:
    """What adds up the tangents that a form by `condensed_tangent` is made of; None if one by one (collective).

    coefficients: of each of the tangents.
    """
    together = [each for of_tangent in coefficients for each in of_tangent]
    displacements = values_in_a_cell(space)
    entries = (displacements + densities) ** 2
    spaces = [space, *(coefficient.function_space for coefficient in together)]
    fewest = FEWEST * FEWEST_ENTRIES / entries
    if not (_is_worth_it(space.mesh, fewest) and entries <= MOST_ENTRIES and _can_be_gathered(spaces)):
        return None
    starts = tuple(
        zip(
            _starts([[values_in_a_cell(each.function_space) for each in of_tangent] for of_tangent in coefficients]),
            _starts([[each.value.size for each in tangent.constants()] for tangent in tangents]),
            strict=True,
        )
    )
    recipe = _OfMatrices((displacements, densities), starts)
    library = kernels.derived(steady(space.mesh.comm), tangents, recipe)
    if library is None or library.width() < WIDTH:
        return None
    return MatrixSweep(library, form, space, together, entries)


def of_vectors(weak_form: ufl.Form, form: dolfinx.fem.Form) -> VectorSweep | None:
    """What adds up a linear form, given as it was compiled, several cells at once; None if one by one (collective)."""
    if not weak_form.arguments():
        return None  # a form that is zero has no test function left
    found = compiled(weak_form, _OfVectors(), FEWEST)
    return None if found is None else VectorSweep(found[0], weak_form, form, found[1])


def compiled(weak_form: ufl.Form, recipe: Any, fewest: float) -> tuple[Any, list[dolfinx.fem.Function]] | None:
    """The library of a recipe for a form, and its coefficients in the library's order (collective).

    None if it has integrals over other things than cells, if there are less of them than `fewest` on a rank, or if
    there is no such library.
    """
    if any(each.integral_type() != "cell" for each in weak_form.integrals()):
        return None
    space = weak_form.arguments()[0].ufl_function_space()
    if not _is_worth_it(space.mesh, fewest):
        return None
    comm = steady(space.mesh.comm)
    ufcx_form, _ = kernels.generated(comm, weak_form)
    coefficients = used(weak_form, ufcx_form)
    if not _can_be_gathered([space, *(coefficient.function_space for coefficient in coefficients)]):
        return None
    library = kernels.derived(comm, [weak_form], recipe)
    if library is None or library.width() < WIDTH:
        return None
    return library, coefficients


def used(weak_form: ufl.Form, ufcx_form: Any) -> list[dolfinx.fem.Function]:
    """The coefficients that the compiled form still has, in its order."""
    coefficients, positions = weak_form.coefficients(), ufcx_form.original_coefficient_positions
    return [coefficients[positions[i]] for i in range(ufcx_form.num_coefficients)]


def _is_worth_it(domain: dolfinx.mesh.Mesh, fewest: float) -> bool:
    """Whether there are so many cells on a rank, and numbers as the kernels have them; the same on all ranks."""
    cells = domain.topology.index_map(domain.topology.dim).size_global
    known = compat.CELLS_OF_INTEGRALS and np.dtype(dolfinx.default_scalar_type) == np.float64
    return known and domain.geometry.x.dtype == np.float64 and cells >= fewest * steady(domain.comm).size


def _can_be_gathered(spaces: Sequence[dolfinx.fem.FunctionSpace]) -> bool:
    """Whether cells take values of such functions as they are."""
    sizes = sum(values_in_a_cell(space) for space in spaces)
    return sizes <= MOST_ENTRIES and not any(space.element.needs_dof_transformations for space in spaces)


def values_in_a_cell(space: dolfinx.fem.FunctionSpace) -> int:
    """Number of values in a cell."""
    return int(space.dofmap.list.shape[1] * space.dofmap.bs)


def _places(space: dolfinx.fem.FunctionSpace) -> Indices:
    """Where cells find the values of a function, (cells, nodes)."""
    return np.ascontiguousarray(space.dofmap.list, dtype=np.int32)


def _starts(sizes: list[list[int]]) -> list[int]:
    """Where each tangent's part begins if all parts follow one another."""
    return [sum(map(sum, sizes[:i])) for i in range(len(sizes))]
