"""A density made for one mesh and one kind of densities, with all digits: what the start of a run may be given."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.errors import InputError

if TYPE_CHECKING:
    import dolfinx

    from growthx.common.arrays import Floats
    from growthx.meshing.mesh import Mesh


class TransferredDensity:
    """A density of another run, as `transfer` makes it for a mesh and a variant: an `initial_density` of these alone.

    It may also be the value of a region in a mapping.

    name: of the run and of what it was made for, in words.  variant: name of that variant.
    correction: mean change, relative, that gave it the mass of the run; NaN if the bodies differ, zero for a density
    that is the run's own.
    beside: share of the volume that lies beside the run's body, but near, and has the density of the nearest point.
    outside: share of the volume that has the density that was given for what lies farther off.
    exact: whether it has all digits of the run.
    """

    def __init__(
        self,
        function: dolfinx.fem.Function,
        own: dolfinx.fem.Function,
        *,
        mesh: Mesh,
        variant: str,
        origin: str,
        facts: dict[str, Any],
    ) -> None:
        """function: with the variant's densities; own: with those that each cell has by itself."""
        self.mesh, self.variant, self.origin = mesh, variant, origin
        self._function, self._own = function, own
        self.correction: float = facts["correction"]
        self.beside: float = facts["beside"]
        self.outside: float = facts["outside"]
        self.exact: bool = facts["exact"]

    def __repr__(self) -> str:
        facts = [self.name]
        facts += ["to the bit"] if self.exact else []
        facts += [f"corrected by {self.correction:.1e} for its mass"] if self.correction > 0 else []
        facts += [f"{100 * self.beside:.2g} % of the volume beside the body"] if self.beside else []
        facts += [f"{100 * self.outside:.2g} % of the volume outside"] if self.outside else []
        return f"TransferredDensity({', '.join(facts)})"

    @property
    def name(self) -> str:
        """Of what it is."""
        return f"density of {self.origin} for {self.variant}"

    # As fields of DOLFINx: who asks for the element or the values of a field need not know of this one.
    @property
    def function_space(self) -> dolfinx.fem.FunctionSpace:
        """Of its densities."""
        return self._function.function_space

    @property
    def x(self) -> Any:
        """Its densities, as of a DOLFINx function."""
        return self._function.x

    @property
    def own_space(self) -> dolfinx.fem.FunctionSpace:
        """Of densities that each cell has by itself."""
        return self._own.function_space

    def on(self, mesh: Mesh) -> dolfinx.fem.Function:
        """As a DOLFINx function, in which each cell has its own; InputError for another mesh than its own."""
        if self.mesh.domain is not mesh.domain:
            raise InputError(
                f"the {self.name} was made for another mesh: transfer(…, mesh, variant) with the scene's mesh would be "
                "right"
            )
        return self._own

    def of_cells(self) -> Floats:
        """Densities of the owned cells, (owned cells, densities of a cell)."""
        cells = len(self.mesh.owned_cells)
        return np.asarray(self._own.x.array[self._own.function_space.dofmap.list[:cells]])
