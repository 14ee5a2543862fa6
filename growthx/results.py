"""What a run leaves on disk: fields for ParaView and the history as CSV.  Nothing is overwritten."""

from __future__ import annotations

import csv
import os
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
import ufl

from growthx import compat
from growthx.assembly import assemble
from growthx.errors import InputError, OutputError, require_kind
from growthx.raw import raw_writer
from growthx.series import HIDDEN, Series, agreed, aside
from growthx.smoothing import smoothed_density

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from mpi4py import MPI

    from growthx.arrays import Floats
    from growthx.discretisation import Discretisation
    from growthx.run import Result


def new_folder(
    path: str | os.PathLike[str], comm: MPI.Comm, beside: Callable[[Path], bool] = lambda file: False
) -> Path:
    """Make a folder for results, on all ranks; InputError if it holds anything already or cannot be written.

    beside: whether a file may be there already.
    """
    problem = ""
    require_kind(path, (str, os.PathLike), "the folder for results", "its path")
    folder = Path(path)
    if comm.rank == 0:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if not all(beside(file) for file in folder.iterdir() if file.name != HIDDEN):
                problem = f"the folder {folder} is not empty: a new or empty one would keep what is there"
            elif not os.access(folder, os.W_OK):
                problem = f"the folder {folder} is not writable: one you may write to would be right"
        except (OSError, ValueError) as error:  # ValueError: a name that no file may have
            reason = error.strerror if isinstance(error, OSError) else error
            problem = f"the folder {folder} cannot be made ({reason}): one you may write to would be right"
    if problem := comm.bcast(problem):
        raise InputError(problem)
    return folder


def free_folder(path: str | os.PathLike[str], comm: MPI.Comm) -> Path:
    """Make `path`, or the first of `path-2`, `path-3`, … that is new or empty, on all ranks."""
    require_kind(path, (str, os.PathLike), "the folder for results", "its path")
    folder, count = Path(path), 1
    if comm.rank == 0:
        with suppress(OSError):  # which `new_folder` meets again
            while folder.is_dir() and any(folder.iterdir()):
                count += 1
                folder = Path(f"{path}-{count}")
    return new_folder(comm.bcast(folder), comm)


def cell_fields(problem: Discretisation) -> dict[str, Floats]:
    """Means over the owned cells, each of shape (cells,).

    density ρ, relative_change [ρ − ρ*]/ρ*, stimulus [ρ/ρ*]^(−m) Ψ₀ (energy per volume), mass_source R₀ (density per
    time, zero where nothing grows), major_stress and minor_stress: principal Cauchy stresses (in the plane, in two
    dimensions; of several load cases, those of the mean stress).
    """
    mesh, dim = problem.scene.mesh, problem.scene.mesh.dim
    rho, material, growth = problem.density, problem.material, problem.growth
    energy, sigma = problem.mean_energy(), problem.mean_stress()
    upper = [(i, j) for i in range(dim) for j in range(i, dim)]
    scalars = {
        "density": rho,
        "relative_change": rho / material.reference_density - 1,
        "stimulus": growth.stimulus(rho, energy, material),
        "mass_source": growth.mass_source(rho, energy, material),
    }
    means = _cell_means(problem, [*scalars.values(), *(sigma[i, j] for i, j in upper)])
    stress = np.empty((len(means), dim, dim))
    for column, (i, j) in enumerate(upper, start=len(scalars)):
        stress[:, i, j] = stress[:, j, i] = means[:, column]
    principal = np.linalg.eigvalsh(stress)
    fields = {name: means[:, column] for column, name in enumerate(scalars)}
    fields["mass_source"][np.setdiff1d(mesh.owned_cells, problem.growing_cells)] = 0.0
    return fields | {"major_stress": principal[:, -1], "minor_stress": principal[:, 0]}


def _cell_means(problem: Discretisation, values: list[Any]) -> Floats:
    """Means of UFL scalars over the owned cells, shape (cells, values)."""
    space = dolfinx.fem.functionspace(problem.scene.mesh.domain, ("DG", 0, (len(values),)))
    test, ones = ufl.TestFunction(space), [1.0] * len(values)
    forms = (ufl.inner(ufl.as_vector(each), test) * problem.whole_volume for each in (values, ones))
    total, volumes = (assemble(problem.compile.form(form)).reshape(-1, len(values)) for form in forms)
    return total / volumes


class FieldWriter:
    """Writes the fields of a state, one after another in time, as a series that ParaView opens (`fields.pvd`)."""

    def __init__(self, folder: Path, problem: Discretisation) -> None:
        self._problem = problem
        mesh = problem.scene.mesh
        self._file = Series(folder / "fields.pvd", problem.comm)
        self._per_cell = dolfinx.fem.functionspace(mesh.domain, ("DG", 0))
        self._displacement = dolfinx.fem.Function(
            dolfinx.fem.functionspace(mesh.domain, ("Lagrange", 1, (mesh.dim,))), name="displacement"
        )

    def write(self, time: float) -> None:
        """Append the state at a time: displacement and smoothed density at the nodes, the rest as means over cells."""
        self._displacement.interpolate(self._problem.displacement)
        functions = [self._displacement, smoothed_density(self._problem)]
        for name, values in cell_fields(self._problem).items():
            function = dolfinx.fem.Function(self._per_cell, name=name)
            function.x.array[: len(values)] = values
            function.x.scatter_forward()
            functions.append(function)
        self._file.write(functions, time)

    def close(self) -> None:
        """Finish the files."""
        self._file.close()


def write_history(folder: Path, result: Result) -> None:
    """Write `history.csv`, one row per step; a run in several ranks writes it once."""
    if result.problem.comm.rank != 0:
        return
    directions = "xyz"[: result.scene.mesh.dim]
    with (folder / "history.csv").open("x", newline="") as file:
        writer = csv.writer(file)
        supports = list(result.steps[0].reactions) if result.steps else []
        writer.writerow(
            ["time", "time_step", "error", "load", "rejected", "newton_iterations", "factorisations", "residual"]
            + ["mass", "mass_defect", "min_density", "max_density"]
            + [f"reaction_{name}_{direction}" for name in supports for direction in directions]
        )
        for step in result.steps:
            writer.writerow(
                [step.time, step.time_step, step.error, step.load, step.rejected, step.newton_iterations]
                + [step.newton.factorisations, step.newton.residual_norms[-1]]
                + [step.mass, step.mass_defect, step.min_density, step.max_density]
                + [float(force) for name in supports for force in step.reactions[name]]
            )


def write(folder: Path, result: Result) -> None:
    """Write the last state's fields, as means and raw, and the history into a folder made by `new_folder` (collective).

    All files are there afterwards, whole, or none.  Raises OutputError if they cannot be written, or if the run has no
    accepted step, whose state would be there to write.
    """
    if not result.steps:
        raise OutputError(f"the run of the scene '{result.scene.name}' has no accepted step: there is nothing to write")
    comm = result.problem.comm
    with aside(folder, comm) as hidden:
        for make in (FieldWriter, raw_writer):
            writer = make(hidden, result.problem)
            writer.write(result.time)
            writer.close()
        with agreed(folder, comm):
            write_history(hidden, result)


def summary(result: Result) -> Mapping[str, object]:
    """The numbers of a run that every scene has, as scalars."""
    from growthx import __version__

    problem = result.problem
    low, high = problem.density_range()
    return {
        "schema": 1,
        "versions": {"growthx": __version__, "dolfinx": compat.DOLFINX_VERSION},
        "scene": result.scene.name,
        "variant": result.variant.name,
        "cells": result.scene.mesh.cell_count,
        "dofs": problem.dofs,
        "points": problem.points,
        "time": result.time,
        "steps": len(result.steps),
        "newton_iterations": result.newton_iterations,
        "factorisations": result.factorisations,
        "linear_solver": result.linear_solver,
        "converged": result.converged,
        **({} if result.converged else {"reason": result.reason}),
        "min_density": low,
        "max_density": high,
        "mass": problem.mass(),
        "setup_s": result.setup_s,
        "compile_s": result.compile_s,
        "solve_s": result.solve_s,
    }
