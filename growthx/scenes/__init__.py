"""The benchmark scenes: the paper's bar and femur, and a plate that scales."""

from growthx.scenes.bar import bar
from growthx.scenes.femur import femur
from growthx.scenes.plate import plate

__all__ = ["bar", "femur", "plate"]
