"""The benchmark scenes: the paper's bar and femur, a femur with a stem, and a plate that scales."""

from typing import NoReturn

from growthx.common.errors import no_such_name
from growthx.scenes.bar import CONTINUOUS, DISCONTINUOUS, bar
from growthx.scenes.femur import Femur, femur
from growthx.scenes.plate import plate
from growthx.scenes.stem import gruen, stem, stem_mesh

__all__ = ["CONTINUOUS", "DISCONTINUOUS", "Femur", "bar", "femur", "gruen", "plate", "stem", "stem_mesh"]


def __getattr__(name: str) -> NoReturn:
    raise no_such_name("growthx.scenes", name, __all__)
