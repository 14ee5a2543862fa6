"""Nodes about which the balance of mass is lumped, storage and source, so that their densities stay positive.

The balance holds between shape functions, not at each node: beside a steep slope the source of a cell goes on
resorbing what its emptiest node no longer has, and a nodal density falls below zero although the model, m > n, forbids
it.  Lumped in all cells around a node, its balance is that of a point,

    Mᵢ [ρᵢ − ρₙᵢ]/Δt = Σ Mᵢᵉ R₀(ρᵢ, Ψ₀ᵉ)        with the masses Mᵢᵉ of the cells around it (Remark 4.3),

and R₀ → ∞ as ρᵢ → 0 where there is energy: it has a positive solution.  Everywhere else nothing changes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
import ufl

from growthx.fem.assembly import assemble, average_cells

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Marks
    from growthx.discretisation.forms.mass import Mass
    from growthx.discretisation.spaces import Spaces
    from growthx.discretisation.state import State
    from growthx.discretisation.unknowns import Unknowns

RELAPSE = 0.5  # share of its density that a node, no longer lumped, must keep in the first step
RECOVERED = 0.5  # of the mean of the cells around it: a density beside which the slope is no longer steep


class LumpedNodes:
    """Which nodes are lumped, and the forms of what that changes.

    residuals, tangents: compiled forms to be added to the balance; empty as long as no node is lumped.
    """

    def __init__(self, spaces: Spaces, state: State, unknowns: Unknowns, mass: Mass, test: Any) -> None:
        """test: function of the balance of mass, in the units of the system."""
        self._spaces, self._unknowns, self._mass, self._test = spaces, unknowns, mass, test
        self._lumped: Marks = np.zeros(len(state.density.x.array), dtype=bool)
        self._on_trial = np.zeros_like(self._lumped)  # nodes that are not lumped to see whether that is needed
        self._forms: tuple[list[dolfinx.fem.Form], list[dolfinx.fem.Form]] | None = None
        self._where: dolfinx.fem.Function | None = None
        self.residuals: list[dolfinx.fem.Form] = []
        self.tangents: list[dolfinx.fem.Form] = []
        self.cells = 0  # in which the balance is lumped, on all ranks

    def spread(self, vanishing: Marks) -> bool:
        """Lump about more nodes, marks as in `density.x.array`; whether any of them was not (collective)."""
        new = self._spaces.comm.allreduce(int(np.count_nonzero(vanishing & ~self._lumped)))
        if new:
            self._set(self._lumped | vanishing)
        return bool(new)

    def relapses(self, density: Floats, before: Floats) -> Marks:
        """Nodes on trial whose density has fallen, marks as in `x.array`."""
        return self._on_trial & ~(density > RELAPSE * before)

    def try_without(self) -> None:
        """Stop everywhere for a step, to see whether lumping is needed (collective)."""
        self._on_trial = self._lumped
        self._set(np.zeros_like(self._lumped))

    def release(self, density: Floats) -> None:
        """Stop about nodes whose density, as in `x.array`, has recovered; trials are over (collective)."""
        self._on_trial = np.zeros_like(self._lumped)
        if not self.cells:
            return
        space = self._spaces.density_space
        of_cells = density[space.dofmap.list[: len(self._spaces.scene.mesh.owned_cells)]]
        around = average_cells(space, np.repeat(of_cells.mean(axis=1)[:, np.newaxis], of_cells.shape[1], axis=1))
        self._set(self._lumped & (density < RECOVERED * around.x.array))

    def memory(self) -> Floats:
        """One at the nodes that are lumped, as in `density.x.array`."""
        return self._lumped.astype(np.float64)

    def recall(self, lumped: Floats) -> None:
        """Lump about these nodes and no others; of an empty array, about none (collective)."""
        self._set(lumped > 0 if len(lumped) else np.zeros_like(self._lumped))

    def supplied(self) -> float:
        """Mass per time that lumping adds to the source, times the scale of the test function (collective)."""
        part = self._unknowns.density_part
        assert part is not None
        here = part[part < self._unknowns.owned]
        return self._spaces.comm.allreduce(-sum(float(assemble(form)[here].sum()) for form in self.residuals))

    def places(self) -> list[tuple[Any, ufl.Measure]]:
        """Where the source asks for energies at the nodes: a condition in UFL, None for all, and the measure."""
        if self._spaces.variant.source_at_corners:
            return [(None, self._mass.nodes)]
        if not self.cells or self._where is None:
            return []
        return [(ufl.gt(self._where, 0.5), self._mass.nodes)]

    def _set(self, lumped: Marks) -> None:
        self._lumped = lumped
        space = self._spaces.density_space
        count = len(self._spaces.scene.mesh.owned_cells)
        cells = lumped[space.dofmap.list].any(axis=1)
        self.cells = self._spaces.comm.allreduce(int(np.count_nonzero(cells[:count])))
        if self.cells and self._forms is None:
            self._forms = self._compile()
        self.residuals, self.tangents = self._forms if self.cells and self._forms else ([], [])
        if self._where is not None:
            self._where.x.array[:] = cells

    def _compile(self) -> tuple[list[dolfinx.fem.Form], list[dolfinx.fem.Form]]:
        domain = self._spaces.scene.mesh.domain
        self._where = dolfinx.fem.Function(dolfinx.fem.functionspace(domain, ("DG", 0)))
        forms = self._mass.lumped_instead(self._test, ufl.gt(self._where, 0.5))
        compile, function = self._spaces.compile, self._unknowns.function
        # In plane stress, too: the thickness that makes the energy least is no part of the slope of the source.
        return (
            [compile.form(form) for form in forms],
            [compile.form(ufl.derivative(form, function)) for form in forms],
        )
