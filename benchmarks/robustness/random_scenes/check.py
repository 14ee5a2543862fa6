"""What an independent assembly says of the end of a run: nothing, or which balance does not hold and by how much.

Forces.  Newton's method ends at ‖R‖₂ ≤ tolerance · force scale or, where the round-off of R is more than that, there,
and says so (`step.newton.round_off`, at most 1e-5).  The same norm of this assembly's R may be `SLACK` times the larger
of the two, and what its own round-off is: the change of R where each unknown and each coordinate changes in its last
place.

The record's defect of forces is a share of what the supports bear, which may be less than the loads are measured by.

Mass.  Densities that no two cells share are found to round-off, so each balance holds to `EXACT` of its terms, and to
what the last places of ∇u make of the energy.  Nodal ones are unknowns of the same Newton's method, whose balance of
mass is measured against the larger of the nodal masses per time step and the nodal resorption.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.robustness.random_scenes import assembly, laws
from benchmarks.robustness.random_scenes.assembly import State

if TYPE_CHECKING:
    from benchmarks.robustness.random_scenes.model import Model
    from growthx.common.arrays import Floats
    from growthx.stepping.record import Step

SLACK = 10.0
EXACT = 1e-9
ROUND_OFF = 30.0  # times what last places make of a residual
LAST = 4 * np.finfo(float).eps
WITNESS, SPREAD = 1e-8, 200.0  # of the record's defects: what is exact, and a sum over all nodes by a norm's tolerance


@dataclass(frozen=True)
class Verdict:
    """What was found; all numbers without a unit.

    wrong: what does not hold, in short; empty if all does.
    momentum: ‖R‖₂ of the free unknowns over that of the sizes of the forces of cells.  balance: ‖R‖₂ over what it may
    be.  mass: the same of the balance of mass, of each density or of the nodes' norm.
    """

    wrong: str
    momentum: float
    balance: float
    mass: float


def verdict(model: Model, state: State, step: Step, tolerance: float, start: Floats) -> Verdict:
    """Of the last accepted step.  tolerance: of Newton's method.  start: densities before the first step."""
    reached = SLACK * max(tolerance, step.newton.round_off)
    momentum, balance = _of_forces(model, state, reached)
    mass = _of_nodal_mass(model, state, reached, start) if model.is_nodal else _of_local_mass(model, state)
    wrong = {
        "det F ≤ 0": not _smallest_volume(model, state) > 0,
        "a density is not positive": not np.all(_growing(model, state.density) > 0),
        "a density is beyond its bounds": not _within_bounds(model, state),
        "a support is not where it should be": not _held_is_held(model, state),
        "momentum": not balance <= 1,
        "mass": not mass <= 1,
        "the record's mass defect": not step.mass_defect <= _mass_allowed(model, state, step, reached),
        "the record's force defect": not step.force_defect <= _defect_allowed(model, step, reached),
    }
    return Verdict(", ".join(name for name, holds in wrong.items() if holds), momentum, balance, mass)


# -- states that are no states -----------------------------------------------------------------------------------------


def _smallest_volume(model: Model, state: State) -> float:
    """J at the points of both rules, in all load cases."""
    places = [assembly.at_rule(model, degree) for degree in model.degrees]
    if model.lumped[1]:
        places.append(assembly.at_corners(model))
    return min(float(laws.volume_change(at.gradient(model, u)).min()) for at in places for u in state.u) + 1


def _growing(model: Model, density: Floats) -> Floats:
    return density[np.unique(model.density_dofs[model.grows])]


def _within_bounds(model: Model, state: State) -> bool:
    low, high = model.scene.growth.limits
    density = _growing(model, state.density)
    return bool(np.all((density >= low * (1 - 1e-12)) & (density <= high * (1 + 1e-12))))


# -- supports ----------------------------------------------------------------------------------------------------------


def held(model: Model) -> list[tuple[Any, int, float]]:
    """Displacement nodes, direction and displacement at full load of all supports."""
    found = []
    for support in model.scene.supports:
        nodes = model.dofs_on(support.on) if hasattr(support, "on") else model.dof_at(support.at)
        values = support.displacement or (0.0,) * model.dim
        found += [(nodes, i, float(value)) for i, value in enumerate(values) if value is not None]
    return found


def free(model: Model) -> Any:
    """Which displacements are free, (nodes, dim)."""
    found = np.ones((model.counts[0], model.dim), dtype=bool)
    for nodes, direction, _ in held(model):
        found[nodes, direction] = False
    return found


def _held_is_held(model: Model, state: State) -> bool:
    """Of a direction that two supports hold, either's word counts."""
    wanted: dict[tuple[int, int], set[float]] = {}
    for nodes, direction, value in held(model):
        for node in nodes:
            wanted.setdefault((int(node), direction), set()).add(state.share * value)
    return all(
        min(abs(u[node, direction] - value) for value in values) <= 1e-12 * max(map(abs, values))
        for u in state.u
        for (node, direction), values in wanted.items()
    )


# -- forces ------------------------------------------------------------------------------------------------------------


def force_scale(model: Model) -> float:
    """‖nodal dead load‖₂ of free nodes, load cases by their weights; without a load, stiffness times displacement."""
    weights = np.array([weight for weight, _ in model.cases])
    nodal = np.array(
        [
            np.sum([np.zeros((model.counts[0], model.dim)), *assembly.loads(model, number)], axis=0)
            for number in range(len(weights))
        ]
    )
    whole = weights[:, None, None] * nodal
    scale = float(np.linalg.norm(whole * free(model)))
    if scale > EXACT * float(np.linalg.norm(whole)):
        return scale
    volume = float(assembly.at_rule(model, model.degrees[0]).dV[model.grows].sum())
    size = volume ** (1 / model.dim)
    moved = max((abs(value) for _, _, value in held(model)), default=0.0)
    return float(model.parameters["young"].max()) * (moved or size) * size ** (model.dim - 2)


def _of_forces(model: Model, state: State, reached: float) -> tuple[float, float]:
    weights = np.array([weight for weight, _ in model.cases])[:, None, None] * free(model)
    forces, sizes = assembly.momentum(model, state)
    residual = float(np.linalg.norm(weights * forces))
    changes = [
        np.linalg.norm(weights * (assembly.momentum(*changed)[0] - forces)) for changed in _changed(model, state)
    ]
    allowed = reached * force_scale(model) + ROUND_OFF * float(max(changes))
    size = float(np.linalg.norm(weights * sizes))
    return residual / size if size else 0.0, residual / allowed


def _defect_allowed(model: Model, step: Step, reached: float) -> float:
    """Of the record's forces: where supports bear less than the force scale, the same residual is more of it."""
    scale, share = force_scale(model), 1.0
    for name, weight in _case_names(model):
        borne = sum(float(np.linalg.norm(force)) for key, force in step.reactions.items() if key.startswith(name))
        share = min(share, weight * borne / scale)
    return WITNESS + (SPREAD * reached / share if share > EXACT else np.inf)


def _case_names(model: Model) -> list[tuple[str, float]]:
    """What the names of reactions begin with in each load case, and its weight."""
    cases = model.scene.cases
    names = [f"{case.name}: " for case in cases] or [""]
    return [(name, weight) for name, (weight, _) in zip(names, model.cases, strict=True)]


def _changed(model: Model, state: State, times: int = 2) -> list[tuple[Model, State]]:
    """The same with every unknown and coordinate changed in its last place."""
    rng, found = np.random.default_rng(0), []
    for _ in range(times):
        signs = [1 + np.finfo(float).eps * rng.choice([-1.0, 1.0], each.shape) for each in (state.u, model.body.points)]
        density = state.density * (1 + np.finfo(float).eps * rng.choice([-1.0, 1.0], state.density.shape))
        corners = (model.body.points * signs[1])[model.nodes]
        found.append((replace(model, corners=corners), replace(state, u=state.u * signs[0], density=density)))
    return found


# -- mass --------------------------------------------------------------------------------------------------------------


def _one_sided(model: Model, density: Floats, residual: Floats) -> Floats:
    """What of ρ − ρₙ − Δt R₀ is wrong: at the lowest density it may be above zero, at the highest below."""
    low, high = model.scene.growth.limits
    residual = np.where(density <= low, np.minimum(residual, 0.0), residual)
    return np.where(density >= high, np.maximum(residual, 0.0), residual)


def _of_local_mass(model: Model, state: State) -> float:
    residual, size = assembly.local_mass(model, state)
    residual = _one_sided(model, state.density[model.density_dofs], residual)
    allowed = EXACT * size + state.time_step * _energy_noise(model, state)
    return float((np.abs(residual) / allowed)[model.grows].max(initial=0.0))


def _energy_noise(model: Model, state: State) -> Floats:
    """What last places of displacements and coordinates may make of the rate of density, (cells, densities)."""
    places = assembly.at_rule(model, model.degrees[1])
    p = {name: value[:, None] for name, value in model.parameters.items()}
    lam, mu = laws.lame(p["young"], p["poisson"])
    low, high = np.zeros(places.dV.shape), np.zeros(places.dV.shape)
    reach = np.abs(model.corners).max(axis=(1, 2))[:, None]
    for (weight, _), u in zip(model.cases, state.u, strict=True):
        H = places.gradient(model, u)
        slope = np.linalg.norm(places.slopes, axis=3)
        moved = np.einsum("cf,cpf->cp", np.linalg.norm(u[model.dofs], axis=2), slope)
        last = LAST * (moved + np.linalg.norm(H, axis=(2, 3)) * slope.sum(axis=2) * reach)
        psi = laws.energy(H, p["young"], p["poisson"])
        change = np.linalg.norm(laws.stress(H, p["young"], p["poisson"]), axis=(2, 3)) * last + (lam + 2 * mu) * last**2
        low, high = low + weight * psi, high + weight * (psi + change)
    rho = state.density[model.density_dofs] @ assembly.density_shares(model, places.X).T
    rates = [p["rate"] * model.source.stimulus(rho, each, p["young"], p["reference"], p["n"]) for each in (low, high)]
    shares = assembly.density_shares(model, places.X)
    return np.asarray(ROUND_OFF * (places.dV * np.abs(rates[1] - rates[0])) @ shares / (places.dV @ shares))


def _of_nodal_mass(model: Model, state: State, reached: float, start: Floats) -> float:
    residual, _ = assembly.nodal_mass(model, state)
    counted = np.zeros(model.counts[1], dtype=bool)
    counted[np.unique(model.density_dofs[model.grows])] = True
    for prescribed in model.scene.prescribed_densities:
        nodes = model.dofs_on(prescribed.on, density=True)
        if not np.all(state.density[nodes] == prescribed.density):
            return np.inf
        counted[nodes] = False
    wrong = _one_sided(model, state.density, residual)[counted]
    changes = [
        np.linalg.norm((assembly.nodal_mass(*changed)[0] - residual)[counted]) for changed in _changed(model, state)
    ]
    allowed = reached * mass_scale(model, state.time_step, start) + ROUND_OFF * float(max(changes))
    return float(np.linalg.norm(wrong)) / allowed


def mass_scale(model: Model, time_step: float, start: Floats) -> float:
    """The larger of ‖nodal masses‖₂ per time step and ‖nodal resorption‖₂ (mass per time).

    Masses at the reference density or, where that varies, at the start.
    """
    places, p = assembly.at_rule(model, model.degrees[0]), model.parameters
    shares = (places.dV * model.grows[:, None]) @ assembly.density_shares(model, places.X)
    volumes, lost = np.zeros(model.counts[1]), np.zeros(model.counts[1])
    np.add.at(volumes, model.density_dofs, shares)
    np.add.at(lost, model.density_dofs, shares * (p["rate"] * p["attractor"])[:, None])
    reference = model.scene.material.reference_density
    stored = volumes * (start if isinstance(reference, np.ndarray) else reference)
    return max(float(np.linalg.norm(stored)) / time_step, float(np.linalg.norm(lost)))


def _mass_allowed(model: Model, state: State, step: Step, reached: float) -> float:
    volumes = assembly.at_rule(model, model.degrees[0]).dV.sum(axis=1) * model.grows
    p = model.parameters
    gone = step.time_step * float(volumes @ (p["rate"] * p["attractor"]))
    share = WITNESS + (SPREAD * reached if model.is_nodal else 0.0)
    return share * (1 + gone / step.mass)
