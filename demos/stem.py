"""Bone around a press-fit stem: the plane femur grown to equilibrium, then with a bonded stem of titanium, and of
cobalt-chromium, in the same bone under the same loads, and what Gruen's zones lose.

    python demos/stem.py                        mpirun -n 2 python demos/stem.py

Leaves a table on the terminal and, in results/stem (or the next free name), a picture for each stem: the density at the
end, as it was carried into the mesh with the stem, and the difference.  `growthx stem --help` tells what can be varied
without editing this file.
"""

import growthx as gx
from growthx.scenes.stem import METALS, scaled

STEPPING = gx.AdaptiveSteps(1e-2, equilibrium=1e-3)


def main():
    intact = gx.solve(gx.scenes.femur(until=1000.0), gx.Q1P0, stepping=STEPPING)
    mesh = gx.scenes.stem_mesh()
    carried = gx.transfer(intact, mesh, gx.Q1P0, outside=1.2)
    folder = gx.results.free_folder("results/stem", mesh.comm)
    for metal, young in METALS.items():
        scene = gx.scenes.stem(mesh, carried, young=scaled(young), until=600.0)
        start = gx.loaded(scene, gx.Q1P0)
        result = gx.solve(scene, gx.Q1P0, stepping=STEPPING)
        zones = gx.shielding(intact, start, result)
        gx.report.table(
            f"bone around a stem of {metal} ({young:g} MPa), t = {result.time:g}: g/cm³ and MPa",
            next(iter(zones.values())).HEADER,
            [zone.row(name) for name, zone in zones.items()],
            mesh.comm,
        )
        gx.compare(result, carried, picture=folder / f"{metal}.png", labels=(f"with {metal}", "intact"))
    gx.report.say(result, f"the pictures are in {folder}")


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
