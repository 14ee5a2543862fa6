"""What suppresses checkerboards: averages of the source or of the density over neighbours."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from growthx.common.checks import require_number
from growthx.common.errors import InputError, shown
from growthx.common.overrides import Sealed
from growthx.discretisation.variants import right_ones
from growthx.post.smoothing import corner_functions, smoothed_density

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation


FAR = 5.0  # radii beyond which a neighbour does not count: its weight is below 1 %


class Averaging(Protocol):
    """A way to average values that belong to densities.

    Example:
        >>> class Nothing:  # an average that leaves all as it is
        ...     def on(self, problem):
        ...         return lambda values: values
        >>> scene = gx.scenes.plate(2)
        >>> plain, *_ = gx.baselines.update(scene, gx.Q1P0)
        >>> same, *_ = gx.baselines.update(scene, gx.Q1P0, source_average=Nothing())
        >>> plain.mass == same.mass
        True
    """

    def on(self, problem: Discretisation) -> Callable[[Floats], Floats]:
        """The average on a problem: of values of this rank's growing densities, (densities,), to values of the same."""
        ...


@dataclass(frozen=True)
class NonLocal(Sealed, replaceable=("on", "weights")):
    """Mean over the neighbourhood by volume and by exp(−distance/radius) (Mullender et al. 1994, J. Biomech. 27, 1389).

    There the sensors' excess over the attractor is averaged, which is what the mass source is in proportion to; for a
    uniform attractor this is the average of the stimulus.  radius: length over which the influence falls to 1/e.

    Example:
        >>> gx.baselines.NonLocal(radius=0.25).radius
        0.25
    """

    radius: float

    def __post_init__(self) -> None:
        require_number(self.radius, "the radius of the average", "a positive number", lambda r: r > 0)

    def weights(self, problem: Discretisation) -> csr_array:
        """Shares of all ranks' densities in the means of this one's, shape (densities, all densities); rows sum to one.

        Times volume and the row's sum of influences, they are symmetric.
        """
        here = problem.density_positions()[problem.growing_dofs]
        everywhere = np.concatenate(problem.comm.allgather(here))
        volumes = np.concatenate(problem.comm.allgather(problem.volumes[problem.growing_dofs]))
        near = KDTree(here).sparse_distance_matrix(KDTree(everywhere), FAR * self.radius, output_type="ndarray")
        influence = np.exp(-near["v"] / self.radius) * volumes[near["j"]]
        total = np.bincount(near["i"], influence, minlength=len(here))
        shares = influence / total[near["i"]]
        return csr_array((shares, (near["i"], near["j"])), shape=(len(here), len(everywhere)))

    def on(self, problem: Discretisation) -> Callable[[Floats], Floats]:
        """The average on a problem."""
        weights, comm = self.weights(problem), problem.comm
        return lambda values: np.asarray(weights @ np.concatenate(comm.allgather(values)))


@dataclass(frozen=True)
class Smoothed(Sealed, replaceable=("on",)):
    """Extrapolated to the corners of the cells, averaged there over the cells, and put back into the cells.

    Example:
        >>> smoothed = gx.baselines.Smoothed()
        >>> *_, last = gx.baselines.update(gx.scenes.plate(4), gx.Q1P0, density_average=smoothed)
        >>> f"t = {last.time:g}: density from {last.min_density:.3f} to {last.max_density:.3f}"
        't = 2.5: density from 0.575 to 0.799'
    """

    def on(self, problem: Discretisation) -> Callable[[Floats], Floats]:
        """The average on a problem; InputError if densities are at nodes, smooth already."""
        variant, space = problem.variant, problem.density_space
        if not variant.density.local:
            right = right_ones(problem.scene.mesh.cell_name, lambda other: other.density.local)
            raise InputError(f"{variant.name} has densities at nodes, which smoothing leaves as they are: {right}")
        places = space.dofmap.list[: len(problem.scene.mesh.owned_cells)]
        shares = corner_functions(problem)

        def smooth(values: Floats) -> Floats:
            back = problem.density.x.array.copy()
            back[problem.growing_dofs] = values
            corners = smoothed_density(problem, of_cells=back[places])
            back[places] = corners.x.array[corners.function_space.dofmap.list[: len(places)]] @ shares.T
            return back[problem.growing_dofs]

        return smooth


def check_averages(**averages: Any) -> None:
    """Refuse what is no `Averaging`; None stands for none."""
    for name, average in averages.items():
        if average is not None and (isinstance(average, type) or not callable(getattr(average, "on", None))):
            raise InputError(f"{name} is {shown(average)}: NonLocal(radius), Smoothed() or None would be right")
