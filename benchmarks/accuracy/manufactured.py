"""A manufactured solution of the coupled balances of mass and momentum at finite strains, derived with sympy.

One implicit Euler step from uniform ρₙ = ρ* is a boundary value problem of its own, without an error in time.  Fields
u(x) and ρ(x) are chosen, and what makes them its solution follows from the strong form:

    (4)        b̄₀  = −Div P̄,    t = P̄ N on all sides but the clamped one
    (3) + (17) Ψ₀* = [ρ/ρ*]^(−m) Ψ₀ − [ρ − ρₙ]/[c Δt]

The formulas are typed here once more, from the paper: nothing of growthx is used to derive them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import dolfinx
import numpy as np
import sympy as sp
from mpi4py import MPI

import growthx as gx

if TYPE_CHECKING:
    from collections.abc import Callable

# Rational, so that identities can be checked to any number of digits.
YOUNG, POISSON, REFERENCE = sp.Integer(12), sp.Rational(1, 4), sp.Rational(6, 5)
N, M, RATE, STEP = 2, 3, sp.Rational(3, 2), sp.Rational(1, 2)

COORDINATES = sp.symbols("x y z", real=True)
SIDES = {  # direction of the normal, and its sign; the left side is clamped
    "left": (0, -1),
    "right": (0, 1),
    "bottom": (1, -1),
    "top": (1, 1),
    "front": (2, -1),
    "back": (2, 1),
}


@dataclass(frozen=True)
class Manufactured:
    """The solution and its data as sympy expressions of position, in `dim` dimensions (two: plane strain).

    displacement, body_force: (dim, 1); gradient (of the displacement), stress P̄: (dim, dim); density, attractor:
    scalars.
    """

    dim: int
    displacement: sp.Matrix
    density: sp.Expr
    gradient: sp.Matrix
    stress: sp.Matrix
    body_force: sp.Matrix
    attractor: sp.Expr


@cache
def manufactured(dim: int) -> Manufactured:
    """Derive the data of the balances in two or three dimensions."""
    u, rho = chosen(dim)
    gradient = u.jacobian(COORDINATES[:dim])
    P = stress(gradient + sp.eye(dim), rho)
    body_force = -sp.Matrix([sum(P[i, j].diff(COORDINATES[j]) for j in range(dim)) for i in range(dim)])
    stimulus = (rho / REFERENCE) ** (N - M) * elastic_energy(gradient + sp.eye(dim))
    return Manufactured(dim, u, rho, gradient, P, body_force, stimulus - (rho - REFERENCE) / (RATE * STEP))


def chosen(dim: int) -> tuple[sp.Matrix, sp.Expr]:
    """The displacement, zero on the left side, with stretches of up to about 40 %, and the density, ρ* ± 20 %."""
    x, y, z = COORDINATES[:dim] + (sp.Integer(0),) * (3 - dim)
    u = x * sp.Matrix(
        [
            sp.Rational(3, 10) + sp.sin(2 * x + 3 * y - z) / 25,
            -y / 10 + sp.cos(2 * x - 2 * y + 3 * z) / 25,
            -z / 12 + sp.sin(x + 2 * y + 2 * z) / 30,
        ]
    )
    rho = REFERENCE * (1 + sp.sin(4 * x + y + z) * sp.cos(y - x / 2 + z) / 5)
    return sp.Matrix(u[:dim]), rho


def elastic_energy(F: sp.Matrix) -> sp.Expr:
    """Ψ₀ⁿᵉᵒ = ½ λ ln²J + ½ μ [b : 1 − 3 − 2 ln J], the out-of-plane 1 of plane strain in b : 1."""
    lam, mu = lame()
    J, trace = F.det(), sum(entry**2 for entry in F) + 3 - F.rows
    return lam / 2 * sp.log(J) ** 2 + mu / 2 * (trace - 3 - 2 * sp.log(J))


def stress(F: sp.Matrix, rho: sp.Expr) -> sp.Matrix:
    """P̄ = [ρ/ρ*]ⁿ { μ F + [λ ln J − μ] F⁻ᵀ } (7)."""
    lam, mu = lame()
    J = F.det()
    return (rho / REFERENCE) ** N * (mu * F + (lam * sp.log(J) - mu) / J * F.cofactor_matrix())


def lame() -> tuple[sp.Expr, sp.Expr]:
    """Lamé's parameters (λ, μ)."""
    return YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON)), YOUNG / (2 * (1 + POISSON))


@cache
def numeric(dim: int, name: str) -> Callable[[np.ndarray], np.ndarray]:
    """A field of the manufactured problem as a function of x, (3, points); its own shape, then that of the points."""
    expression = getattr(manufactured(dim), name)
    shape = () if isinstance(expression, sp.Expr) else (dim,) if expression.cols == 1 else expression.shape
    entries = [expression] if isinstance(expression, sp.Expr) else list(expression)
    function = sp.lambdify(COORDINATES[:dim], entries, "numpy", cse=True)
    return lambda x: np.reshape(function(*x[:dim]), (*shape, -1))


def traction(dim: int, side: str) -> Callable[[np.ndarray], np.ndarray]:
    """The traction P̄ N on a side as a function of x, (3, points), to (dim, points)."""
    (direction, sign), P = SIDES[side], numeric(dim, "stress")
    return lambda x: sign * P(x)[:, direction]


@dataclass(frozen=True)
class Family:
    """Ever finer meshes of the unit square or cube by one shape of cells.

    smooth: the images of a regular grid under one smooth map, so that the cells of finer meshes come ever closer to
    parallelograms (parallelepipeds); otherwise trapezoids of the same shape however fine (Arnold, Boffi & Falk,
    Approximation by quadrilateral finite elements, Math. Comp. 71 (2002) 909–922), on an even number of cells per side.
    """

    name: str
    cell: str
    smooth: bool = True

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return 2 if self.cell in ("quadrilateral", "triangle") else 3

    def mesh(self, cells: int) -> gx.Mesh:
        """The mesh with so many cells per side; the sides are named."""
        kind, dim = dolfinx.mesh.CellType[self.cell], self.dim
        create = dolfinx.mesh.create_unit_square if dim == 2 else dolfinx.mesh.create_unit_cube
        domain = create(MPI.COMM_WORLD, *(cells,) * dim, kind)
        sides = {name: side for name, side in SIDES.items() if side[0] < dim}
        mesh = gx.Mesh.with_names(
            domain,
            {name: lambda x, i=i, sign=sign: np.isclose(x[i], (1 + sign) / 2) for name, (i, sign) in sides.items()},
        )
        (_move_smoothly if self.smooth else _make_trapezoids)(domain.geometry.x, cells, dim)
        return mesh


QUADRILATERALS = Family("quadrilaterals", "quadrilateral")
TRAPEZOIDS = Family("trapezoids", "quadrilateral", smooth=False)
TRIANGLES = Family("triangles", "triangle")
HEXAHEDRA = Family("hexahedra", "hexahedron")
TETRAHEDRA = Family("tetrahedra", "tetrahedron")


def _move_smoothly(x: np.ndarray, cells: int, dim: int) -> None:
    """Move the nodes inside, x of shape (nodes, 3), by one smooth field; the sides stay as they are."""
    bump = np.prod(np.sin(np.pi * x[:, :dim]), axis=1)
    x[:, :dim] += 0.08 * np.outer(bump, (1, -0.7, 0.5)[:dim])


def _make_trapezoids(x: np.ndarray, cells: int, dim: int) -> None:
    """Move every other row of nodes up and down in turn: the parallel sides of a cell are as 5 to 3."""
    column, row = np.rint(cells * x[:, :2].T).astype(int)
    x[:, 1] += (-1.0) ** column * (row % 2) / (4 * cells)


def scene(mesh: gx.Mesh) -> gx.Scene:
    """The manufactured problem on a mesh of a `Family`: one step, all the load at once."""
    # A function of position would be taken at the cells' midpoints.
    attractor = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("Lagrange", 4)))
    attractor.interpolate(numeric(mesh.dim, "attractor"))
    return gx.Scene(
        name="manufactured",
        mesh=mesh,
        material=gx.Material(float(YOUNG), float(POISSON), float(REFERENCE), N),
        growth=gx.EnergyDrivenGrowth(attractor, float(RATE), M),
        supports=(gx.Support("left"),),
        loads=(
            gx.BodyForce(numeric(mesh.dim, "body_force")),
            *(gx.Traction(side, traction(mesh.dim, side)) for side in mesh.boundaries if side != "left"),
        ),
        program=gx.Program(step=float(STEP), until=float(STEP)),
    )
