"""The benchmark scenes: the paper's bar and femur, plates and a block, femora in space and with a stem."""

from typing import NoReturn

from growthx.common.errors import no_such_name
from growthx.scenes.bar import CONTINUOUS, DISCONTINUOUS, bar
from growthx.scenes.bone_plate import bone_plate
from growthx.scenes.femur import Femur, femur
from growthx.scenes.femur3d import Femur3d, femur3d
from growthx.scenes.plate import block, plate
from growthx.scenes.stem import gruen, stem, stem_mesh
from growthx.scenes.stem3d import stem3d, stem3d_mesh
from growthx.scenes.weinans import weinans_plate

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
    "stem3d",
    "stem3d_mesh",
    "stem_mesh",
    "weinans_plate",
]


def __getattr__(name: str) -> NoReturn:
    raise no_such_name("growthx.scenes", name, __all__)
