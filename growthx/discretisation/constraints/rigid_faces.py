"""The rigid faces of a scene: their unknowns follow few rigid motions, and only these have equations.

With G the rigid motions of a face where it is, made orthonormal, Q, and p what is out of balance at its nodes, the
equations are Qᵀ p = Qᵀ-components of the moments on it.  The system keeps its unknowns: an iterate is put to the
nearest rigid motion, and its rows hold Q Qᵀ p.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.errors import InputError
from growthx.discretisation.constraints.rigid_boundary import RigidBoundary
from growthx.model.actions.faces import Moment
from growthx.model.actions.histories import peak_of
from growthx.model.actions.rigid import RigidFace
from growthx.solvers.problem import Motions

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from growthx.common.arrays import Floats, Indices
    from growthx.discretisation.spaces import Spaces
    from growthx.discretisation.state import State
    from growthx.discretisation.unknowns import Unknowns
    from growthx.model.actions.histories import History
    from growthx.model.scene import Scene


class RigidFaces:
    """Those of all load cases.

    moments: of each face the moments on it at full load, with their histories.
    applied: their sum where the balance was last looked at, (3,) or in the plane (1,).
    """

    def __init__(self, spaces: Spaces, unknowns: Unknowns) -> None:
        scene = spaces.scene
        self._spaces, self._unknowns = spaces, unknowns
        found = [support for support in scene.supports if isinstance(support, RigidFace)]
        self.faces = [
            RigidBoundary(face, spaces, unknowns, case) for case in range(len(spaces.cases)) for face in found
        ]
        self.moments = [self._moments(face) for face in self.faces]
        self._columns = sum(face.columns for face in self.faces)
        self._forces: list[Floats] = [np.zeros(0) for _ in self.faces]  # out of balance at its nodes
        none = np.zeros(1 if scene.mesh.dim == 2 else 3)
        self.applied: list[Floats] = [none for _ in self.faces]

    def _moments(self, face: RigidBoundary) -> list[tuple[Floats, History | None]]:
        case = self._spaces.cases[face.case]
        on_it = [load for load in case.loads if isinstance(load, Moment) and load.on == face.face.on]
        return [(np.atleast_1d(np.array(load.moment, dtype=float)), load.history) for load in on_it]

    def refuse_what_is_shared(self, held: Iterable[tuple[str, int, Indices, bool]]) -> None:
        """Raise InputError where anything else holds unknowns of a face, too (collective).

        held: of each support its name, a direction, the unknowns, and whether it moves them.
        """
        counts = np.zeros(len(self._unknowns.function.x.array), dtype=int)
        for face in self.faces:
            counts[face.dofs] += 1
        shared = next((face.face.on for face in self.faces if np.any(counts[face.dofs] > 1)), "")
        problem = f"the rigid face '{shared}' shares nodes with another one" if shared else ""
        for name, direction, dofs, moves in held:
            for face in self.faces:
                stays = not face.face.turns and direction in face.face.held and not moves
                if not stays and np.isin(dofs, face.dofs).any():
                    problem = (
                        f"the rigid face '{face.face.on}' shares nodes with the support '{name}', which holds them "
                        f"along {'xyz'[direction]}"
                    )
        if sentence := next(filter(None, self._spaces.comm.allgather(problem)), None):
            raise InputError(f"{sentence}: a boundary whose nodes nothing else holds would be right")

    # -- what a step asks ----------------------------------------------------------------------------------------------

    def settle(self, whole: Floats) -> None:
        """Put an iterate, as `x.array`, to the nearest one in which the faces are rigid (collective)."""
        for face in self.faces:
            face.settle(whole)

    def turning(self, state: State) -> list[Floats]:
        """The moment on each face at the end of the running step, (3,) or in the plane (1,)."""
        return [self._at(moments, state.share_now) for moments in self.moments]

    def turning_at_peak(self) -> list[Floats]:
        """The same at full load and at the peaks of the histories."""
        timetable = self._spaces.scene.timetable
        return [self._at(moments, lambda history: peak_of(history, timetable)) for moments in self.moments]

    def _at(self, moments: list[tuple[Floats, History | None]], share: Callable[[History | None], float]) -> Floats:
        none = np.zeros(1 if self._spaces.scene.mesh.dim == 2 else 3)
        return np.asarray(sum((share(history) * moment for moment, history in moments), none))

    def reduce(self, forces: Floats, turning: list[Floats]) -> None:
        """Of forces at the nodes of faces, internal less external, leave what their motions feel, less these moments.

        forces: of the owned unknowns, in place (collective).
        """
        for number, (face, moment) in enumerate(zip(self.faces, turning, strict=True)):
            rows = face.dofs[face.own].ravel()
            self._forces[number] = np.asarray(forces[rows])
            self.applied[number] = moment
            Q, L = face.motions()
            wanted = self._spaces.cases[face.case].weight * np.linalg.solve(L, face.generalised(moment))
            felt = self._spaces.comm.allreduce(Q.T @ forces[rows]) - wanted
            forces[rows] = Q @ felt

    # -- as `solvers.problem.Following` --------------------------------------------------------------------------------

    def settled(self, values: Floats) -> Floats:
        """Owned unknowns, near to these values, in which the faces are rigid (collective)."""
        whole = self._unknowns.function.x.array.copy()
        whole[: len(values)] = values
        self.settle(whole)
        return np.asarray(whole[: len(values)])

    def motions(self) -> Motions:
        """What a solver needs of them where they are (collective)."""
        rows = np.concatenate([face.dofs[face.own].ravel() for face in self.faces])
        Q, curvature = np.zeros((len(rows), self._columns)), np.zeros((self._columns, self._columns))
        row = column = 0
        for face, forces in zip(self.faces, self._forces, strict=True):
            of_face, L = face.motions()
            here = slice(column, column + face.columns)
            Q[row : row + len(of_face), here] = of_face
            turned = face.turning_stiffness(forces.reshape(-1, face.dofs.shape[1]))
            curvature[here, here] = np.linalg.solve(L, np.linalg.solve(L, turned).T).T
            row, column = row + len(of_face), column + face.columns
        return Motions(rows.astype(np.int32), Q, curvature)


def is_of_a_rigid_face(load: Any, scene: Scene) -> bool:
    """Whether a load is the moment of a rigid face, which no nodal forces stand for."""
    rigid = (support.on for support in scene.supports if isinstance(support, RigidFace))
    return isinstance(load, Moment) and load.on in rigid
