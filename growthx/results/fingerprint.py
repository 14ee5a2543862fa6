"""What a run evaluates, in short: its laws as UFL writes them, and their values at sample states.

Names and parameters do not tell laws of one's own apart, in whose code or constants something has changed.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import basix
import dolfinx
import numpy as np
import ufl
from mpi4py import MPI

from growthx.common.arrays import is_law, is_uniform
from growthx.constitutive.growth import GrowthLaw
from growthx.discretisation.trial import trial
from growthx.fem.assembly import assemble
from growthx.meshing.fields import interpolate, law_as_ufl

if TYPE_CHECKING:
    from collections.abc import Iterator

    from growthx.common.arrays import Floats, Law
    from growthx.discretisation.discretisation import Discretisation
    from growthx.model.program import Program
    from growthx.stepping.control import Stepping

WRITER = "the version of UFL"  # the name of what writes the forms
WRITTEN = "as written: "  # how names of forms begin, which can be compared only if they are of one writer
ENERGIES = np.concatenate([[0.0], np.geomspace(1e-12, 1.0, 49)])  # as shares of the stiffness
RELATIVE_DENSITIES = (0.1, 0.5, 1.0, 1.7)
EXTENSIONS = ((0.0, 0.0, 0.0), (0.1, -0.05, 0.0), (-0.1, 0.05, 0.02), (1e-4, 0.0, 0.0))  # principal stretches less one
FIRST_NUMBER = 10**9  # of constants in signatures
STRAIN = 0.03  # of the sample state, about


def fingerprint(problem: Discretisation, stepping: Stepping) -> dict[str, Any]:
    """Numbers and texts by what they are of (collective): the same on any number of ranks but for round-off."""
    found = _values_of_laws(problem) | _values_of_steps(problem.scene.program, stepping)
    found[WRITER] = f"{ufl.__version__}, with basix {basix.__version__}"
    found |= {WRITTEN + what: signature(form)[:32] for what, form in _forms(problem)}
    return found | _values_of_balances(problem)


def signature(form: ufl.Form) -> str:
    """UFL's signature of a form, the same whatever else was made before it.

    UFL sorts the operands of sums and products by their text, in which the constant of number 10 comes before that of
    number 9: they get numbers of as many figures each.
    """
    constants = sorted(form.constants(), key=lambda constant: int(constant.count()))
    numbered = {
        constant: ufl.Constant(constant.ufl_domain(), constant.ufl_shape, count=FIRST_NUMBER + place)
        for place, constant in enumerate(constants)
    }
    return str(ufl.replace(form, numbered).signature())


# -- laws --------------------------------------------------------------------------------------------------------------


def _values_of_laws(problem: Discretisation) -> dict[str, Any]:
    """Of growth and material with numbers, the means of what varies in space: for numbers and arrays."""
    # A law with a memory is told apart by its start.
    in_ufl = problem.growth if problem.state.past is None else law_as_ufl(problem.scene.growth, problem.scene.mesh)
    growth = _with_means(problem, problem.scene.growth, in_ufl)
    material = _with_means(problem, problem.scene.material, problem.material)
    energies = ENERGIES * material.stiffness
    densities = material.reference_density * np.array(RELATIVE_DENSITIES)
    law = type(growth).__name__
    with np.errstate(all="ignore"):
        stresses = [
            material.principal_stresses(extensions, rho) for extensions in EXTENSIONS for rho in map(float, densities)
        ]
        found: dict[str, Any] = {
            f"a stress of {type(material).__name__} at sample stretches": np.ravel(stresses).tolist()
        }
        if isinstance(growth, GrowthLaw):
            exponents = growth.power_at(densities, material)
            found |= {
                f"the power of {law}": np.atleast_1d(np.asarray(exponents, dtype=float)).tolist(),
                f"the drive of {law} at sample energies": np.ravel(growth.drive(energies, material)).tolist(),
            }
        source = growth.mass_source(densities[:, np.newaxis], energies, material)
        everywhere = np.broadcast_to(source, (len(densities), len(energies)))
        return found | {f"the mass source of {law} at sample states": np.ravel(everywhere).tolist()}


def _with_means(problem: Discretisation, law: Law, in_ufl: Law) -> Law:
    """The law with numbers for its parameters: means, of directions root mean squares (collective)."""
    points = problem.variant.integration_points(problem.scene.mesh.cell_name)
    means: dict[str, Any] = {}
    for name in law.coefficients:
        if is_law(getattr(law, name)):
            means[name] = _with_means(problem, getattr(law, name), getattr(in_ufl, name))
        elif not is_uniform(getattr(law, name)):
            values = problem.evaluate(getattr(in_ufl, name), points)
            square = name in getattr(law, "directions", ())
            total, count = problem.comm.allreduce(np.array([(values**2 if square else values).sum(), values.size]))
            means[name] = float(np.sqrt(total / count) if square else total / count)
    return replace(law, **means)


def _forms(problem: Discretisation) -> Iterator[tuple[str, ufl.Form]]:
    """All that laws and loads of the user's may say in UFL, as forms by what they are."""
    scene, u, rho = problem.scene, problem.displacements[0], problem.density
    dx, ds = ufl.Measure("dx", scene.mesh.domain), ufl.Measure("ds", scene.mesh.domain)
    energy, stress = problem.expressions.energy(), problem.expressions.stress()
    material, growth = type(scene.material).__name__, type(scene.growth).__name__
    yield f"the elastic energy of {material}", energy * dx
    yield f"the stress of {material}", ufl.inner(stress, stress) * dx
    yield f"the mass source of {growth}", problem.growth.mass_source(rho, energy, problem.material) * dx
    for number, load in enumerate(scene.open_loads, start=1):
        force = load.force(u, rho, scene.mesh)
        yield f"open load {number}, {load.place},", ufl.inner(force, u) * (dx if load.on is None else ds)
    for influx in scene.influx:
        yield f"the influx on '{influx.on}'", influx.value(u, rho, scene.mesh) * rho * ds
    if scene.flux is not None:
        flux = law_as_ufl(scene.flux, scene.mesh).flux(rho, problem.material)
        yield "the mass flux", ufl.inner(flux, ufl.grad(rho)) * dx


# -- steps -------------------------------------------------------------------------------------------------------------


def _values_of_steps(program: Program, stepping: Stepping) -> dict[str, Any]:
    """What a stepping asks of Newton's method, and what its control answers to a few steps, whatever the end."""
    step, name = program.step, type(stepping).__name__
    control = stepping.control(replace(program, until=1000 * step, requested=()))
    ends = [control.end(0.0, 10 * step)]
    control.failed(step)
    ends.append(control.end(0.0, 10 * step))
    taken = [control.accepts(step / 2, error) for error in (1e-6, 1e-3, 1.0)]
    ends.append(control.end(step, 10 * step))
    return {
        f"the tolerance that {name} asks of Newton's method": float(stepping.newton_tolerance(1e-10)),
        f"the end of a step of {name} in a trial": [*map(float, ends), *map(float, taken)],
    }


# -- balances ----------------------------------------------------------------------------------------------------------


def _values_of_balances(problem: Discretisation) -> dict[str, Any]:
    """Sizes and directions of what the balances of a sample state are out by, as compiled (collective)."""
    found = {}
    of_momentum = np.zeros(len(problem.system.unknown.x.array), dtype=bool)
    for part in problem.system.unknowns.parts:
        of_momentum[part] = True
    with trial(problem.system, *_sample(problem)):
        for number, residual in enumerate(problem.system.residuals, start=1):
            out_by = assemble(residual)
            unknown, rows = problem.system.unknown.x.array[: len(out_by)], of_momentum[: len(out_by)]
            for what, some in (("momentum", rows), ("mass", ~rows)):
                sums = [out_by[some] @ out_by[some], unknown[some] @ unknown[some], unknown[some] @ out_by[some]]
                size, weight, along = problem.comm.allreduce(np.array(sums))
                # From 1 to 3: round-off is then relative.
                direction = 2 + along / np.sqrt(size * weight) if size * weight != 0 else 2.0
                name = f"what the balance of {what} in a sample state is out by, form {number},"
                found[name] = [float(np.sqrt(size)), float(direction)]
    return found


def _sample(problem: Discretisation) -> tuple[list[Floats], Floats]:
    """Displacements of the load cases, det F > 0, and densities by position, as in `x.array` (collective)."""
    size = problem.comm.allreduce(float(np.abs(problem.scene.mesh.domain.geometry.x).max(initial=0.0)), MPI.MAX)
    mesh, material = problem.scene.mesh, _with_means(problem, problem.scene.material, problem.material)
    u, rho = dolfinx.fem.Function(problem.displacement_space), dolfinx.fem.Function(problem.density_space)

    def moved(x: Floats) -> Floats:
        angles = np.stack([1.3 * x[i] + 0.4 * x[i - 1] for i in range(mesh.dim)]) / size
        return STRAIN * size * np.sin(angles + np.arange(mesh.dim)[:, np.newaxis])

    interpolate(u, moved)
    interpolate(rho, lambda x: material.reference_density * (1 + 0.2 * np.cos((x[0] + 2 * x[1]) / size)))
    for function in (u, rho):
        function.x.scatter_forward()
    return [u.x.array / (1 + case) for case in range(len(problem.spaces.cases))], rho.x.array.copy()
