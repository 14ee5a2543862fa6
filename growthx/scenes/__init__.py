"""The benchmark scenes: the paper's bar and femur, and a plate that scales."""

from growthx.scenes.plate import plate
