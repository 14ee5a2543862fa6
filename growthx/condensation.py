"""Static condensation: densities that no two cells share are eliminated in the cell's own tangent (Remark 4.1).

FFCx compiles the tangent of both balances on one cell,

    | K_uu  K_uρ |
    | K_ρu  K_ρρ |        (27), (28) for a density per cell and (39), (40) for densities at the integration points,

and a few lines of C around it leave K_uu − K_uρ K_ρρ⁻¹ K_ρu.  K_ρρ is diagonal, since each density has a balance of its
own.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import dolfinx

from growthx import compat

if TYPE_CHECKING:
    import ufl

    from growthx.arrays import Indices

SOURCE = """
#include <stdint.h>

typedef void kernel(double* restrict, const double* restrict, const double* restrict, const double* restrict,
                    const int* restrict, const uint8_t* restrict{extra_type});

static kernel* monolithic;

static void condensed(double* restrict A, const double* restrict w, const double* restrict c,
                      const double* restrict coordinates, const int* restrict entity,
                      const uint8_t* restrict permutation{extra_argument})
{{
  enum {{ U = {displacements}, R = {densities}, N = U + R }};
  double K[N][N] = {{{{0}}}};
  monolithic(&K[0][0], w, c, coordinates, entity, permutation{extra_pass});
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

uintptr_t bind(uintptr_t address)
{{
  monolithic = (kernel*)address;
  return (uintptr_t)condensed;
}}
"""


def condensed_tangent(
    tangent: ufl.Form,
    space: dolfinx.fem.FunctionSpace,
    densities: int,
    cells: Indices,
) -> dolfinx.fem.Form:
    """The tangent of both balances as a form of the displacement alone.

    tangent: derivative of both balances, its arguments (u, ρ) from a mixed element with the displacement first.
    space: displacement space.  densities: number of densities in a cell.  cells: where the density is eliminated.
    """
    comm = space.mesh.comm
    ufcx_form, module, _ = dolfinx.jit.ffcx_jit(comm, tangent)
    displacements = space.dofmap.dof_layout.num_dofs * space.dofmap.bs
    extra = compat.KERNEL_EXTRA_TYPE
    source = SOURCE.format(
        displacements=displacements,
        densities=densities,
        extra_type=extra,
        extra_argument=extra and f"{extra} data",
        extra_pass=extra and ", data",
    )
    library = dolfinx.jit.mpi_jit_decorator(_build)(comm, source, module.__name__)
    kernel = library.bind(compat.integral_kernel_address(ufcx_form, module.ffi))
    used = ufcx_form.original_coefficient_positions
    coefficients = tangent.coefficients()
    form = compat.cell_form(
        [space, space],
        kernel,
        cells,
        [coefficients[used[i]] for i in range(ufcx_form.num_coefficients)],
        tangent.constants(),
    )
    form.kernel_modules = (module, library)  # type: ignore[attr-defined]  # the form calls into them: they must live as long as it does
    return form


def _build(source: str, form_name: str) -> Any:
    """Compile the C source, once for each form it is bound to, and load it."""
    import cffi

    # The bound address is kept inside the library, hence one library for each compiled form.
    tag = f"{source}{form_name}{sys.version}{os.uname().machine}"
    name = f"growthx_condensed_{hashlib.sha256(tag.encode()).hexdigest()[:20]}"
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "growthx" / "kernels"
    folder.mkdir(parents=True, exist_ok=True)
    found = next(folder.glob(f"{name}.*so"), None)
    if found is None:
        ffi = cffi.FFI()
        ffi.cdef("uintptr_t bind(uintptr_t address);")
        ffi.set_source(name, source, extra_compile_args=["-O3"])
        # Built aside and renamed, so that another process never loads half a library.
        with tempfile.TemporaryDirectory(dir=folder) as aside:
            built = Path(ffi.compile(tmpdir=aside))
            found = folder / built.name
            built.replace(found)
    spec = importlib.util.spec_from_file_location(name, found)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.lib
