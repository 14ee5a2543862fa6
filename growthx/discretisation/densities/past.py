"""The stimulus that a law with a memory has become used to, one value for each density.

    τ F' = S − F,        F(0) = S*

Implicit Euler in F, after each accepted step and by its stimulus: in a step F stands still.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
import ufl
from mpi4py import MPI

from growthx.common.errors import InputError
from growthx.constitutive.laws.remodelling import Remodelling
from growthx.discretisation.densities.local import with_mass_points
from growthx.fem.assembly import assemble

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.constitutive.energies import Elasticity
    from growthx.constitutive.sources import MassSource
    from growthx.discretisation.forms.momentum import Momentum
    from growthx.discretisation.spaces import Spaces
    from growthx.discretisation.state import State


def with_past(spaces: Spaces, state: State, growth: MassSource) -> MassSource:
    """The law in UFL, whose set point is what it has become used to if it has a memory; else as it is."""
    if not (isinstance(growth, Remodelling) and growth.remembers):
        return growth
    shares = _shares(spaces)
    start = _mean(spaces, shares, growth.set_point)
    state.past = dolfinx.fem.Function(spaces.density_space)
    state.past.x.array[:] = 1.0  # where nothing grows
    state.set_past(start)
    state.first_past = state.past.x.array.copy()
    return replace(growth, set_point=state.past)


class Past:
    """Brings what a law has become used to up to date."""

    def __init__(
        self, spaces: Spaces, state: State, momentum: Momentum, material: Elasticity, growth: Remodelling
    ) -> None:
        """material, growth: in UFL."""
        assert growth.memory is not None
        self._spaces, self._state, self._time = spaces, state, growth.memory
        stimulus = growth.stimulus(state.density, momentum.mean_energy(state.displacements), material)
        self._stimulus, self._shares = _form(spaces, stimulus), _shares(spaces)

    def follow(self, elapsed: float) -> None:
        """Remember the stimulus of the state, which it has had for a time (collective)."""
        assert self._state.past is not None
        dofs = self._spaces.growing_dofs
        stimulus = assemble(self._stimulus)[dofs] / self._shares
        past = self._state.past.x.array[dofs]
        self._state.set_past((self._time * past + elapsed * stimulus) / (self._time + elapsed))


def _form(spaces: Spaces, value: Any) -> dolfinx.fem.Form:
    volume = with_mass_points(spaces, spaces.growing_volume)
    return spaces.compile.form(value * ufl.TestFunction(spaces.density_space) * volume)


def _shares(spaces: Spaces) -> Floats:
    """∫ of the test function of each growing density; InputError where one has none to take a mean over."""
    shares = assemble(_form(spaces, 1.0))[spaces.growing_dofs]
    least = spaces.comm.allreduce(float(shares.min(initial=np.inf)), MPI.MIN)
    if least < 1e-9 * spaces.comm.allreduce(float(shares.max(initial=0.0)), MPI.MAX):
        raise InputError(
            f"{spaces.variant.name} has nodes to which no volume belongs, over which a remembered stimulus has no "
            "mean: densities of degree 1, or of cells or points, would be right"
        )
    return shares


def _mean(spaces: Spaces, shares: Floats, value: Any) -> Floats:
    return np.asarray(assemble(_form(spaces, value))[spaces.growing_dofs] / shares)
