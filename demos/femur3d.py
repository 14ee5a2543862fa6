"""The proximal femur in space under walking, one-legged stance and standing up: from uniform density to cortices, a
hollow canal, a strut from the head to the calcar and Ward's triangle.

    python demos/femur3d.py                     mpirun -n 2 python demos/femur3d.py

Leaves tables on the terminal and, in results/femur3d (or the next free name), fields for ParaView, the history as CSV
and pictures: the outside with the forces, and slices.  `growthx femur3d --help` tells what can be varied without
editing this file.
"""

import argparse

import numpy as np

import growthx as gx


def slices(bone):
    """Planes by a point and the normal, which points to the viewer: that of the neck, along the shaft and across it."""
    neck = np.cross(bone.neck, (0.0, 0.0, bone.lateral))  # turned by its version; x to the right, z upwards
    centre, shaft = (np.round(point, 1) + 0.0 for point in (bone.centre, bone.crossing + 0.6 * bone.depth * bone.shaft))
    return [(tuple(centre), tuple(neck)), (tuple(shaft), (1.0, 0.0, 0.0)), (tuple(shaft), (0.0, 0.0, 1.0))]


def main():
    parser = argparse.ArgumentParser(description="the proximal femur in space")
    parser.add_argument("--size", type=float, help="cell size in mm (that of meshes/femur3d.geo)")
    femur = gx.scenes.femur3d(size=parser.parse_args().size)
    folder = gx.results.free_folder("results/femur3d", femur.mesh.comm)
    with gx.report.progress(femur) as watch:
        result = gx.solve(femur, gx.P1P0, stepping=gx.AdaptiveSteps(1e-2), out=folder, watch=watch)

    means = {**gx.zones.area_means(result.problem, femur.zones), "whole bone": result.problem.mean_density()}
    gx.report.steps(result)
    gx.report.say(result, f"bone: {femur.anatomy}")
    gx.report.numbers(result, "mean density of anatomical zones", means, "g/cm³", femur.material.reference_density)
    gx.report.times(result)

    gx.plots.density(result.problem, folder / "density.png", title="density (g/cm³)")
    gx.plots.slices(result.problem, folder / "slices.png", slices(femur.anatomy), title="density (g/cm³)")
    gx.report.say(result, f"fields, history and pictures are in {folder}")


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
