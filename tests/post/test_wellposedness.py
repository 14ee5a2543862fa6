"""Whether the model is well posed: what the exponents say, and what a state shows when it is examined."""

import json
import logging
import subprocess
import sys
from dataclasses import replace

import basix
import numpy as np
import pytest
from blocks import COMM, block, densities, run, square, tangent

import growthx as gx
from growthx.meshing.sampling import volume_ratios
from growthx.model import exponents
from growthx.model.exponents import is_well_posed
from growthx.post.wellposedness import WellPosedness, check
from growthx.scenes.plate import plate

OTHERS = (gx.Q1P0, gx.Q1sri, gx.Q1Q1, gx.S2fri, gx.S2Q1, gx.P1, gx.P1P0, gx.P1P1, gx.P2P1)
NU = 0.25  # of `block`

# -- what the exponents say --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("law", "well_posed"),
    [
        (gx.EnergyDrivenGrowth(0.01, exponent=3.0), True),
        (gx.EnergyDrivenGrowth(0.01, exponent=2.0), False),
        (gx.EnergyDrivenGrowth(0.01, exponent=1.0), False),
        (gx.EnergyDrivenGrowth(0.01, exponent=0.0), False),
        (gx.SpecificEnergyDrivenGrowth(0.01), False),
        (gx.StrainDrivenGrowth(0.01, exponent=1.0), True),
        (gx.StrainDrivenGrowth(0.01, exponent=0.0), False),
        (gx.StressDrivenGrowth(0.01, exponent=3.0), True),
        (gx.StressDrivenGrowth(0.01, exponent=1.0), False),
    ],
    ids=repr,
)
def test_the_exponents_decide(law, well_posed):
    """The stimulus must fall as the density rises: m > n for energies and stresses (n = 2), any m > 0 for strains."""
    assert is_well_posed(block(growth=law)) == well_posed


def test_a_smaller_n_makes_it_well_posed():
    """It is the difference that counts, and n belongs to the material."""
    scene = block(growth=gx.EnergyDrivenGrowth(0.01, exponent=1.0))
    assert not is_well_posed(scene)
    assert is_well_posed(replace(scene, material=gx.Material(1.0, 0.25, 1.2, density_exponent=0.5)))


def test_the_message_comes_once_and_from_one_rank(caplog, monkeypatch):
    """A study of a hundred runs on four ranks needs it once, another exponent once more, a well-posed model never."""
    monkeypatch.setattr(exponents, "_said", set())
    with caplog.at_level(logging.WARNING, logger="growthx"):
        for exponent in (3.0, 0.0, 0.0, 1.0, 0.0):
            gx.discretise(block(growth=gx.EnergyDrivenGrowth(0.01, exponent=exponent)), gx.Q1P0)
    found = [record.getMessage() for record in caplog.records]
    assert len(found) == (2 if COMM.rank == 0 else 0)
    for message, power in zip(found, (2, 1), strict=False):
        assert f"(n − m = {power}, not below 0), so the model is not well posed" in message


# -- the margin --------------------------------------------------------------------------------------------------------


def points_of(problem):
    """At each integration point of the owned cells of Q1: shape gradients, weights, F, in arrays (cells, points, …)."""
    mesh, cell = problem.scene.mesh, basix.CellType.quadrilateral
    points, weights = basix.make_quadrature(cell, problem.variant.momentum_degree)
    basis = basix.create_element(basix.ElementFamily.P, cell, 1).tabulate(1, points)[1:, :, :, 0]
    corners = mesh.domain.geometry.x[mesh.domain.geometry.dofmap[: len(mesh.owned_cells)], :2]
    jacobian = np.einsum("dpn,cni->cpid", basis, corners)
    gradients = np.einsum("dpn,cpdi->cpni", basis, np.linalg.inv(jacobian))
    dofs = problem.displacement_space.dofmap.list[: len(mesh.owned_cells)]
    u = problem.displacement.x.array.reshape(-1, 2)[dofs]
    F = np.eye(2) + np.einsum("cni,cpnj->cpij", u, gradients)
    return points, gradients, weights * volume_ratios(mesh, points), F


def energy_and_inverse(F, lam, mu):
    """Ψ₀ⁿᵉᵒ, ln J and F⁻ᵀ, in plane strain."""
    log = np.log(np.linalg.det(F))
    energy = lam / 2 * log**2 + mu / 2 * ((F**2).sum(axis=(-2, -1)) - 2 - 2 * log)
    return energy, log, np.linalg.inv(F).swapaxes(-2, -1)


LAME = NU / ((1 + NU) * (1 - 2 * NU)), 1 / (2 * (1 + NU))  # E = 1


@pytest.mark.parametrize("exponent", [0.0, 1.0, 2.0, 3.0])
def test_the_margin_is_the_lowest_at_the_points(exponent):
    """1 − Δt c (n − m) [ρ/ρ*]^(n − m) Ψ₀ⁿᵉᵒ/ρ, evaluated anew in NumPy from the nodal displacements."""
    scene = block(square(3, 0.05), growth=gx.EnergyDrivenGrowth(0.01, 5.0, exponent=exponent))
    _, problem = run(scene, gx.Q1)
    points, _, _, F = points_of(problem)
    rho = problem.density_at(points)
    energy, _, _ = energy_and_inverse(F, *LAME)
    slope = 5.0 * (2 - exponent) * (rho / 1.2) ** (2 - exponent) * energy / rho
    lowest = min(COMM.allgather((1 - 0.1 * slope).min()))
    assert check(problem).margin == pytest.approx(lowest, rel=1e-12)
    assert lowest < 1 if exponent < 2 else lowest >= 1


def test_only_what_grows_has_a_margin():
    """An implant under high load has no density to lose: its points must not be counted."""
    growth = gx.EnergyDrivenGrowth(0.01, 5.0, exponent=0.0)
    loads = (gx.Traction("right", (0.1, -0.02)),)
    whole, part = (
        run(block(square(4), growth=growth, loads=loads, growing=growing), gx.Q1)[1] for growing in (None, ("implant",))
    )
    # The bending moment, hence the energy, is highest at the clamped end, which is in the bone.
    assert check(part).margin > check(whole).margin


def test_too_long_a_step_shows():
    """Below zero the balance of mass has lost its unique density: a step of that length tells, whatever the pivots."""
    _, problem = run(block(growth=gx.EnergyDrivenGrowth(0.01, 5.0, exponent=0.0)), gx.Q1)
    found = check(problem)
    assert 0 < found.margin < 1
    problem.state.time_step.value *= 2 / (1 - found.margin)
    longer = check(problem)
    assert longer.margin == pytest.approx(-1.0, rel=1e-9)
    assert not longer.holds and str(longer).startswith("not well posed (m is not above n): ")


@pytest.mark.parametrize(
    ("found", "holds"),
    [
        ((True, 0.5, 0), True),
        ((True, 0.5, 1), False),
        ((True, -0.5, 0), False),
        ((True, 0.0, 0), False),
        ((False, 0.5, 0), False),
    ],
)
def test_all_must_hold(found, holds):
    """A unique density does not make the equilibrium stable, nor the other way round, nor one state all of them."""
    assert WellPosedness(*found).holds == holds


# -- the tangent for long steps ----------------------------------------------------------------------------------------


def long_step_tangent(problem, exponent):
    """Of Q1, dense and without supports, for Δt → ∞, from the paper's (39) worked out by hand for the law (6).

    ∂_ρP̄ ⊗ [∂_ρR₀]⁻¹ ∂_FR₀ is n [ρ/ρ*]ⁿ/([n − m] Ψ₀ⁿᵉᵒ) P ⊗ P, with P = ∂Ψ₀ⁿᵉᵒ/∂F.
    """
    points, gradients, weights, F = points_of(problem)
    (lam, mu), rho = LAME, problem.density_at(points)
    energy, log, inverse = energy_and_inverse(F, lam, mu)
    stress = mu * F + (lam * log - mu)[..., None, None] * inverse
    moduli = mu * np.einsum("ik,jl->ijkl", np.eye(2), np.eye(2)) + lam * np.einsum(
        "cpij,cpkl->cpijkl", inverse, inverse
    )
    moduli = moduli + np.einsum("cp,cpil,cpkj->cpijkl", mu - lam * log, inverse, inverse)
    moduli -= np.einsum("cp,cpij,cpkl->cpijkl", 2 / ((2 - exponent) * energy), stress, stress)
    local = np.einsum("cp,cpnj,cpijkl,cpml->cnimk", weights * (rho / 1.2) ** 2, gradients, moduli, gradients)
    space = problem.displacement_space
    nodes = space.dofmap.list[: len(local)]
    dofs = 2 * space.dofmap.index_map.local_to_global(nodes.ravel()).reshape(nodes.shape)[..., None] + [0, 1]
    dofs = dofs.reshape(len(local), -1)
    dense = np.zeros((problem.dofs, problem.dofs))
    np.add.at(dense, (dofs[:, :, None], dofs[:, None, :]), local.reshape(*dofs.shape, dofs.shape[1]))
    return COMM.allreduce(dense)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 3.0])
def test_negative_pivots_are_negative_eigenvalues(exponent):
    """Sylvester's law on a matrix assembled in NumPy by a formula of its own, its eigenvalues counted one by one."""
    scene = block(square(3, 0.05), growth=gx.EnergyDrivenGrowth(0.01, 5.0, exponent=exponent))
    _, problem = run(scene, gx.Q1)
    dense = long_step_tangent(problem, exponent)
    offset = 2 * problem.displacement_space.dofmap.index_map.local_range[0]
    own = np.concatenate([held.dofs[held.dofs < problem.system.owned] for held in problem.system.supports.held])
    held = np.unique(np.concatenate(COMM.allgather(offset + own)))
    free = np.setdiff1d(np.arange(problem.dofs), held)
    assert len(held) == 8
    eigenvalues = np.linalg.eigvalsh(dense[np.ix_(free, free)])
    assert np.abs(eigenvalues).min() > 1e-6 * eigenvalues.max(), "none may be in doubt"
    assert check(problem).negative == np.sum(eigenvalues < 0)
    assert (eigenvalues.min() < 0) == (exponent < 2)


def bent(exponent, variant=gx.Q1P0, cells=8):
    """The plate of exponent m at t = 1, under its full load."""
    scene = plate(cells, m=exponent, shape=variant.cells[0])
    return gx.solve(replace(scene, program=gx.Program(step=0.1, until=1.0, ramp=0.5)), variant).problem


@pytest.mark.parametrize("exponent", [0.0, 1.0, 3.0])
def test_only_the_long_step_reveals_what_is_ill_posed(exponent):
    """The tangent that Newton sees is positive definite even for m = 0: its pivots would say that all is well."""
    problem = bent(exponent)
    found = check(problem)
    assert (found.negative > 0) == (exponent < 2)
    assert found.holds == (exponent > 2)
    assert found.margin > 0, "at this step length the density is unique: the margin alone would not tell either"
    problem.system.begin_step(0.1, 1.0, 1.1)
    exact = tangent(problem)
    assert np.linalg.eigvalsh((exact + exact.T) / 2).min() > 0


@pytest.mark.parametrize("variant", OTHERS, ids=lambda variant: variant.name)
@pytest.mark.parametrize("exponent", [0.0, 3.0])
def test_every_kind_of_density_is_judged(variant, exponent):
    """The criterion is one of points: densities at nodes and per cell are taken there, and judged alike."""
    found = check(bent(exponent, variant, 4))
    assert found.holds == (exponent == 3.0)
    assert (found.negative > 0) == (exponent == 0.0)


def test_the_model_and_not_what_is_added_to_it_is_judged():
    """Flux and inertia make no symmetric matrix: they are left out, and with them nothing else changes."""
    scene = replace(plate(4), program=gx.Program(step=0.1, until=0.5, ramp=0.5))
    for changes in ({"flux": gx.MassFlux(0.01)}, {"inertia": gx.Inertia()}, {"flux": gx.MassFlux(0.01), "m": 0.0}):
        exponent = changes.pop("m", 3.0)
        law = gx.EnergyDrivenGrowth(attractor=0.02, rate=10.0, exponent=exponent)
        found = check(gx.solve(replace(scene, growth=law, **changes), gx.Q1Q1).problem)
        assert (found.negative > 0) == (exponent == 0.0)


@pytest.mark.parametrize("variant", OTHERS[:4], ids=lambda variant: variant.name)
@pytest.mark.parametrize("exponent", [0.0, 3.0])
def test_a_density_that_was_carried_to_a_mesh_is_judged(variant, exponent):
    """It is made for one variant's densities, and the criterion is one of points."""
    before = bent(exponent, variant, 4)
    mesh = plate(3).mesh
    scene = replace(before.scene, mesh=mesh, initial_density=gx.transfer(before, mesh, variant))
    found = check(gx.solve(scene, variant).problem)
    assert found.holds == (exponent == 3.0)
    assert (found.negative > 0) == (exponent == 0.0)


@pytest.mark.parametrize("exponent", [0.0, 3.0])
def test_load_cases_are_judged_together(exponent):
    """The density that all cases share makes one system of them."""
    cases = (
        gx.LoadCase("pull", 3.0, (gx.Traction("right", (0.1, 0.0)),)),
        gx.LoadCase("lift", 1.0, (gx.Traction("right", (0.0, 0.05)),)),
    )
    scene = block(square(3), loads=(), cases=cases, growth=gx.EnergyDrivenGrowth(0.01, 5.0, exponent=exponent))
    found = check(run(scene, gx.Q1P0)[1])
    assert (found.negative > 0) == (exponent == 0.0)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_a_check_changes_nothing(variant):
    """A march that is watched must be the march that is not."""
    scene = block()
    _, plain = run(scene, variant)
    problem = gx.discretise(scene, variant)
    for _ in gx.march(scene, variant, problem):
        before = [f.x.array.copy() for f in (problem.system.unknown, problem.density, problem.state.old_density)]
        check(problem)
        for function, values in zip(
            (problem.system.unknown, problem.density, problem.state.old_density), before, strict=True
        ):
            assert np.array_equal(function.x.array, values)
    assert densities(problem) == pytest.approx(densities(plain), abs=0)


# -- the command line --------------------------------------------------------------------------------------------------


def growthx(*arguments, folder):
    """Run `growthx plate` in a folder, as its own process."""
    command = [sys.executable, "-m", "growthx", "plate", "--elements", "4", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)


@pytest.mark.serial
def test_the_command_checks_on_request(tmp_path):
    """A sentence for people, two numbers for programs, and neither where nobody asked."""
    asked, silent = growthx("--check", folder=tmp_path), growthx(folder=tmp_path)
    assert asked.returncode == silent.returncode == 0
    assert "plate: well posed: 1 − Δt ∂R₀/∂ρ is at least" in " ".join(asked.stdout.split())
    assert "well posed" not in silent.stdout
    answer = json.loads(growthx("--check", "--json", folder=tmp_path).stdout)["well_posedness"]
    assert answer["negative"] == 0 and answer["margin"] >= 1
