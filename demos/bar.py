"""The paper's two bars in tension (sections 4.4 and 5.4), in each discretisation, against the semi-analytic density.

    python demos/bar.py

Leaves the paper's readings on the terminal and a plot of density over length for each problem in results/bar (or the
next free name).
"""

import growthx as gx
from growthx.scenes.bar import PROBLEMS, end_displacement, equilibrium, lower_edge, midpoint_density_change


def main():
    folder = None
    for problem in PROBLEMS.values():
        bar = gx.scenes.bar(problem, elements=40)
        folder = folder or gx.results.free_folder("results/bar", bar.mesh.comm)
        results = {variant.name: gx.solve(bar, variant) for variant in gx.variants.suited(bar.mesh.cell_name)}
        gx.report.table(
            f"{bar.name}, 40 elements, t = {bar.program.until:g}",
            ("", "density change at mid-length", "end displacement", "unknowns"),
            [
                (
                    name,
                    f"{midpoint_density_change(result.problem):.6f}",
                    f"{end_displacement(result.problem):.5f}",
                    f"{result.problem.dofs}",
                )
                for name, result in results.items()
            ],
            bar.mesh.comm,
        )
        gx.plots.along_length(
            {name: result.problem for name, result in results.items()},
            folder / f"{problem.name}.png",
            lower_edge(problem),
            exact={"semi-analytic": lambda x, bar=bar, problem=problem: equilibrium(bar, problem, x).density},
        )
    gx.report.say(results["Q1"], f"the plots are in {folder}")


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
