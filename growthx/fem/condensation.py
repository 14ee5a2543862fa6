"""Static condensation: densities that no two cells share are eliminated in the cell's own tangent (Remark 4.1).

FFCx compiles the tangent of both balances on one cell,

    | K_uu  K_uρ |
    | K_ρu  K_ρρ |        (27), (28) for a density per cell and (39), (40) for densities at the integration points,

and a few lines of C around it leave K_uu − K_uρ K_ρρ⁻¹ K_ρu.  K_ρρ is diagonal, since each density has a balance of its
own.  Where the two balances are integrated at different points, each has a compiled tangent, and the C code adds them.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING

import dolfinx
import numpy as np

from growthx.common.communicators import steady
from growthx.fem import compat, kernels
from growthx.fem.sums.sweeps import of_matrices, used, values_in_a_cell

if TYPE_CHECKING:
    from collections.abc import Sequence

    import ufl

    from growthx.common.arrays import Indices

SOURCE = """
#include <stdint.h>

typedef void kernel(double* restrict, const double* restrict, const double* restrict, const double* restrict,
                    const int* restrict, const uint8_t* restrict{extra_type});

enum {{ U = {displacements}, R = {densities}, N = U + R, TANGENTS = {tangents} }};
static kernel* tangent[TANGENTS];
static const int first_coefficient[TANGENTS] = {{ {first_coefficient} }};
static const int first_constant[TANGENTS] = {{ {first_constant} }};

static void condensed(double* restrict A, const double* restrict w, const double* restrict c,
                      const double* restrict coordinates, const int* restrict entity,
                      const uint8_t* restrict permutation{extra_argument})
{{
  double K[N][N] = {{{{0}}}};
  for (int t = 0; t < TANGENTS; ++t)
    tangent[t](&K[0][0], w + first_coefficient[t], c + first_constant[t], coordinates, entity, permutation{extra_pass});
  for (int i = 0; i < U; ++i)
    for (int j = 0; j < U; ++j)
      A[i * U + j] += K[i][j];
  for (int r = U; r < N; ++r)
  {{
    const double inverse = 1.0 / K[r][r];
    for (int i = 0; i < U; ++i)
    {{
      const double factor = inverse * K[i][r];
      for (int j = 0; j < U; ++j)
        A[i * U + j] -= factor * K[r][j];
    }}
  }}
}}

uintptr_t bind(int t, uintptr_t address)
{{
  tangent[t] = (kernel*)address;
  return (uintptr_t)condensed;
}}
"""


@dataclass(frozen=True)
class Elimination:
    """Where densities are eliminated, and beside what.

    space: displacement space.  densities: number of densities in a cell, perhaps none.  cells: where.
    often: whether several cells at once are worth their compilation, for `CellSums`.
    """

    space: dolfinx.fem.FunctionSpace
    densities: int
    cells: Indices
    often: bool = False


def condensed_tangent(tangents: Sequence[ufl.Form], elimination: Elimination) -> dolfinx.fem.Form:
    """The tangent of both balances as a form of the displacement alone.

    tangents: forms whose sum is the derivative of both balances, each with one quadrature rule, their arguments (u, ρ)
    from a mixed element with the displacement first.
    kernel, kernel_cells, sweep: of the form that is returned, the address of its kernel, `cells`, and what takes
    several of them at once, None if nothing does.
    """
    space, densities, cells = elimination.space, elimination.densities, elimination.cells
    comm = steady(space.mesh.comm)
    compiled = [kernels.generated(comm, tangent) for tangent in tangents]
    coefficients = [used(tangent, ufcx_form) for tangent, (ufcx_form, _) in zip(tangents, compiled, strict=True)]
    constants = [tangent.constants() for tangent in tangents]
    extra = compat.KERNEL_EXTRA_TYPE
    source = SOURCE.format(
        displacements=space.dofmap.dof_layout.num_dofs * space.dofmap.bs,
        densities=densities,
        tangents=len(tangents),
        first_coefficient=_starts([[values_in_a_cell(w.function_space) for w in each] for each in coefficients]),
        first_constant=_starts([[c.value.size for c in each] for each in constants]),
        extra_type=extra,
        extra_argument=extra and f"{extra} data",
        extra_pass=extra and ", data",
    )
    modules = [module for _, module in compiled]
    # The bound address is kept inside the library, hence one library for each compiled form.
    owner = " ".join(module.__name__ for module in modules)
    library = kernels.library(comm, source, "uintptr_t bind(int t, uintptr_t address);", owner)
    for t, (ufcx_form, module) in enumerate(compiled):
        kernel = library.bind(t, compat.integral_kernel_address(ufcx_form, module.ffi))
    form = compat.cell_form([space, space], kernel, cells, [*chain(*coefficients)], [*chain(*constants)])
    form.kernel, form.kernel_cells = kernel, cells  # type: ignore[attr-defined]
    form.kernel_modules = (*modules, library)  # type: ignore[attr-defined]  # the form calls into them: they must live as long as it does
    form.sweep = of_matrices(tangents, form, space, densities, coefficients) if elimination.often else None  # type: ignore[attr-defined]
    return form


def _starts(sizes: list[list[int]]) -> str:
    """Where each tangent's part begins if all parts follow one another, as a list in C."""
    return ", ".join(map(str, np.cumsum([0, *map(sum, sizes[:-1])])))
