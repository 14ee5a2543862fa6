"""The picture of docs/models.md: the mass source against the density, of each law at a few energies.

python docs/models.py
"""

from pathlib import Path

import matplotlib
import numpy as np

import growthx as gx

matplotlib.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
MATERIAL = gx.Material(young=1.0, poisson=0.2, reference_density=1.0, density_exponent=2.0)
ENERGIES = (0.005, 0.01, 0.02)
LAWS = {  # all at rest at ρ* and an energy of 0.01
    "EnergyDrivenGrowth, m = 3 > n": gx.EnergyDrivenGrowth(0.01),
    "SpecificEnergyDrivenGrowth: m = 1 < n": gx.SpecificEnergyDrivenGrowth(0.01),
    "StrainDrivenGrowth, m = 1": gx.StrainDrivenGrowth(np.sqrt(0.02), 0.1),
    "StressDrivenGrowth, m = 3": gx.StressDrivenGrowth(np.sqrt(0.02), 0.1),
    "EnergyRemodelling, zone ± 0.3 S*,\n1 up and 0.4 down": gx.EnergyRemodelling(0.01, 1.0, 0.4, relative_zone=0.3),
    "… saturated at 0.01 and 0.002": gx.EnergyRemodelling(
        0.01, 1.0, 0.4, relative_zone=0.3, most_formation=0.01, most_resorption=0.002
    ),
    "… with Martin's surface": gx.EnergyRemodelling(0.01, 1.0, 0.4, relative_zone=0.3, factor=gx.MartinSurface(1.92)),
    "DailyStressRemodelling, q = 3,\nzone ± 0.1 ψ*": gx.DailyStressRemodelling(
        np.sqrt(0.02) * 1.92**3, 0.01, 0.01, concentration=3.0, relative_zone=0.1
    ),
}


def main():
    """Draw it."""
    density = np.linspace(0.3, 2.0, 400)
    figure, panels = plt.subplots(2, 4, figsize=(15, 7), sharex=True, layout="constrained")
    for axes, (name, law) in zip(panels.flat, LAWS.items(), strict=True):
        for energy, colour in zip(ENERGIES, ("#56b4e9", "#0072b2", "#d55e00"), strict=True):
            label = f"Ψ₀ⁿᵉᵒ = {energy:g} E"
            axes.plot(density, law.mass_source(density, energy, MATERIAL), color=colour, label=label)
        axes.axhline(0.0, color="0.5", linewidth=0.8)
        axes.set_title(name, fontsize="medium")
        axes.grid(color="0.92")
    for axes in panels[1]:
        axes.set_xlabel("density ρ/ρ*")
    for axes in panels[:, 0]:
        axes.set_ylabel("mass source R₀")
    panels[0, 0].legend(frameon=False)
    figure.savefig(HERE / "models.png", dpi=90)


if __name__ == "__main__":
    main()
