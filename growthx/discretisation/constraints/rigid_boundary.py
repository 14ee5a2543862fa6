"""One rigid boundary in one load case: the rigid motion of its unknowns, and the directions in which that can go on.

Its unknowns are what they are of an affine displacement, values at nodes or moments (serendipity): y of the position
and t of the constant one at each node, z = y − t c.  They move as u = (R − I) z + t d.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import dolfinx
import numpy as np
from mpi4py import MPI

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.common.arrays import Floats, Indices
    from growthx.discretisation.spaces import Spaces
    from growthx.discretisation.unknowns import Unknowns
    from growthx.meshing.mesh import Mesh
    from growthx.model.actions.rigid import RigidFace

LAST_PLACES = 16  # of a number: what is nearer to a rigid motion is one


class RigidBoundary:
    """A rigid face of a scene in a load case.

    dofs: its unknowns on this rank, ghosts included, (nodes, dim), as places in the unknown's `x.array`.
    own: of its nodes, which this rank owns.  columns: of the motions that are free, translations first.
    """

    def __init__(self, face: RigidFace, spaces: Spaces, unknowns: Unknowns, case: int) -> None:
        mesh, space = spaces.scene.mesh, unknowns.subspaces[case]
        self.face, self.case, self._comm = face, case, spaces.comm
        self._dim, self._deforms = mesh.dim, not spaces.scene.material.small_strain
        alone = dolfinx.fem.functionspace(mesh.domain, space.ufl_element().sub_elements[0])
        self.dofs, nodes = _unknowns_of(face.on, mesh, space, alone)
        self.own = self.dofs[:, 0] < unknowns.owned
        self._t, y = _of(alone, _ones, nodes), np.empty(self.dofs.shape)
        for i in range(mesh.dim):
            y[:, i] = _of(alone, partial(_entry, i), nodes)
        self._z = y - np.outer(self._t, face.centre(mesh))
        self._free = [i for i in range(mesh.dim) if i not in face.held]
        self._turns = face.turning(mesh.dim)
        self.axes = face.axes(mesh.dim)
        weight = self._t[self.own]
        self._whole = self._sum(weight @ weight)
        self._middle = self._sum(weight @ self._z[self.own]) / self._whole
        self._around = self._z - np.outer(self._t, self._middle)
        self._size = spaces.comm.allreduce(float(np.abs(self._z).max(initial=0.0)), MPI.MAX)
        self.columns = len(self._free) + len(self._turns)
        self._arms: Floats = self._z.copy()

    def settle(self, whole: Floats) -> None:
        """Put the unknowns of an iterate, as `x.array`, to the rigid motion that is nearest (collective)."""
        u = whole[self.dofs]
        moved = self._rigid(u)
        apart, far = (float(np.abs(each[self.own]).max(initial=0.0)) for each in (moved - u, u))
        apart, far = self._comm.allreduce(apart, MPI.MAX), self._comm.allreduce(far, MPI.MAX)
        if not apart <= LAST_PLACES * np.finfo(float).eps * (self._size + far):  # else it is one, to the last place
            whole[self.dofs] = moved

    def _rigid(self, u: Floats) -> Floats:
        own, t = self.own, self._t
        mean = self._sum(t[own] @ u[own]) / self._whole
        around = u - np.outer(t, mean)
        R = self._rotation(around) if self._deforms else np.eye(self._dim) + self._spin(around)
        moved = mean - (R - np.eye(self._dim)) @ self._middle
        moved[list(self.face.held)] = 0.0
        self._arms = self._z @ R.T if self._deforms else self._z
        return np.asarray(self._z @ (R - np.eye(self._dim)).T + np.outer(t, moved))

    def _rotation(self, around: Floats) -> Floats:
        """R of the most tr(Rᵀ H), H = Σ (z + u) ⊗ z about the means: the nearest one (Kabsch)."""
        own = self.own
        H = self._sum((self._around[own] + around[own]).T @ self._around[own])
        if not np.all(np.isfinite(H)):
            return np.full_like(H, np.nan)
        if not self._turns:
            return np.eye(self._dim)
        if len(self._turns) == 1:
            (K,) = self._turns  # about an axis: R = I + sin φ K + (1 − cos φ) K²
            angle = np.arctan2(np.sum(K * H), -np.sum((K @ K) * H))
            return np.asarray(np.eye(self._dim) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)
        A, _, B = np.linalg.svd(H)
        A[:, -1] *= np.linalg.det(A @ B)
        return np.asarray(A @ B)

    def _spin(self, around: Floats) -> Floats:
        """ω × of the nearest u = ω × z about the means."""
        if not self._turns:
            return np.zeros((self._dim, self._dim))
        unit = np.array([(self._around[self.own] @ K.T).ravel() for K in self._turns])
        gram, side = self._sum(unit @ unit.T), self._sum(unit @ around[self.own].ravel())
        return np.einsum("k,kij->ij", np.linalg.solve(gram, side), np.array(self._turns))

    # -- the motions that are free -------------------------------------------------------------------------------------

    def motions(self) -> tuple[Floats, Floats]:
        """Those of the owned unknowns where it is now, orthonormal, and the factor L of their Gram matrix before.

        Shapes (owned nodes · dim, columns), (columns, columns): in terms of them forces f, given for each of the plain
        motions – a unit translation, a unit spin – are L⁻¹ f.
        """
        plain = np.zeros((self.own.sum(), self._dim, self.columns))
        for column, i in enumerate(self._free):
            plain[:, i, column] = self._t[self.own]
        for column, K in enumerate(self._turns, start=len(self._free)):
            plain[:, :, column] = self._arms[self.own] @ K.T
        plain = plain.reshape(plain.shape[0] * self._dim, self.columns)
        gram = self._sum(plain.T @ plain)
        if not np.all(np.isfinite(gram)):
            return np.full_like(plain, np.nan), np.eye(self.columns)
        L = np.linalg.cholesky(gram)
        return np.linalg.solve(L, plain.T).T, L

    def turning_stiffness(self, forces: Floats) -> Floats:
        """How the moments of forces on the owned nodes change as these turn with it, (columns, columns), plain motions.

        Moment about e_i, as it turns about e_j: Σ (e_i × (e_j × R z)) · f.
        """
        found, first = np.zeros((self.columns, self.columns)), len(self._free)
        if self._deforms:
            spread = self._sum(self._arms[self.own].T @ forces)  # Σ R z ⊗ f
            for i, K in enumerate(self._turns):
                for j, other in enumerate(self._turns):
                    found[first + i, first + j] = np.sum((K @ other) * spread.T)
        return found

    def generalised(self, moment: Floats) -> Floats:
        """A moment, (3,) or in the plane (1,), as forces of the plain motions, (columns,)."""
        return np.array([0.0] * len(self._free) + [float(axis @ moment) for axis in self.axes])

    def _sum(self, of_rank: Floats) -> Floats:
        return np.asarray(self._comm.allreduce(of_rank))


def _ones(x: Floats) -> Floats:
    return np.ones(x.shape[1])


def _entry(direction: int, x: Floats) -> Floats:
    return np.asarray(x[direction])


def _of(alone: dolfinx.fem.FunctionSpace, value: Callable[[Floats], Floats], nodes: Indices) -> Floats:
    moved = dolfinx.fem.Function(alone)
    moved.interpolate(value)
    return np.asarray(moved.x.array[nodes])


def _unknowns_of(
    boundary: str, mesh: Mesh, space: dolfinx.fem.FunctionSpace, alone: dolfinx.fem.FunctionSpace
) -> tuple[Indices, Indices]:
    """The unknowns of a boundary, (nodes, dim), and their nodes in the space of one component, rising, (nodes,)."""
    facets, dim = mesh.boundary(boundary), mesh.dim
    found: list[Indices] = []
    nodes: Indices = np.empty(0, dtype=np.int32)
    for i in range(dim):
        dofs, of_component = dolfinx.fem.locate_dofs_topological((space.sub(i), alone), dim - 1, facets)
        order = np.argsort(of_component)
        found.append(dofs[order])
        nodes = of_component[order]
    return np.column_stack(found), nodes
