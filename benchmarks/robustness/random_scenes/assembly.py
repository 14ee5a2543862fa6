"""Both balances in NumPy: forces on nodes, and what is left of the mass of each density, from a state as arrays.

A sum of what cells contribute comes with the sum of the sizes of these contributions, against which it is small or not.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.robustness.random_scenes import laws, reference
from benchmarks.robustness.random_scenes.reference import Element

if TYPE_CHECKING:
    from benchmarks.robustness.random_scenes.model import Model
    from growthx.common.arrays import Floats, Indices


@dataclass(frozen=True)
class State:
    """Displacements of the load cases, (cases, nodes, dim), densities before and after a step of implicit Euler.

    motion: displacement and velocity before it, where there is inertia.  share: of the loads.
    lumped: cells in which the balance of mass is lumped, storage and source, to keep a nodal density positive.
    """

    u: Floats
    density: Floats
    old: Floats
    time_step: float
    share: float
    motion: tuple[Floats, Floats] | None = None
    lumped: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int32))


@dataclass(frozen=True)
class Places:
    """Points in all cells: dV (cells, points) and, in the coordinates of the body, slopes of the displacement's shapes.

    values: of these shapes at the points, (points, functions); slopes: (cells, points, functions, dim).
    """

    X: Floats
    dV: Floats
    inverse: Floats
    values: Floats
    slopes: Floats

    @classmethod
    def of(cls, model: Model, X: Floats, weights: Floats) -> Places:
        """At points of the reference cell."""
        jacobian = jacobians(model, X)
        inverse = np.linalg.inv(jacobian)
        values, slopes = model.displacement.tabulate(X)
        determinant = np.linalg.det(jacobian)
        return cls(X, np.abs(determinant) * weights, inverse, values, np.einsum("pfj,cpji->cpfi", slopes, inverse))

    def gradient(self, model: Model, u: Floats) -> Floats:
        """∇u, (cells, points, dim, dim)."""
        return np.einsum("cfi,cpfj->cpij", u[model.dofs], self.slopes)


def jacobians(model: Model, X: Floats) -> Floats:
    """∂x/∂X of all cells, (cells, points, dim, dim), of coordinates from a corner of each."""
    _, slopes = Element(model.shape, "P", 1).tabulate(X)
    return np.einsum("cni,pnj->cpij", model.corners - model.corners[:, :1], slopes)


def at_rule(model: Model, degree: int) -> Places:
    """The points of a rule."""
    return Places.of(model, *reference.rule(model.shape, degree))


def at_nodes(model: Model, element: Element) -> Places:
    """The nodes of a Lagrange element, each with ∫ N dV for a volume or, where one of a cell is not positive but for
    round-off, in proportion to ∫ N² dV.
    """
    X, w = reference.rule(model.shape, 2 * element.degree + (model.shape in reference.TENSOR))
    volumes, N = np.abs(np.linalg.det(jacobians(model, X))) * w, element.tabulate(X)[0]
    shares, squares = volumes @ N, volumes @ N**2
    scaled = squares * (volumes.sum(axis=1) / squares.sum(axis=1))[:, None]
    shares = np.where(shares.min(axis=1, keepdims=True) > 1e-9 * volumes.sum(axis=1, keepdims=True), shares, scaled)
    corners = reference.corners(model.shape)
    nodes = np.array([corners[list(support)].mean(axis=0) for support in element.supports])
    places = Places.of(model, nodes, np.ones(len(nodes)))
    return Places(places.X, shares, places.inverse, places.values, places.slopes)


def at_corners(model: Model) -> Places:
    """The corners of the cells, each with ∫ N dV of its linear shape function for a volume."""
    return at_nodes(model, Element(model.shape, "P", 1))


def density_shares(model: Model, X: Floats) -> Floats:
    """Share of each density of a cell at points, (points, densities)."""
    if model.density is not None:
        return model.density.tabulate(X)[0]
    if model.kind == "cell":
        return np.ones((len(X), 1))
    apart = np.linalg.norm(X[:, None] - model.density_points, axis=2)
    assert apart.min(axis=1).max() < 1e-10
    return np.eye(len(model.density_points))[apart.argmin(axis=1)]


def _parameters(model: Model) -> dict[str, Floats]:
    return {name: value[:, None] for name, value in model.parameters.items()}


def _weight(model: Model, density: Floats) -> Floats:
    """[ρ/ρ*]ⁿ where there is growth, else one; density: (cells, points)."""
    p = _parameters(model)
    with np.errstate(all="ignore"):
        return np.where(model.grows[:, None], (density / p["reference"]) ** p["n"], 1.0)


def _sum(count: int, dofs: Any, values: Floats) -> Floats:
    found = np.zeros((count, *values.shape[2:]))
    np.add.at(found, dofs, values)
    return found


# -- momentum ----------------------------------------------------------------------------------------------------------


def momentum(model: Model, state: State) -> tuple[Floats, Floats]:
    """Internal minus external forces, (cases, nodes, dim), and the sizes of what they are the sum of.

    With inertia everything must grow: the density of what rests is not known at nodes that it shares.
    """
    places, p = at_rule(model, model.degrees[0]), _parameters(model)
    rho = state.density[model.density_dofs] @ density_shares(model, places.X).T
    forces, sizes = [], []
    for number, u in enumerate(state.u):
        P = laws.stress(places.gradient(model, u), p["young"], p["poisson"]) * _weight(model, rho)[..., None, None]
        inside = np.einsum("cp,cpij,cpfj->cfi", places.dV, P, places.slopes)
        force, size = _sum(model.counts[0], model.dofs, inside), _sum(model.counts[0], model.dofs, np.abs(inside))
        for load in loads(model, number):
            force -= state.share * load
            size += state.share * np.abs(load)
        if model.scene.inertia is not None and number == 0:
            inert = _inertia(model, state)
            force, size = force + inert, size + np.abs(inert)
        forces.append(force)
        sizes.append(size)
    return np.array(forces), np.array(sizes)


def _inertia(model: Model, state: State) -> Floats:
    """∫ δu ρ [v − vₙ]/Δt, of masses at the corners if it is lumped."""
    assert state.motion is not None and model.scene.inertia is not None
    lumped = model.scene.inertia.lumped
    places = at_corners(model) if lumped else at_rule(model, model.degrees[0])
    rho = state.density[model.density_dofs] @ density_shares(model, places.X).T
    old, velocity = state.motion
    acceleration = ((state.u[0] - old) / state.time_step - velocity) / state.time_step
    at_points = np.einsum("pf,cfi->cpi", places.values, acceleration[model.dofs])
    inert = np.einsum("cp,pf,cpi->cfi", places.dV * rho, places.values, at_points)
    return _sum(model.counts[0], model.dofs, inert)


def loads(model: Model, case: int) -> list[Floats]:
    """Nodal forces of each dead load of a load case at its full size, (nodes, dim)."""
    found = []
    for load in model.cases[case][1]:
        kind = type(load).__name__
        if kind == "BodyForce":
            found.append(np.outer(_volumes(model, load.region), load.value))
        elif kind == "Traction":
            found.append(np.outer(_areas(model, load.on), load.value))
        else:
            areas = _areas(model, load.on)
            found.append(np.outer(areas / areas.sum(), load.force))
    return found


def _volumes(model: Model, region: str | None) -> Floats:
    """∫ N dV of each displacement node."""
    exact = 2 * model.displacement.degree if model.shape in reference.SIMPLEX else 5
    places = at_rule(model, exact)
    inside = np.ones(len(model.cells)) if region is None else np.isin(model.cells, model.body.regions[region])
    return _sum(model.counts[0], model.dofs, (places.dV * inside[:, None]) @ places.values)


def _areas(model: Model, name: str, *, density: bool = False) -> Floats:
    """∮ N dA of each displacement node, or of each density."""
    element, dofs = (model.density, model.density_dofs) if density else (model.displacement, model.dofs)
    assert element is not None
    X, w = reference.rule(reference.SHAPE_OF_SIDES[model.shape], 2 * element.degree)
    found = np.zeros(model.counts[1 if density else 0])
    for cell, side in model.sides(name):
        at, directions = reference.places_on_side(model.shape, side, X)
        tangents = jacobians(model, at)[cell] @ directions
        area = np.sqrt(np.linalg.det(np.swapaxes(tangents, 1, 2) @ tangents))
        found[dofs[cell]] += (w * area) @ element.tabulate(at)[0]
    return found


# -- mass --------------------------------------------------------------------------------------------------------------


def sources(model: Model, state: State, places: Places, density: Floats) -> tuple[Floats, Floats]:
    """R₀ at points, and the sizes of the two terms that it is the difference of, (cells, points)."""
    p = _parameters(model)
    psi = energies(model, state, places)
    stimulus = model.source.stimulus(density, psi, p["young"], p["reference"], p["n"])
    rate = p["rate"] * model.source.response(stimulus - p["attractor"])
    return rate, p["rate"] * (np.abs(stimulus) + p["attractor"] + 0 * density)


def energies(model: Model, state: State, places: Places) -> Floats:
    """Ψ₀ⁿᵉᵒ at points, the weighted mean over the load cases, (cells, points)."""
    p = _parameters(model)
    of_cases = [
        weight * laws.energy(places.gradient(model, u), p["young"], p["poisson"])
        for (weight, _), u in zip(model.cases, state.u, strict=True)
    ]
    return np.asarray(sum(of_cases))


def local_mass(model: Model, state: State) -> tuple[Floats, Floats]:
    """ρ − ρₙ − Δt R₀ of densities per cell or at points, (cells, densities), and the sizes of the terms.

    Of a density per cell R₀ is its mean over the points.
    """
    places = at_rule(model, model.degrees[1])
    shares = density_shares(model, places.X)
    rho, old = state.density[model.density_dofs], state.old[model.density_dofs]
    rate, size = sources(model, state, places, rho @ shares.T)
    volumes = places.dV @ shares
    mean, sizes = ((places.dV * each) @ shares / volumes for each in (rate, size))
    return rho - old - state.time_step * mean, np.abs(rho) + np.abs(old) + state.time_step * sizes


def nodal_mass(model: Model, state: State) -> tuple[Floats, Floats]:
    """What is left of the balance of each nodal density (mass per time), (densities,), and the sizes of its terms."""
    assert model.density is not None
    rule, dofs, count = at_rule(model, model.degrees[0]), model.density_dofs, model.counts[1]
    residual, size = np.zeros(count), np.zeros(count)
    rate_of_change = (state.density - state.old) / state.time_step
    here = model.grows & np.isin(np.arange(len(model.cells)), state.lumped)
    nodes = at_nodes(model, model.density) if any(model.lumped) or len(state.lumped) else rule
    for everywhere, stored in ((model.lumped[0], True), (model.lumped[1], False)):
        for places, cells in ((nodes, model.grows),) if everywhere else ((rule, model.grows & ~here), (nodes, here)):
            N = density_shares(model, places.X)
            if stored:
                term = rate_of_change[dofs] @ N.T
                terms = (np.abs(state.density) + np.abs(state.old))[dofs] @ np.abs(N).T / state.time_step
            else:
                rate, terms = sources(model, state, places, state.density[dofs] @ N.T)
                term = -rate
            dV = places.dV * cells[:, None]
            residual += _sum(count, dofs, np.where(dV > 0, dV * term, 0.0) @ N)
            size += _sum(count, dofs, np.where(dV > 0, dV * terms, 0.0) @ np.abs(N))
    for part in (_conducted(model, state, rule), -_entered(model)):
        residual, size = residual + part, size + np.abs(part)
    return residual, size


def _conducted(model: Model, state: State, places: Places) -> Floats:
    """∫ ∇δρ · R₀ᶠ ∇ρ."""
    if model.scene.flux is None:
        return np.zeros(model.counts[1])
    assert model.density is not None
    slopes = np.einsum("pfj,cpji->cpfi", model.density.tabulate(places.X)[1], places.inverse)
    gradient = np.einsum("cf,cpfi->cpi", state.density[model.density_dofs], slopes)
    dV = places.dV * (model.per_cell(model.scene.flux.conduction) * model.grows)[:, None]
    return _sum(model.counts[1], model.density_dofs, np.einsum("cp,cpi,cpfi->cf", dV, gradient, slopes))


def _entered(model: Model) -> Floats:
    """∮ δρ r of constant influx."""
    found = np.zeros(model.counts[1])
    for influx in model.scene.influx:
        found += influx.rate * _areas(model, influx.on, density=True)
    return found
