"""Fields by name: energies, strains and stresses are those of the body, wherever they are told."""

import re
from dataclasses import replace
from pathlib import Path

import dolfinx
import numpy as np
import pytest
from blocks import COMM, ROLLERS, block, cube, gathered, square

import growthx as gx
from growthx import results
from growthx.common.errors import InputError
from growthx.discretisation.variants import CATALOGUE
from growthx.fem import kernels
from growthx.fem.assembly import assemble
from growthx.post import derived
from growthx.post.fields import tensors
from growthx.post.smoothing import corner_space

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
in_space = [gx.Q1P0, gx.S2fri, gx.Q2, gx.P1P0, gx.P2P1, gx.P2P2]
STILL = gx.EnergyDrivenGrowth(attractor=0.0, rate=0.0)
SYMMETRIC = ("green_lagrange_strain", "hencky_strain", "cauchy_stress")
NAMES = (*SYMMETRIC, "first_piola_stress", "strain_energy", "strain_energy_per_mass", "young", "von_mises")
VECTORS = ("principal_stresses", "principal_strains", *(f"stress_direction_{i}" for i in (1, 2, 3)), "displacement")


def mesh_for(variant, dim, cells=2, distortion=0.05):
    """A small body of a variant's cells in so many dimensions."""
    make = square if dim == 2 else cube
    return make(cells, distortion, shape=variant.cells[dim - 2])


def deformed(variant, dim, H, density=0.9):
    """A body at rest but for u = H x, of a density that is not ρ* = 1.2, and its material."""
    scene = block(mesh_for(variant, dim), growth=STILL, initial_density=density)
    problem = gx.discretise(scene, variant)
    problem.displacement.interpolate(lambda x: np.asarray(H) @ x[:dim])
    problem.displacement.x.scatter_forward()
    return problem


def everywhere(problem, names):
    """All numbers of each field on this rank: of cells, of nodes, and at points, in rows."""
    found = [read(problem, names) for read in (results.cell_fields, results.node_fields, results.point_fields)]
    shapes = {name: derived.SHAPES[results.FIELDS[name].rank] for name in names}
    return {name: np.concatenate([each[name].reshape(-1, *shapes[name]) for each in found]) for name in names}


def neo_hookean(H, density, material):
    """Energy, Cauchy and first Piola–Kirchhoff stress of F = I + H in space by the textbook, and the weight."""
    F = np.eye(3)
    F[: len(H), : len(H)] += H
    lam, mu = material.lame
    J, weight = np.linalg.det(F), (density / material.reference_density) ** material.density_exponent
    energy = weight * (lam / 2 * np.log(J) ** 2 + mu / 2 * (np.trace(F.T @ F) - 3 - 2 * np.log(J)))
    sigma = weight * (lam * np.log(J) * np.eye(3) + mu * (F @ F.T - np.eye(3))) / J
    return F, energy, sigma, J * sigma @ np.linalg.inv(F).T, weight


@pytest.mark.parametrize(
    ("variant", "dim"),
    [*((variant, 2) for variant in CATALOGUE.values()), *((variant, 3) for variant in in_space)],
    ids=str,
)
def test_a_homogeneous_deformation_by_the_textbook(variant, dim):
    """Every field of every variant, in cells, at nodes and points: F alone says what they are; σ_zz is one of them."""
    H = np.array([[0.08, 0.05, 0.02], [-0.03, -0.04, 0.01], [0.0, 0.03, 0.06]])[:dim, :dim]
    problem = deformed(variant, dim, H)
    F, energy, sigma, piola, weight = neo_hookean(H, 0.9, problem.scene.material)
    squares, axes = np.linalg.eigh(F.T @ F)
    stresses, lines = np.linalg.eigh(sigma)
    known = {
        "strain_energy": energy,
        "strain_energy_per_mass": energy / 0.9,
        "young": weight * problem.scene.material.young,
        "cauchy_stress": sigma,
        "first_piola_stress": piola,
        "green_lagrange_strain": (F.T @ F - np.eye(3)) / 2,
        "hencky_strain": axes @ np.diag(np.log(squares) / 2) @ axes.T,
        "von_mises": np.sqrt(1.5 * np.sum((sigma - np.trace(sigma) / 3 * np.eye(3)) ** 2)),
        "principal_stresses": stresses[::-1],
        "principal_strains": np.log(squares[::-1]) / 2,
    }
    found = everywhere(problem, (*known, "stress_direction_1", "stress_direction_3", "strain_direction_1"))
    for name, value in known.items():
        assert found[name] == pytest.approx(np.broadcast_to(value, found[name].shape), rel=1e-9, abs=1e-12), name
    pairs = {"stress_direction_1": lines[:, 2], "stress_direction_3": lines[:, 0], "strain_direction_1": axes[:, 2]}
    for name, line in pairs.items():
        assert np.abs(found[name] @ line) == pytest.approx(np.ones(len(found[name])), rel=1e-9), name
        assert np.all(np.take_along_axis(found[name], np.abs(found[name]).argmax(axis=1)[:, np.newaxis], 1) > 0)
    assert dim == 3 or np.all(found["cauchy_stress"][:, 2, 2] != 0)


@variants
def test_simple_shear_by_hand(variant):
    """F = I + γ e₁⊗e₂: σ = μ [ρ/ρ*]ⁿ (γ² e₁⊗e₁ + γ (e₁⊗e₂ + e₂⊗e₁)), no σ_zz, √3 μγ of von Mises for small γ."""
    gamma = 0.01
    problem = deformed(variant, 2, [[0.0, gamma], [0.0, 0.0]])
    mu = (0.9 / 1.2) ** 2 * 1.0 / (2 * 1.25)
    found = everywhere(problem, ("cauchy_stress", "von_mises", "green_lagrange_strain"))
    sigma = mu * np.array([[gamma**2, gamma, 0.0], [gamma, 0.0, 0.0], [0.0, 0.0, 0.0]])
    strain = np.array([[0.0, gamma / 2, 0.0], [gamma / 2, gamma**2 / 2, 0.0], [0.0, 0.0, 0.0]])
    assert found["cauchy_stress"] == pytest.approx(np.broadcast_to(sigma, found["cauchy_stress"].shape), abs=1e-14)
    assert found["green_lagrange_strain"] == pytest.approx(
        np.broadcast_to(strain, found["green_lagrange_strain"].shape), abs=1e-14
    )
    assert found["von_mises"] == pytest.approx(np.sqrt(3) * mu * gamma, rel=1e-4)


def pulled(variant, dim, traction, **changes):
    """A block on rollers, pulled to the right by a dead traction, solved."""
    rollers = ROLLERS if dim == 2 else (gx.Support("left", (0.0, None, None)),)
    if dim == 3:
        rollers += (gx.Support("bottom", (None, 0.0, None)), gx.Support("front", (None, None, 0.0)))
    loads = (gx.Traction("right", (traction, 0.0, 0.0)[:dim]),)
    scene = block(mesh_for(variant, dim), supports=rollers, loads=loads, growth=STILL, **changes)
    return gx.solve(scene, variant, tolerance=1e-12).problem


@pytest.mark.parametrize(("variant", "dim"), [(gx.Q1, 2), (gx.P2, 2), (gx.Q1Q1, 2), (gx.Q1P0, 3), (gx.P2, 3)], ids=str)
def test_uniaxial_tension_by_hand(variant, dim):
    """The dead traction t is P_xx; σ_xx = t λ_x/J; in plane strain σ_zz = ν (σ_xx + σ_yy) where strains are small."""
    traction = 1e-4
    problem = pulled(variant, dim, traction)
    found = everywhere(problem, ("first_piola_stress", "cauchy_stress", "hencky_strain", "principal_stresses"))
    axis = np.zeros((3, 3))
    axis[0, 0] = traction
    if dim == 2:
        axis[2, 2] = 0.25 * traction  # ν = 1/4
    for name in ("first_piola_stress", "cauchy_stress"):
        assert found[name] == pytest.approx(np.broadcast_to(axis, found[name].shape), abs=1e-3 * traction), name
    assert found["first_piola_stress"][:, 0, 0] == pytest.approx(traction, rel=1e-9)
    strain = traction * (1 - 0.25**2 if dim == 2 else 1.0)  # E = 1, density ρ*
    assert found["hencky_strain"][:, 0, 0] == pytest.approx(strain, rel=1e-3)
    assert found["principal_stresses"] == pytest.approx(
        np.broadcast_to(np.sort(np.diag(axis))[::-1], (len(found["cauchy_stress"]), 3)), abs=1e-3 * traction
    )


def volumes(mesh):
    """The volume of each owned cell."""
    import ufl

    space = dolfinx.fem.functionspace(mesh.domain, ("DG", 0))
    return assemble(kernels.form(ufl.TestFunction(space) * mesh.volume_measure(None, 4)))


def work(problem, traction):
    """∮ t · u dA over the right side."""
    mesh = problem.scene.mesh
    form = sum(t * problem.displacement[i] for i, t in enumerate(traction)) * mesh.boundary_measure("right", 4)
    return COMM.allreduce(dolfinx.fem.assemble_scalar(kernels.form(form)))


@pytest.mark.parametrize(
    ("variant", "dim"),
    [*((variant, 2) for variant in CATALOGUE.values()), *((variant, 3) for variant in (gx.Q1P0, gx.P1P0, gx.P2P1))],
    ids=str,
)
def test_the_energy_is_the_work_of_the_loads(variant, dim):
    """In the linear limit ∫ Ψ₀ dV = ½ ∮ t · u dA, bent and stretched, with a part that rests; and ∫ Ψ₀ dV of masses."""
    traction = (1e-4, -2e-5, 1e-5)[:dim]
    scene = block(
        mesh_for(variant, dim),
        loads=(gx.Traction("right", traction),),
        growth=STILL,
        initial_density=0.9,
        material=gx.Material(young={"bone": 1.0, "implant": 3.0}, poisson=0.25, reference_density=1.2),
        growing=("bone",),
    )
    problem = gx.solve(scene, variant, tolerance=1e-12).problem
    fields = results.cell_fields(problem, ("strain_energy", "young"))
    size = volumes(scene.mesh)
    energy = COMM.allreduce(float(fields["strain_energy"] @ size))
    assert energy == pytest.approx(work(problem, traction) / 2, rel=2e-3)
    assert set(gathered(fields["young"]).round(9)) == {0.5625, 3.0}  # of what rests no density is a weight


@variants
def test_energy_per_mass_integrates_with_the_density(variant):
    """Where densities vary inside a cell too: ρ times the energy per mass is the energy per volume at each point."""
    scene = block(mesh_for(variant, 2), initial_density=lambda x: 0.8 + 0.4 * x[0])
    problem = gx.solve(scene, variant).problem
    found = results.point_fields(problem, ("strain_energy", "strain_energy_per_mass", "density"))
    assert found["strain_energy_per_mass"] * found["density"] == pytest.approx(found["strain_energy"], rel=1e-12)
    assert np.ptp(gathered(found["strain_energy"].ravel())) > 1e-4


def test_principal_values_against_numpy():
    """At each point of a bent body those that NumPy finds of the stress there, with directions σ n = s n, |n| = 1."""
    problem = gx.solve(block(mesh_for(gx.Q1, 3)), gx.Q1).problem
    names = ("cauchy_stress", "principal_stresses", "stress_direction_1", "stress_direction_2", "stress_direction_3")
    stress, values, *directions = results.point_fields(problem, names).values()
    assert values == pytest.approx(np.linalg.eigvalsh(stress)[..., ::-1], abs=1e-14)
    for number, direction in enumerate(directions):
        along = np.einsum("cpij,cpj->cpi", stress, direction)
        assert along == pytest.approx(values[..., number, np.newaxis] * direction, abs=1e-13)
        assert np.linalg.norm(direction, axis=-1) == pytest.approx(1.0)


def test_von_mises_is_invariant():
    """Neither a turn of the axes nor a pressure changes it; in uniaxial tension it is the stress, in shear √3 τ."""
    generator = np.random.default_rng(0)
    above = np.triu_indices(3)
    stress = generator.normal(size=(20, 3, 3))
    stress += np.swapaxes(stress, 1, 2)
    turn = np.linalg.qr(generator.normal(size=(20, 3, 3)))[0]
    turned = turn @ stress @ np.swapaxes(turn, 1, 2) + generator.normal(size=(20, 1, 1)) * np.eye(3)
    one, other = (tensors.von_mises(each[:, above[0], above[1]]) for each in (stress, turned))
    assert other == pytest.approx(one, rel=1e-12)
    assert tensors.von_mises(np.array([-2.0, 0, 0, 0, 0, 0])) == pytest.approx(2.0)
    assert tensors.von_mises(np.array([0, 3.0, 0, 0, 0, 0])) == pytest.approx(3.0 * np.sqrt(3))


@pytest.mark.parametrize("dim", [2, 3])
def test_a_turned_body_has_the_same_strains(dim):
    """Q F in place of F: strains, energies and invariants of the stress stay, for finite turns too."""
    H = np.array([[0.08, 0.05, 0.02], [-0.03, -0.04, 0.01], [0.0, 0.03, 0.06]])[:dim, :dim]
    angle = 0.7
    Q = np.eye(dim)
    Q[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    names = ("green_lagrange_strain", "hencky_strain", "strain_energy", "von_mises", "principal_stresses")
    one, other = (
        everywhere(deformed(gx.Q1, dim, gradient), names) for gradient in (H, Q @ (np.eye(dim) + H) - np.eye(dim))
    )
    for name in names:
        assert other[name] == pytest.approx(one[name], rel=1e-9, abs=1e-12), name


def test_small_strains_keep_their_digits():
    """At 1e-9 a strain formed as F − I would have six digits; Hencky's agrees with the linear one to nine."""
    found = everywhere(deformed(gx.Q1, 2, [[1e-9, 0.0], [0.0, 0.0]]), ("hencky_strain", "cauchy_stress"))
    assert found["hencky_strain"][:, 0, 0] == pytest.approx(1e-9, rel=1e-8)
    lam = 0.25 / (1.25 * 0.5)
    assert found["cauchy_stress"][:, 2, 2] == pytest.approx((0.9 / 1.2) ** 2 * lam * 1e-9, rel=1e-7)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q2, gx.S2fri, gx.P2], ids=str)
def test_what_is_linear_is_so_at_nodes(variant):
    """Values at points are carried to the corners and averaged there, on any number of ranks: nothing of it is lost."""
    material = gx.Material(young=2.0, poisson=0.25, density_exponent=1)
    scene = block(
        mesh_for(variant, 2, 3, 0.0), material=material, growth=STILL, initial_density=lambda x: 1 + x[0] + 2 * x[1]
    )
    problem = gx.discretise(scene, variant)
    places = corner_space(problem).tabulate_dof_coordinates()
    young = results.node_fields(problem, ("young",))["young"]
    assert young == pytest.approx(2 * (1 + places[:, 0] + 2 * places[:, 1]), rel=1e-10)


@variants
def test_nodes_have_the_displacement_and_the_smoothed_density(variant):
    """What is known at nodes is told as it is there, and densities as `smoothed_density` has them."""
    from growthx.post.smoothing import smoothed_density

    problem = gx.solve(block(mesh_for(variant, 2)), variant).problem
    found = results.node_fields(problem, ("displacement", "density"))
    assert found["density"] == pytest.approx(smoothed_density(problem).x.array, rel=1e-10)
    corners = dolfinx.fem.Function(dolfinx.fem.functionspace(problem.scene.mesh.domain, ("Lagrange", 1, (2,))))
    corners.interpolate(problem.displacement)
    assert found["displacement"][:, :2].ravel() == pytest.approx(corners.x.array, rel=1e-10, abs=1e-14)
    assert not found["displacement"][:, 2].any()


def test_load_cases_count_by_their_weights():
    """Two cases of a body: energies and strains are the weighted means of what each alone has."""
    pull, push = (gx.Traction("right", (value, 0.0)) for value in (0.1, -0.05))
    names = ("strain_energy", "green_lagrange_strain", "cauchy_stress")

    def fields(**loads):
        scene = block(mesh_for(gx.Q1, 2), supports=ROLLERS, growth=STILL, **{"loads": (), **loads})
        return everywhere(gx.solve(scene, gx.Q1, tolerance=1e-12).problem, names)

    cases = (gx.LoadCase("pull", 3.0, (pull,)), gx.LoadCase("push", 1.0, (push,)))
    both, one, other = fields(cases=cases), fields(loads=(pull,)), fields(loads=(push,))
    for name in names:
        assert both[name] == pytest.approx(0.75 * one[name] + 0.25 * other[name], rel=1e-7, abs=1e-10), name


@pytest.mark.parametrize("dim", [2, 3])
def test_an_energy_of_ones_own_has_its_stress(dim):
    """Fields are by the scene's own law: St. Venant and Kirchhoff's, P = F [λ tr E I + 2 μ E], with σ_zz = λ tr E."""
    from dataclasses import dataclass

    import ufl

    @dataclass(frozen=True)
    class Venant(gx.StoredEnergy):
        def energy(self, F):
            strain = (F.T * F - ufl.Identity(3)) / 2
            return 0.2 * ufl.tr(strain) ** 2 + 0.4 * ufl.inner(strain, strain)

        @property
        def stiffness(self):
            return 1.0

    H = np.array([[0.08, 0.05, 0.02], [-0.03, -0.04, 0.01], [0.0, 0.03, 0.06]])[:dim, :dim]
    scene = block(mesh_for(gx.Q1, dim), material=Venant(), growth=STILL)
    problem = gx.discretise(scene, gx.Q1)
    problem.displacement.interpolate(lambda x: H @ x[:dim])
    F = np.eye(3)
    F[:dim, :dim] += H
    strain = (F.T @ F - np.eye(3)) / 2
    piola = F @ (0.4 * np.trace(strain) * np.eye(3) + 0.8 * strain)
    found = everywhere(problem, ("first_piola_stress", "cauchy_stress"))
    sigma = piola @ F.T / np.linalg.det(F)
    for name, value in (("first_piola_stress", piola), ("cauchy_stress", sigma)):
        assert found[name] == pytest.approx(np.broadcast_to(value, found[name].shape), rel=1e-9, abs=1e-13), name


# -- which, and where --------------------------------------------------------------------------------------------------


@pytest.fixture
def only(monkeypatch):
    """Lets no field but some be evaluated: of all others the value is a failure."""

    def refuse(problem):
        pytest.fail("a field was compiled that nobody had asked for")

    def allow(*names):
        table = {
            name: field if name in names else replace(field, value=refuse, reading=None, exact=None)
            for name, field in derived.FIELDS.items()
        }
        monkeypatch.setattr(derived, "FIELDS", table)

    return allow


def arrays(folder, name):
    """Names of the arrays that the first state of a series shows, by where they are."""
    text = (folder / f"{name}000000.pvtu").read_text()
    return {
        place: re.findall(
            r'<PDataArray [^>]*Name="([^"]*)"', text.partition(f"<P{place}>")[2].partition(f"</P{place}>")[0]
        )
        for place in ("PointData", "CellData")
    }


def test_nothing_is_evaluated_that_was_not_asked_for(only, shared_folder):
    """Energies of a large body cost time and room: neither is spent on others beside them, nor on other places."""
    only("strain_energy")
    gx.solve(block(mesh_for(gx.Q1, 2)), gx.Q1, out=shared_folder / "out", fields=("strain_energy:cells",))
    COMM.barrier()
    assert arrays(shared_folder / "out", "fields") == {
        "PointData": ["displacement"],
        "CellData": ["strain_energy_in_cells"],
    }
    assert {file.stem for file in (shared_folder / "out").glob("*.pvd")} == {"fields"}


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1sri, gx.Q1, gx.Q1Q1], ids=str)
def test_without_a_choice_no_other_fields_are_evaluated(variant, only, shared_folder):
    """A plain run costs what it did, whatever rows the table has."""
    usual = ["density", "relative_change", "stimulus", "mass_source", "major_stress", "minor_stress"]
    only(*usual)
    gx.solve(block(mesh_for(variant, 2)), variant, out=shared_folder / "out")
    COMM.barrier()
    assert arrays(shared_folder / "out", "fields")["CellData"] == usual
    raw = arrays(shared_folder / "out", "raw")["CellData"]
    assert sorted(raw) == (sorted(usual[:3]) if variant.density.local else [])


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", CATALOGUE)
def test_names_in_files_tell_where_values_are_known(name, dim, shared_folder):
    """Of every variant in the plane and in space; those that no cell can be cut for, too."""
    variant = CATALOGUE[name]
    scene = block(mesh_for(variant, dim, 4 - dim), growing=("bone",) if dim == 2 else None)
    problem = gx.solve(scene, variant, out=shared_folder / "out", fields=("strain_energy", "density:points")).problem
    COMM.barrier()
    grows = ["grows"] if problem.rests else []
    assert arrays(shared_folder / "out", "fields") == {
        "PointData": ["displacement", "strain_energy_at_nodes"],
        "CellData": ["strain_energy_in_cells", *grows],
    }
    assert arrays(shared_folder / "out", "points") == {
        "PointData": ["displacement"],
        "CellData": ["strain_energy_at_points", "density_at_points", *grows],
    }


@pytest.mark.serial
def test_vtk_reads_vectors_and_tensors(tmp_path):
    """With their three and nine entries, and the numbers that scripts get, cell by cell, point by point."""
    pyvista = pytest.importorskip("pyvista")
    names = ("cauchy_stress", "principal_stresses", "strain_energy")
    problem = gx.solve(block(mesh_for(gx.P2P2, 3, 1)), gx.P2P2, out=tmp_path / "out", fields=names).problem
    cells, points = (pyvista.read(tmp_path / "out" / f"{stem}_p0_000000.vtu") for stem in ("fields", "points"))
    means, at_points = results.cell_fields(problem, names), results.point_fields(problem, names)
    for name in names:
        rows = means[name].reshape(len(means[name]), -1)
        assert cells.cell_data[f"{name}_in_cells"].reshape(rows.shape) == pytest.approx(rows, rel=1e-14)
        rows = at_points[name].reshape(points.n_cells, -1)
        assert points.cell_data[f"{name}_at_points"].reshape(rows.shape) == pytest.approx(rows, rel=1e-14)
        assert f"{name}_at_nodes" in cells.point_data
    assert cells.cell_data["cauchy_stress_in_cells"].shape[1] == 9
    # Fourteen points of a tetrahedron: a small one stands about each of them.
    count = len(problem.variant.integration_points("tetrahedron"))
    assert points.n_cells == count * cells.n_cells


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        (("mises",), r"there is no field 'mises': one of density, .*von_mises.* would be right"),
        (("von_mises:corners",), r"'von_mises' is wanted at 'corners': one of cells, nodes, points.*would be right"),
        (("von_mises:",), r"'von_mises' is wanted at ''"),
        ("von_mises", r"the fields are the text 'von_mises': a tuple of names"),
        ((), r"no field is named: some of density, .* would be right"),
        ((7,), r"the name of a field is 7: a name in quotes would be right"),
        (3, r"the fields is 3: a tuple of names would be right"),
    ],
    ids=str,
)
def test_fields_that_are_none_are_refused(fields, sentence, shared_folder):
    """Before the run, in one sentence with those that there are; and no folder is made."""
    with pytest.raises(InputError, match=sentence):
        gx.solve(block(), gx.Q1, out=shared_folder / "out", fields=fields)
    assert not (shared_folder / "out").exists()


def test_fields_without_a_folder_are_refused():
    """They would be lost without a word."""
    with pytest.raises(InputError, match="the fields von_mises are to be written, but nowhere: a folder"):
        gx.solve(block(), gx.Q1, fields=("von_mises",))


def test_a_field_that_a_law_lacks_is_refused(shared_folder):
    """A stimulus of a source that is stated without one, before the run costs time."""
    from dataclasses import dataclass

    @dataclass(frozen=True)
    class Toy(gx.MassSource):
        def mass_source(self, density, elastic_energy, material):
            return 0.0 * density

    scene = block(growth=Toy())
    for ask in (
        lambda: gx.solve(scene, gx.Q1, out=shared_folder / "out", fields=("stimulus",)),
        lambda: results.cell_fields(gx.discretise(scene, gx.Q1), ("stimulus",)),
    ):
        with pytest.raises(InputError, match=r"no field 'stimulus' of the law Toy in plane strain: some of .* right"):
            ask()


def test_a_field_of_ones_own_is_chosen_like_any_other(monkeypatch, shared_folder):
    """With its name in the files; the table of a row is one place."""
    monkeypatch.setattr(derived, "FIELDS", dict(derived.FIELDS))
    results.register(results.DerivedField("twice", lambda problem: 2 * problem.expressions.density(), told=False))
    problem = gx.discretise(block(), gx.Q1)
    assert "twice" not in results.cell_fields(problem)
    assert results.cell_fields(problem, ("twice",))["twice"] == pytest.approx(2.4, rel=1e-12)


def test_rows_say_what_they_are():
    """Titles and units are what tables and pictures show of a field; the command's help names them all."""
    from growthx.cli.scene_run import FIELDS

    told = re.findall(r"[a-z_0-9]+", FIELDS.partition("; of ")[2].partition("(")[0])
    assert told == list(derived._OURS)
    page = (Path(__file__).parents[2] / "docs" / "fields.md").read_text(encoding="utf-8")
    for field in derived.TABLE:
        assert field.title and field.unit, field.name
        kind = ("scalar", "vector", "tensor")[field.rank]
        assert f"| `{field.name}` | {field.title} | {field.unit} | {kind} |" in page
