"""The proximal femur in space under walking, one-legged stance and standing up: from uniform density to cortices, a
hollow canal, a strut from the head to the calcar and Ward's triangle.

    python demos/femur3d.py                     mpirun -n 2 python demos/femur3d.py

Leaves tables on the terminal and, in results/femur3d (or the next free name), fields for ParaView, the history as CSV
and a picture of slices.  `growthx femur3d --help` tells what can be varied without editing this file.
"""

import argparse

import numpy as np

import growthx as gx

PIXELS = 3  # to a mm
FORWARD, UP = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])


def slices(bone):
    """By title and the direction to the right: a place, that direction and the one up, how far along each (mm)."""
    lateral = np.array([bone.lateral, 0.0, 0.0])
    along = bone.neck * (1, 1, 0) / np.linalg.norm(bone.neck[:2])  # the neck's plane is turned by its version
    shaft = bone.crossing + 0.6 * bone.depth * bone.shaft
    low = bone.crossing[2] - bone.depth - bone.centre[2] - 5
    across = (-25, 25)
    tall = (low, 30)
    return {
        ("in the neck's plane", "laterally"): (bone.centre, along, UP, (-30, 75), tall),
        ("along the shaft", "anteriorly"): (shaft + UP * (bone.centre - shaft), FORWARD, UP, (-35, 30), tall),
        (f"across, {-shaft[2]:.0f} mm below", "laterally"): (shaft, lateral, FORWARD, across, across),
    }


def sampled(problem, place, right, up, widths, heights):
    """Densities on a grid, (rows, columns) from the lower left; NaN outside the bone."""
    x, y = (np.arange(*ends, 1 / PIXELS) + 0.5 / PIXELS for ends in (widths, heights))
    places = place + np.multiply.outer(y, up)[:, np.newaxis] + np.multiply.outer(x, right)
    return problem.sample_density(places.reshape(-1, 3)).reshape(len(y), len(x))


def picture(problem, path):
    """Draw slices of the density at rest (collective)."""
    panels = slices(problem.scene.anatomy)
    images = [sampled(problem, *panel) for panel in panels.values()]
    if problem.comm.rank:
        return
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 7.5), layout="constrained")
    FigureCanvasAgg(figure)
    widths = [np.ptp(panel[3]) for panel in panels.values()]
    for axes, image, ((title, right), panel) in zip(
        figure.subplots(1, len(panels), width_ratios=widths), images, panels.items(), strict=True
    ):
        shown = axes.imshow(image, origin="lower", extent=(*panel[3], *panel[4]), vmin=0, vmax=2.1, cmap="viridis")
        axes.set(title=title, xlabel=f"{right} (mm)")
    figure.colorbar(shown, ax=figure.axes, label="density (g/cm³)", shrink=0.6)
    figure.savefig(path, dpi=100)


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

    picture(result.problem, folder / "density.png")
    gx.report.say(result, f"fields, history and a picture are in {folder}")


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
