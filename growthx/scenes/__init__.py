"""The benchmark scenes: the paper's bar and femur, and a plate and a block that scale."""

from typing import NoReturn

from growthx.common.errors import no_such_name
from growthx.scenes.bar import CONTINUOUS, DISCONTINUOUS, bar
from growthx.scenes.femur import Femur, femur
from growthx.scenes.plate import block, plate

__all__ = ["CONTINUOUS", "DISCONTINUOUS", "Femur", "bar", "block", "femur", "plate"]


def __getattr__(name: str) -> NoReturn:
    raise no_such_name("growthx.scenes", name, __all__)
