"""The proximal femur under the loads of walking and of extreme ab- and adduction, from uniform density to a strut,
an arcuate system, Ward's triangle, cortices and a canal (the paper's section 6).

    python demos/femur.py                       mpirun -n 2 python demos/femur.py

Leaves tables on the terminal and, in results/femur (or the next free name), fields for ParaView, the history as CSV and
pictures of the density and of its relative change.  `growthx femur --help` tells what can be varied without editing
this file.
"""

import growthx as gx
from growthx.scenes.femur import zones


def main():
    femur = gx.scenes.femur()
    folder = gx.results.free_folder("results/femur", femur.mesh.comm)
    with gx.report.progress(femur) as watch:
        result = gx.solve(femur, gx.Q1P0, out=folder, watch=watch)

    means = {**gx.zones.area_means(result.problem, zones()), "whole bone": result.problem.mean_density()}
    gx.report.steps(result)
    gx.report.numbers(result, "mean density of anatomical zones", means, "g/cm³", femur.material.reference_density)
    gx.report.times(result)

    gx.plots.density(result.problem, folder / "density.png", title="density (g/cm³)")
    gx.plots.density(result.problem, folder / "change.png", relative=True, scale="density (g/cm³)")  # as the paper
    gx.report.say(result, f"fields, history and pictures are in {folder}")


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
