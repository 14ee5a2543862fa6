"""What the map of exponents says."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from benchmarks.shared.reporting import Table
from benchmarks.stability import exponents
from benchmarks.stability.findings.words import HEALED, finished, is_local, middle, most, named, number, set_minus
from benchmarks.stability.study import BODIES, CRASHED, EMPTIED, FINISHED, VARIANTS

SIDES: dict[str, Callable[[float, float], bool]] = {
    "m > n": lambda m, n: m > n,
    "m = n": lambda m, n: m == n,
    "m < n": lambda m, n: m < n,
}


def fine(rows: Iterable[exponents.Row]) -> list[exponents.Row]:
    """Those on the finer meshes."""
    known = list(rows)
    most_cells = {row.body: max(each.cells for each in known if each.body == row.body) for row in known}
    return [row for row in known if row.cells == most_cells[row.body]]


def about_exponents(rows: Sequence[exponents.Row]) -> list[str]:
    """What the map says."""
    if not rows:
        return []
    plain = [row for row in rows if row.variant in VARIANTS]
    well = [row for row in plain if row.well_posed]
    local, nodal = ([row for row in well if is_local(row.variant) is kind] for kind in (True, False))
    lost = [row for row in well if row.ended != FINISHED]
    said = [
        f"**m > n**: {finished(local)} marches with densities at points or in cells come to their end, and "
        f"{finished(nodal)} with densities at nodes."
    ]
    if lost:
        where = named(f"{row.variant} (m = {row.m:g}, n = {row.n:g}, {row.body})" for row in lost)
        emptied = sum(row.ended == EMPTIED for row in lost)
        said.append(
            f"What is lost: {where}. In {emptied} of these {len(lost)} a nodal density falls to zero. "
            "So m > n does not protect densities at nodes by itself: the balance of mass holds "
            "between shape functions, not at each node."
        )
    helped = [row for row in well if row.lumped]
    if helped:
        where = named(f"{row.variant} (m = {row.m:g}, n = {row.n:g}, {row.body})" for row in helped)
        said.append(
            f"In {len(helped)} of them, {where}, a nodal density would vanish, and the balance of mass is lumped about "
            f"its node, in at most {most(helped, 'lumped_cells'):.1%} of the cells: m > n does not protect densities "
            "at nodes by itself, since the balance holds between shape functions, not at each node. In the other "
            f"{len(nodal) - len(helped)} nothing is lumped anywhere."
        )
    healed = [row for row in rows if row.variant in HEALED]
    if healed:
        said.append(
            f"With the balance of mass lumped at the nodes, source included (Remark 4.3), {finished(healed)} of Q1Q1 "
            "and S2Q1 come to their end."
        )
    for side in ("m = n", "m < n"):
        these = [row for row in plain if SIDES[side](row.m, row.n)]
        bent = [row for row in these if row.body != "bar"]
        crashed = sum(row.ended == CRASHED for row in these)
        said.append(
            f"**{side}**: {finished(bent)} on plate and femur, {finished(set_minus(these, bent))} on the bar"
            + (f"; {crashed} ended in {CRASHED} instead of a sentence." if crashed else ".")
        )
    worst = {
        side: most((row for row in fine(plain) if SIDES[side](row.m, row.n) and row.body != "bar"), "noise")
        for side in SIDES
    }
    said.append(
        "The high-frequency part of the checkerboard index is, on the finer meshes of plate and femur, at most "
        + ", ".join(f"{value:.2g} for {side}" for side, value in worst.items())
        + ". Without bounds of density most marches without m > n end before a checkerboard has formed: when the first "
        "density vanishes."
    )
    said.append(
        "Densities on the two meshes differ by (median, largest) "
        + ", ".join(
            f"{middle(these, 'other_mesh'):.1%}, {most(these, 'other_mesh'):.1%} for {side}"
            for side in SIDES
            if (these := [row for row in fine(plain) if SIDES[side](row.m, row.n)])
        )
        + "."
    )
    return said


def exponents_table(rows: Sequence[exponents.Row]) -> Table:
    """By m and n."""
    cells = []
    for n in exponents.N:
        for m in exponents.M:
            cells.append([f"{m:g}, {n:g}" + ("" if m > n else " (not m > n)")])
            for body in BODIES:
                these = [row for row in rows if (row.body, row.n, row.m) == (body, n, m) and row.variant in VARIANTS]
                ended = [row.time for row in these if row.ended != FINISHED]
                cells[-1] += [
                    finished(these) + (f", from t = {min(ended):.3g}" if ended else ""),
                    number(most(fine(these), "noise")),
                    f"{most(these, 'empty') + 0:.0%}",
                    f"{most(these, 'other_mesh'):.1%}",
                ]
    header = ["m, n"]
    for body in BODIES:
        header += [f"{body}: finished", "noise", "empty", "meshes differ"]
    notes = (
        "Finished, of eight discretisations on two meshes, and the earliest end of the others. The bar's marches are "
        "to end at t = 6, the plate's at 10, the femur's at 160.",
        "Noise: the high-frequency part of the checkerboard index on the finer mesh. The bar's stimulus has jumps, and "
        "with it its density.",
        f"Empty: share of the volume below {exponents.EMPTY:g} ρ\\*. Each number is that of the worst discretisation.",
    )
    return Table("Exponents", header, cells, notes)


def variants_table(rows: Sequence[exponents.Row]) -> Table:
    """By discretisation."""
    cells = []
    for variant in (*VARIANTS, *HEALED):
        cells.append([variant])
        for holds in SIDES.values():
            these = [row for row in rows if row.variant == variant and holds(row.m, row.n)]
            if not these:
                cells[-1] += ["–"] * 4
                continue
            cells[-1] += [
                finished(these),
                number(most(fine(these), "jump")),
                number(most(fine(these), "noise")),
                f"{most(these, 'other_mesh'):.1%}",
            ]
    header = [""]
    for side in SIDES:
        header += [f"{side}: finished", "index", "noise", "meshes differ"]
    notes = ("Index: the whole checkerboard index; it and noise are the largest on the finer meshes.",)
    return Table("Discretisations, over all bodies and exponents", header, cells, notes)
