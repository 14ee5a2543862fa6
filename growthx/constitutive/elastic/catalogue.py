"""Stored energies by their names, as the command line has them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from growthx.common.errors import InputError, shown
from growthx.constitutive.elastic.isotropic import Hencky, MooneyRivlin, Ogden, SaintVenantKirchhoff
from growthx.constitutive.elastic.small_strain import LinearElasticity
from growthx.constitutive.material import Material

if TYPE_CHECKING:
    from growthx.constitutive.elastic.base import ByModuli

NAMED: dict[str, type[ByModuli]] = {
    "neo-hooke": Material,
    "saint-venant-kirchhoff": SaintVenantKirchhoff,
    "hencky": Hencky,
    "mooney-rivlin": MooneyRivlin,
    "ogden": Ogden,
    "linear": LinearElasticity,
}


def named(name: str) -> type[ByModuli]:
    """The energy of a name; InputError, with the names there are, if there is none."""
    if name not in NAMED:
        raise InputError(f"there is no stored energy {shown(name)}: one of {', '.join(NAMED)} would be right")
    return NAMED[name]
