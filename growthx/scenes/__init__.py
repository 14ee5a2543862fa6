"""The benchmark scenes: the paper's bar and femur, a plate and a block that scale, femora in space and with a stem."""

from typing import NoReturn

from growthx.common.errors import no_such_name
from growthx.scenes.bar import CONTINUOUS, DISCONTINUOUS, bar
from growthx.scenes.bone_plate import bone_plate
from growthx.scenes.femur import Femur, femur
from growthx.scenes.femur3d import Femur3d, femur3d
from growthx.scenes.plate import block, plate
from growthx.scenes.stem import gruen, stem, stem_mesh

__all__ = [
    "CONTINUOUS",
    "DISCONTINUOUS",
    "Femur",
    "Femur3d",
    "bar",
    "block",
    "bone_plate",
    "femur",
    "femur3d",
    "gruen",
    "plate",
    "stem",
    "stem_mesh",
]


def __getattr__(name: str) -> NoReturn:
    raise no_such_name("growthx.scenes", name, __all__)
