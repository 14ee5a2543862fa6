"""Bone around a press-fit stem in space: the femur grown to equilibrium, walking, then with a bonded stem of titanium,
of cobalt-chromium and, as a check, of bone, in the same cells under the same loads, and what Gruen's zones lose.

    python demos/stem3d.py                      mpirun -n 2 python demos/stem3d.py

Leaves a table for each on the terminal and, in results/stem3d (or the next free name), a picture for each metal: the
density at the end, as it was before, and the difference.  `growthx stem3d --help` tells what can be varied without
editing this file.
"""

import argparse

import growthx as gx
from growthx.scenes.stem import METALS

STEPPING = gx.AdaptiveSteps(1e-2, equilibrium=1e-3)


def main():
    parser = argparse.ArgumentParser(description="bone around a stem in space")
    parser.add_argument("--size", type=float, default=6.0, help="cell size in mm")
    size = parser.parse_args().size
    # The intact femur has the cells of that with the stem: nothing changes by a change of mesh.
    whole, body = (gx.scenes.stem3d_mesh(size=size, natural=natural) for natural in (True, False))
    femur = gx.scenes.femur3d(whole, weights=(1.0, 0.0, 0.0), until=200.0)
    intact = gx.solve(femur, gx.P2, stepping=STEPPING)
    folder = gx.results.free_folder("results/stem3d", whole.comm)
    for name, young in {**METALS, "bone": None}.items():
        mesh = whole if young is None else body
        scene = gx.scenes.stem3d(femur, mesh, gx.transfer(intact, mesh, gx.P2), young=young)
        start = gx.loaded(scene, gx.P2)
        result = gx.solve(scene, gx.P2, stepping=STEPPING)
        zones = gx.shielding(intact, start, result)
        gx.report.table(
            f"bone around a stem of {name}, t = {result.time:g} ({result.ended}): g/cm³ and MPa",
            next(iter(zones.values())).HEADER,
            [zone.row(zone_name) for zone_name, zone in zones.items()],
            mesh.comm,
        )
        if young is not None:
            gx.compare(result, intact, picture=folder / f"{name}.png", labels=(f"with {name}", "intact"))
    gx.report.say(result, f"the pictures are in {folder}")


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
