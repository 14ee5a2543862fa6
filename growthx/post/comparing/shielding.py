"""What an implant takes from the bone around it: densities and strain energies of zones, before and after."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from growthx.common.errors import InputError
from growthx.discretisation.checks.arguments import require_problem
from growthx.discretisation.transfers.samples import means_of_cells
from growthx.post.derived import cell_fields
from growthx.post.zones import area_means

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation

ENERGY = "strain_energy"


@dataclass(frozen=True)
class Shielding:
    """Means over what grows in a zone around an implant.

    density_before, density_after: as it was carried to the implant, and at the end.
    energy_intact: strain energy per volume of the same places before there was an implant; energy_before: with it, at
    once, at the density that was carried; energy_after: at the end.

    Example:
        >>> from growthx.post.comparing.shielding import Shielding
        >>> f"{Shielding(1.6, 1.2, 0.02, 0.008, 0.012).change:.0%}"
        '-25%'
    """

    HEADER: ClassVar = ("zone", "density before", "after", "change", "energy intact", "energy at once", "energy after")

    density_before: float
    density_after: float
    energy_intact: float
    energy_before: float
    energy_after: float

    @property
    def change(self) -> float:
        """Of density, relative."""
        return self.density_after / self.density_before - 1

    def row(self, name: str) -> tuple[str, ...]:
        """Of a table, with `HEADER` above it."""
        densities = f"{self.density_before:.3f}", f"{self.density_after:.3f}", f"{self.change:+.1%}"
        energies = (f"{energy:.4f}" for energy in (self.energy_intact, self.energy_before, self.energy_after))
        return name, *densities, *energies


def shielding(intact: Any, start: Any, end: Any, zones: Mapping[str, Any] | None = None) -> dict[str, Shielding]:
    """What becomes of the bone in the zones around an implant, by name (collective).

    intact: the run, or its discretisation, before there is an implant.  start: what `gx.loaded` makes of the scene with
    the implant.  end: the run of that scene.
    zones: as for `zones.area_means`; default: the scene's.
    Of what grows in the mesh with the implant alone, before and after: bone that was taken out for it does not count.
    Raises InputError if start and end are of two meshes, and if a zone reaches where there was no bone.

    Example:
        >>> scene = gx.scenes.plate(2)
        >>> result = gx.solve(scene, gx.Q1P0)
        >>> left = {"left": [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]}
        >>> found = gx.shielding(result, gx.loaded(scene, gx.Q1P0), result, left)["left"]
        >>> f"{found.density_before:.3f}, {found.density_after:.3f}; {found.energy_intact / found.energy_after:.6f}"
        '1.000, 0.751; 1.000000'
    """
    before, first, last = (require_problem(each) for each in (intact, start, end))
    if first.scene.mesh.domain is not last.scene.mesh.domain:
        raise InputError(
            f"'{first.scene.name}' and '{last.scene.name}' are on two meshes: the scene before and after growth, on "
            "one mesh with the implant, would be right"
        )
    if zones is None:
        zones = getattr(last.scene, "zones", {})
    was = means_of_cells(before, _energies(before), last.scene.mesh, last.growing_cells)
    columns = [
        area_means(first, zones),
        area_means(last, zones),
        *(area_means(last, zones, values=values) for values in (was, _energies(first), _energies(last))),
    ]
    return {name: Shielding(*(column[name] for column in columns)) for name in columns[0]}


def _energies(problem: Discretisation) -> Floats:
    """Strain energy per volume of the owned cells."""
    return cell_fields(problem, (ENERGY,))[ENERGY]
