"""What a run tells the person at the terminal: progress on stderr, tables on stdout, from rank 0."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from growthx.common.renamed import renamed
from growthx.stepping import record

if TYPE_CHECKING:
    from collections.abc import Callable

    from mpi4py import MPI

    from growthx.model.scene import Scene
    from growthx.stepping.record import Result


FILE_WIDTH = 120  # characters, where output goes to a file or a pipe, which has no width


@contextmanager
def progress(scene: Scene) -> Iterator[Callable[[Result], None]]:
    """A progress bar over the time of the scene, as something to `watch` the run with; on a terminal only.

    Example:
        >>> scene = gx.scenes.plate(2)
        >>> with gx.report.progress(scene) as watch:
        ...     result = gx.solve(scene, gx.Q1P0, watch=watch)
        >>> f"{result.time:g}"
        '2.5'
    """
    console = Console(stderr=True)
    if scene.mesh.comm.rank != 0 or not console.is_terminal:
        yield lambda result: None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[state]}"), TimeElapsedColumn())
    with Progress(*columns, console=console) as bar:
        task = bar.add_task(scene.name, total=scene.program.until, state="setting up")

        def watch(result: Result) -> None:
            step = result.steps[-1]
            state = f"t = {step.time:g} of {scene.program.until:g}, {step.newton_iterations} Newton iterations"
            bar.update(task, completed=step.time, state=state)

        yield watch


def table(title: str, header: Iterable[str], rows: Iterable[Iterable[str]], comm: MPI.Comm) -> None:
    """Print a table on stdout, on rank 0: the first column to the left, the others to the right.

    Example:
        >>> from mpi4py import MPI
        >>> gx.report.table("Ends", ("variant", "u"), [("Q1", "2.37"), ("Q2", "2.36")], MPI.COMM_WORLD)
        Ends
        ┏━━━━━━━━━┳━━━━━━┓
        ┃ variant ┃    u ┃
        ┡━━━━━━━━━╇━━━━━━┩
        │ Q1      │ 2.37 │
        │ Q2      │ 2.36 │
        └─────────┴──────┘
    """
    if comm.rank != 0:
        return
    content = Table(title=Text(title, "bold"), title_justify="left")
    for column, name in enumerate(header):
        content.add_column(Text(name), justify="left" if column == 0 else "right")
    for row in rows:
        content.add_row(*map(Text, row))  # as they are: the brackets in a name are no markup
    _print(content)


def rows(title: str, content: Iterable[Iterable[str]], header: Iterable[str] = ("", "")) -> None:
    """Print a table on stdout, on this rank, if there is anything to print; without numbers if it has no header.

    Example:
        >>> gx.report.rows("Spring", [("stiffness", "2"), ("on", "left")])
        Spring
        ┌───────────┬──────┐
        │ stiffness │ 2    │
        │ on        │ left │
        └───────────┴──────┘
    """
    content, header = [tuple(row) for row in content], tuple(header)
    if not content:
        return
    grid = Table(title=Text(title, "bold"), title_justify="left", show_header=any(header))
    for column, name in enumerate(header):
        grid.add_column(Text(name), justify="left" if column == 0 or not name else "right", overflow="fold")
    for row in content:
        grid.add_row(*map(Text, row))
    _print(grid)


def _print(content: Table) -> None:
    console = Console()
    (console if console.is_terminal else Console(width=FILE_WIDTH)).print(content)


@renamed(rows="lines")
def steps(result: Result, lines: int = 10) -> None:
    """Print the statistics of about `lines` of the steps, the last one included, and how the run ended.

    Example:
        >>> result = gx.solve(gx.scenes.plate(2), gx.Q1P0)
        >>> gx.report.steps(result, lines=3)
        plate with Q1P0: 8 cells, ...
    """
    stride = max(1, len(result.steps) // lines)
    chosen = result.steps[::-1][::stride][::-1]
    table(
        f"{result.scene.name} with {result.variant.name}: {result.scene.mesh.cell_count} cells, "
        f"{result.problem.dofs} unknowns, {len(result.steps)} steps, {result.newton_iterations} Newton iterations with "
        f"{result.factorisations} tangents{_of_what_grows(result)}",
        ("time", "load", "Newton", "residual", "rejected", "density from", "to", "mass", "mass defect", "force defect"),
        (
            (
                f"{step.time:g}",
                f"{step.load:.2f}",
                f"{step.newton_iterations}",
                f"{step.newton.residual_norms[-1]:.0e}" + ("*" if step.newton.round_off else ""),
                f"{step.rejected}",
                f"{step.min_density:.4f}" + ("+" if step.lumped_cells else ""),
                f"{step.max_density:.4f}",
                f"{step.mass:.6g}",
                f"{step.mass_defect:.0e}",
                f"{step.force_defect:.0e}",
            )
            for step in chosen
        ),
        result.problem.comm,
    )
    if any(step.newton.round_off for step in chosen):
        say(result, "*: the residual is at its round-off, above the tolerance")
    if lumped := max((step.lumped_cells for step in chosen), default=0):
        say(result, f"+: where a nodal density would vanish the balance of mass is lumped, in at most {lumped} cells")
    say(result, f"ended: {record.ending(result)}")
    if result.scene.growth.is_bounded:
        shares = zip(result.problem.measures.shares_at_bounds(), result.scene.growth.bounds, strict=True)
        told = (f"{share:.1%} of the volume at {bound:g}" for share, bound in shares if bound is not None)
        say(result, f"bounds of density: {', '.join(told)}")


def _of_what_grows(result: Result) -> str:
    """Whose densities and mass a table has, as the end of its title; empty where that is the whole body."""
    if not result.problem.rests:
        return ""
    names = ", ".join(f"'{name}'" for name in result.scene.growing or ())
    return f"; densities and mass of what grows: {names}"


def numbers(
    result: Result,
    title: str,
    values: Mapping[str, float],
    unit: str,
    reference: float | None = None,
    digits: int = 4,
) -> None:
    """Print named numbers, and their relative change from a reference if there is one; digits: after the point.

    Example:
        >>> result = gx.solve(gx.scenes.plate(2), gx.Q1P0)
        >>> gx.report.numbers(result, "Densities", {"at rest": 1.0, "at the end": 1.5}, "g/cm³", reference=1.0)
        Densities
        ┏━━━━━━━━━━━━┳━━━━━━━━┳━━━━━━━━━━━━━━━━━┓
        ┃            ┃  g/cm³ ┃ relative change ┃
        ┡━━━━━━━━━━━━╇━━━━━━━━╇━━━━━━━━━━━━━━━━━┩
        │ at rest    │ 1.0000 │           +0.0% │
        │ at the end │ 1.5000 │          +50.0% │
        └────────────┴────────┴─────────────────┘
    """
    header = ["", unit] + ([] if reference is None else ["relative change"])
    rows = (
        [name, f"{value:.{digits}f}"] + ([] if reference is None else [f"{value / reference - 1:+.1%}"])
        for name, value in values.items()
    )
    table(title, header, rows, result.problem.comm)


def times(result: Result) -> None:
    """Print where the time went, what solved the linear systems and, where that is known, the most memory.

    Example:
        >>> result = gx.solve(gx.scenes.plate(2), gx.Q1P0)
        >>> gx.report.times(result)
        set-up ... s, compiling ... s, solving ... s (linear systems: ...
    """
    memory = result.costs[-1].peak_memory if result.costs else math.nan
    say(
        result,
        f"set-up {result.setup_s:.2f} s, compiling {result.compile_s:.2f} s, solving {result.solve_s:.2f} s "
        f"(linear systems: {result.linear_solver or 'none solved'})"
        + (f", at most {memory:.0f} MB of memory" if math.isfinite(memory) else ""),
    )


def say(result: Result, sentence: str) -> None:
    """Print a sentence on stdout, on rank 0.

    Example:
        >>> result = gx.solve(gx.scenes.plate(2), gx.Q1P0)
        >>> gx.report.say(result, f"{len(result.steps)} steps")
        25 steps
    """
    if result.problem.comm.rank == 0:
        print(sentence)
