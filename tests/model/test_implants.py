"""What does not grow, such as an implant: as stiff as it is given, of its own density, and apart from what grows."""

from dataclasses import replace

import dolfinx
import numpy as np
import pytest
import ufl
from blocks import COMM, block, densities, displacements, gathered, run, square
from scipy.optimize import brentq

import growthx as gx
from growthx import baselines, plots, report, results
from growthx.common.errors import InputError
from growthx.discretisation.variants import CATALOGUE
from growthx.post.smoothing import smoothed_density
from growthx.post.zones import area_means

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
STILL = gx.EnergyDrivenGrowth(0.01, rate=0.0)
SOFT, STIFF, REFERENCE, START, MOVED = 500.0, 110_000.0, 1.2, 0.8, 0.01
WEIGHT = (START / REFERENCE) ** 2


# -- layers with a known reaction: for ν = 0, P = ½ E (λ − 1/λ) --------------------------------------------------------


def stress(young, stretch):
    """P̄ of a bar without a weight."""
    return young / 2 * (stretch - 1 / stretch)


def stretch(young, stress):
    """The stretch at a P̄."""
    return stress / young + np.sqrt((stress / young) ** 2 + 1)


IN_PARALLEL = stress(WEIGHT * SOFT + STIFF, 1 + MOVED)
IN_SERIES = brentq(lambda P: stretch(WEIGHT * SOFT, P) + stretch(STIFF, P) - 2 - MOVED, 0, 100, xtol=1e-14)


def layers(shape, dim=2, *, along=1, **changes):
    """Two unit layers, "bone" and "implant", side by side `along` a direction, whose ends in x are pulled apart."""
    cell = getattr(dolfinx.mesh.CellType, shape)
    lengths = [2.0 if i == along else 1.0 for i in range(dim)]
    make = dolfinx.mesh.create_rectangle if dim == 2 else dolfinx.mesh.create_box
    domain = make(COMM, [[0.0] * dim, lengths], [4 if i == along else 2 for i in range(dim)], cell)
    ends = {"left": (0, 0.0), "right": (0, lengths[0]), "bottom": (1, 0.0), "front": (2, 0.0)}
    mesh = gx.Mesh.with_names(
        domain,
        {name: lambda x, i=i, at=at: np.isclose(x[i], at) for name, (i, at) in ends.items() if i < dim},
        {"bone": lambda x: x[along] <= 1 + 1e-9, "implant": lambda x: x[along] >= 1 - 1e-9},
    )
    held = [("left", 0, 0.0), ("right", 0, MOVED), ("bottom", 1, 0.0), ("front", 2, 0.0)][: dim + 1]
    scene = gx.Scene(
        name="layers",
        mesh=mesh,
        material=gx.Material({"bone": SOFT, "implant": STIFF}, 0.0, REFERENCE, 2),
        growth=STILL,
        supports=tuple(gx.Support(on, tuple(by if j == i else None for j in range(dim))) for on, i, by in held),
        loads=(),
        program=gx.Program(step=1.0, until=1.0),
        initial_density=START,
        growing=("bone",),
    )
    return replace(scene, **changes)


def reaction(scene, variant, **options):
    """Force on the pulled end."""
    steps, _ = run(scene, variant, tolerance=1e-13, **options)
    return steps[-1].reactions["right"][0]


def test_the_reaction_by_hand():
    """The number of the report: 250 · 4/9 and 55 000 times 1.01 − 1/1.01."""
    assert abs(IN_PARALLEL - 1096.766) < 5e-4
    by_hand = (250 * 4 / 9 + 55_000) * (1.01 - 1 / 1.01)
    assert by_hand == pytest.approx(IN_PARALLEL, rel=1e-12)


@variants
@pytest.mark.parametrize(("along", "exact"), [(1, IN_PARALLEL), (0, IN_SERIES)], ids=["parallel", "series"])
def test_an_implant_is_as_stiff_as_it_is_given(variant, along, exact):
    """[ρ/ρ*]ⁿ is bone's: an implant of E = 110 000 has that, whatever density it was given."""
    assert reaction(layers(variant.cells[0], along=along), variant) == pytest.approx(exact, rel=1e-8)


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1P0, gx.Q1, gx.P1P1, gx.P1P0, gx.P2P1], ids=lambda v: v.name)
@pytest.mark.parametrize(("along", "exact"), [(1, IN_PARALLEL), (0, IN_SERIES)], ids=["parallel", "series"])
def test_in_space_too(variant, along, exact):
    """The same bodies, of hexahedra and tetrahedra."""
    assert reaction(layers(variant.cells[1], 3, along=along), variant) == pytest.approx(exact, rel=1e-8)


def as_function(mesh, value, degree=0):
    """A DOLFINx function from a function of position."""
    family = "DG" if degree == 0 else "Lagrange"
    function = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, (family, degree)))
    function.interpolate(value)
    return function


STEPS = {
    "function": lambda mesh, bone, implant: lambda x: np.where(x[1] < 1, bone, implant),
    "DOLFINx function": lambda mesh, bone, implant: as_function(mesh, lambda x: np.where(x[1] < 1, bone, implant)),
    "dictionary": lambda mesh, bone, implant: {"bone": bone, "implant": implant},
}


@pytest.mark.parametrize("given", STEPS)
@pytest.mark.parametrize("what", ["young", "density_exponent", "initial_density", "reference_density"])
@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1P0, gx.Q1, gx.P2P1, gx.Q2Q2], ids=lambda v: v.name)
def test_however_its_parameters_are_given(variant, what, given):
    """Each way to give a field; of the weight's three parameters those of the implant must not count."""
    scene = layers(variant.cells[0])
    bone, implant = {
        "young": (SOFT, STIFF),
        "density_exponent": (2, 7),
        "initial_density": (START, 4.5),
        "reference_density": (REFERENCE, 3.3),
    }[what]
    field = STEPS[given](scene.mesh, bone, implant)
    change = {what: field} if what == "initial_density" else {"material": replace(scene.material, **{what: field})}
    assert reaction(replace(scene, **change), variant) == pytest.approx(IN_PARALLEL, rel=1e-9)


def test_what_is_frozen_still_has_its_weight():
    """A baseline's growth rate of zero is not the same as a region that does not grow."""
    ends = []
    for growing in (None, ("bone",)):
        scene = layers("quadrilateral", growing=growing)
        steps = list(baselines.update(replace(scene, growth=gx.EnergyDrivenGrowth(0.0, 0.0)), gx.Q1P0))
        ends.append(steps[-1].reactions["right"][0])
    assert ends == pytest.approx([WEIGHT * stress(SOFT + STIFF, 1.01), IN_PARALLEL], rel=1e-9)


@variants
def test_fields_of_an_implant(variant):
    """Stress without a weight, the stimulus of n = 0 and the density of the start, beside bone that has grown."""
    growth = gx.EnergyDrivenGrowth(0.2, rate=0.8, exponent=3.0)
    scene = layers(variant.cells[0], growth=growth, initial_density={"bone": START, "implant": 4.5})
    _, problem = run(scene, variant, tolerance=1e-13)
    fields = {name: gathered(values) for name, values in results.cell_fields(problem).items()}
    implant, bone = fields["grows"] == 0, fields["grows"] == 1
    assert implant.sum() == bone.sum() > 0
    grown = fields["density"][bone]
    energy = 55_000 / 2 * (1.01**2 - 1 - 2 * np.log(1.01))
    assert np.ptp(grown) < 1e-9 and abs(grown[0] - START) > 0.01
    assert fields["density"][implant] == pytest.approx(4.5, rel=1e-13)
    assert fields["relative_change"][implant] == pytest.approx(4.5 / REFERENCE - 1, rel=1e-13)
    assert fields["major_stress"][implant] == pytest.approx(stress(STIFF, 1.01), rel=1e-8)  # J = λ
    assert fields["major_stress"][bone] == pytest.approx((grown / REFERENCE) ** 2 * stress(SOFT, 1.01), rel=1e-8)
    assert fields["stimulus"][implant] == pytest.approx((4.5 / REFERENCE) ** -3 * energy, rel=1e-8)
    assert fields["mass_source"][implant] == pytest.approx(0.0, abs=1e-14)
    weighted = (grown / REFERENCE) ** -1 * energy * SOFT / STIFF
    assert fields["stimulus"][bone] == pytest.approx(weighted, rel=1e-8)
    assert fields["mass_source"][bone] == pytest.approx(0.8 * (weighted - 0.2), rel=1e-8)


# -- the density of an implant is its own, and nobody else's -----------------------------------------------------------


def beside(variant, metal=4.5, **changes):
    """A bent block, bone to the left of metal."""
    mesh = square(4, 0.04, shape=variant.cells[0])
    return block(mesh, growing=("bone",), initial_density={"bone": 1.1, "implant": metal}, **changes)


@variants
def test_bone_begins_with_its_own_density(variant):
    """Nodes that it shares with an implant belong to it: a mean of the two would be neither's."""
    problem = gx.discretise(beside(variant), variant)
    assert problem.density_range() == problem.density_range("bone") == pytest.approx((1.1, 1.1), rel=1e-15)
    assert problem.density_range("implant") == (4.5, 4.5)
    assert problem.density_range(("bone", "implant")) == pytest.approx((1.1, 4.5), rel=1e-15)


@variants
def test_the_density_of_an_implant_does_not_matter_to_bone(variant):
    """Neither to its stiffness nor, in nodal variants, to the nodes that they share."""
    first, second = (run(beside(variant, metal), variant, tolerance=1e-12)[1] for metal in (0.3, 7.8))
    assert displacements(first) == pytest.approx(displacements(second), rel=1e-9, abs=1e-12)
    (x, _, one), (_, _, other) = densities(first).T, densities(second).T
    assert one[x < 0.5 + 1e-9] == pytest.approx(other[x < 0.5 + 1e-9], rel=1e-10)


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1P0, gx.P2P1], ids=lambda v: v.name)
def test_nor_in_other_problems(variant):
    """Load cases, biological equilibrium, and the tangent that judges whether the model is well posed."""
    cases = tuple(
        gx.LoadCase(name, weight, (gx.Traction("right", force),))
        for name, weight, force in (("pull", 3.0, (0.12, 0.0)), ("lift", 1.0, (0.02, 0.1)))
    )
    found = []
    for metal in (0.5, 2.0):
        scene = beside(variant, metal, loads=(), cases=cases)
        problem = gx.homeostasis(scene, variant)
        found.append((*problem.density_range(), problem.mass(), gx.wellposedness.check(problem).negative))
    assert found[0] == pytest.approx(found[1], rel=1e-8)


FALLING = [(variant, gx.Inertia()) for variant in CATALOGUE.values()]
FALLING += [(variant, gx.Inertia(lumped=True)) for variant in (gx.Q1Q1, gx.Q1P0, gx.Q1sri, gx.P1P1, gx.P1P0)]


@pytest.mark.parametrize(("variant", "inertia"), FALLING, ids=[f"{v.name}-{i.lumped}" for v, i in FALLING])
@pytest.mark.parametrize("given", ["dictionary", "function", "DOLFINx function"])
def test_all_bodies_fall_alike(variant, inertia, given):
    """A weight ρ g moves a mass of density ρ by g: inertia and body forces have the density that an implant has."""
    mesh = square(2, 0.0 if inertia.lumped else 0.05, shape=variant.cells[0])
    fields = {
        "dictionary": {"bone": 1.1, "implant": 4.5},
        "function": lambda x: 1.1 + 2 * x[0] * x[1],
        "DOLFINx function": as_function(mesh, lambda x: np.where(x[0] < 0.5, 1.1, 4.5)),
    }
    if inertia.lumped:  # a weight at Gauss points is that of masses at corners where the density is constant
        fields["function"] = lambda x: np.where(x[0] < 0.5, 1.1, 4.5)
    scene = block(
        mesh,
        growth=STILL,
        growing=("bone",),
        initial_density=fields[given],
        supports=(),
        inertia=inertia,
        loads=(gx.OpenBodyForce(lambda u, rho, x: ufl.as_vector([0.7 * rho, 0.0])),),
        program=gx.Program(step=0.1, until=0.3),
    )
    _, problem = run(scene, variant, tolerance=1e-12)
    assert displacements(problem)[:, 2] == pytest.approx(0.7 * 0.01 * 3 * 4 / 2, rel=1e-7)
    assert displacements(problem)[:, 3] == pytest.approx(0.0, abs=1e-9)


def test_a_traction_on_an_implant_knows_its_density():
    """At the end of an implant whose cells all share nodes with bone: what it is given, not what the nodes have."""
    mesh = square(2)
    load = gx.OpenTraction("right", lambda u, rho, x: ufl.as_vector([0.01 * rho, 0.0]))
    scene = block(mesh, growth=STILL, growing=("bone",), initial_density={"bone": 1.0, "implant": 3.0}, loads=(load,))
    steps, _ = run(scene, gx.Q1Q1, tolerance=1e-12)
    assert steps[-1].reactions["left"][0] == pytest.approx(-0.03, rel=1e-8)
    pulled = gx.OpenTraction("top", lambda u, rho, x: ufl.as_vector([0.01 * rho, 0.0]))
    steps, _ = run(replace(scene, loads=(pulled,)), gx.Q1Q1, tolerance=1e-12)
    assert steps[-1].reactions["left"][0] == pytest.approx(-0.02, rel=1e-8)


def test_another_implant_is_another_run(shared_folder):
    """Of a function of position a checkpoint knows no more than what it does: it must know that of what rests."""
    scene = layers("quadrilateral", initial_density=lambda x: np.where(x[1] < 1, START, 4.5))
    gx.solve(scene, gx.Q1P0, out=shared_folder / "run", checkpoint=1)
    other = replace(scene, initial_density=lambda x: np.where(x[1] < 1, START, 7.8))
    with pytest.raises(InputError, match=r"the (initial density|density of what does not grow) is "):
        gx.solve(other, gx.Q1P0, resume=shared_folder / "run")


def test_no_checkerboard_of_bone_and_metal():
    """The jump from one to the other is no oscillation: the indices are of what grows."""
    for variant in (gx.Q1P0, gx.Q1Q1, gx.P1P0, gx.P1P1):
        problem = gx.discretise(beside(variant), variant)
        assert baselines.checkerboard_index(problem) == pytest.approx(0.0, abs=1e-13)
        assert baselines.high_frequency_index(problem) == pytest.approx(0.0, abs=1e-12)


def test_smoothing_as_a_baseline_keeps_metal_out():
    """Densities at the corners that bone shares with metal are those of bone."""
    scene = beside(gx.Q1P0, growth=STILL)
    problem = baselines.frozen(scene, gx.Q1P0)
    list(baselines.update(scene, gx.Q1P0, problem, density_average=baselines.Smoothed()))
    assert problem.density_range() == pytest.approx((1.1, 1.1), rel=1e-12)


# -- what is asked of regions ------------------------------------------------------------------------------------------


@variants
def test_masses_and_means_of_regions(variant):
    """By default of what grows; of a region, of several and of all, each cell once."""
    _, problem = run(beside(variant), variant)
    # Halves of a square whose middle line is distorted: by their sizes, in NumPy from the answers alone.
    bone, implant = (problem.mass(name) / problem.mean_density(name) for name in ("bone", "implant"))
    assert bone + implant == pytest.approx(1.0, rel=1e-12) and bone == pytest.approx(0.5, abs=0.05)
    assert problem.mass() == pytest.approx(problem.mass("bone"), rel=1e-12)
    assert problem.mean_density() == pytest.approx(problem.mean_density("bone"), rel=1e-12)
    assert problem.mass("implant") == pytest.approx(4.5 * implant, rel=1e-12)
    assert problem.mean_density("implant") == pytest.approx(4.5, rel=1e-12)
    assert problem.mass(("bone", "implant", "bone")) == pytest.approx(problem.mass() + 4.5 * implant, rel=1e-12)
    assert problem.density_range() == problem.density_range("bone") != (1.1, 1.1)


def test_a_history_is_of_what_grows():
    """Step and history.csv must not have the least density of an implant for bone's."""
    steps, problem = run(beside(gx.Q1Q1, 0.01), gx.Q1Q1)
    assert (steps[-1].min_density, steps[-1].max_density) == problem.density_range()
    assert steps[-1].min_density > 0.5 and steps[-1].mass == problem.mass()


def test_regions_in_space():
    """Half a cube of each."""
    scene = layers("hexahedron", 3, initial_density={"bone": START, "implant": 4.5})
    for variant in (gx.Q1Q1, gx.Q1P0):
        problem = gx.discretise(scene, variant)
        assert problem.mass("implant") == pytest.approx(4.5, rel=1e-12)
        assert problem.mean_density(("bone", "implant")) == pytest.approx((START + 4.5) / 2, rel=1e-12)


@pytest.mark.parametrize(
    ("regions", "sentence"),
    [
        ("screw", "the mesh has no region named 'screw'; it has 'bone', 'implant'"),
        (("bone", "screw"), "the mesh has no region named 'screw'; it has 'bone', 'implant'"),
        ((), "no region is named: one at least, or None for what grows, would be right"),
        (3, "the regions is 3: a tuple of region's names would be right"),
        ((3,), "an entry of the regions is 3: a region's name would be right"),
    ],
    ids=repr,
)
def test_regions_that_are_none(regions, sentence):
    """What is asked for by a wrong name has an answer that lists the right ones."""
    problem = gx.discretise(beside(gx.Q1P0), gx.Q1P0)
    zone = {"all": np.array([[0, 0], [1, 0], [1, 1], [0, 1]])}
    for ask in (problem.mass, problem.mean_density, problem.density_range, lambda r: area_means(problem, zone, r)):
        with pytest.raises(InputError) as caught:
            ask(regions)
        assert str(caught.value) == sentence


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1P0, gx.Q1, gx.P2P1, gx.P1], ids=lambda v: v.name)
def test_zones_are_of_what_grows(variant):
    """A zone over both has bone's density, not the mean of bone and metal; one in the metal is refused."""
    scene = replace(beside(variant), mesh=square(4, shape=variant.cells[0]))
    problem = gx.discretise(scene, variant)
    zones = {"both": np.array([[0.25, 0.0], [0.75, 0.0], [0.75, 1.0], [0.25, 1.0]])}
    metal = {"metal": np.array([[0.6, 0.1], [0.9, 0.1], [0.9, 0.9], [0.6, 0.9]])}
    assert area_means(problem, zones) == pytest.approx({"both": 1.1}, rel=1e-13)
    assert area_means(problem, zones, ("bone", "implant")) == pytest.approx({"both": 2.8}, rel=1e-13)
    assert area_means(problem, zones | metal, "implant") == pytest.approx({"both": 4.5, "metal": 4.5}, rel=1e-13)
    with pytest.raises(InputError, match=r"^the zone 'metal' holds nothing that grows: a polygon that overlaps what "):
        area_means(problem, metal)
    bone = {"left": np.array([[0.0, 0.0], [0.2, 0.0], [0.2, 1.0]])}
    with pytest.raises(
        InputError, match=r"^the zone 'left' holds nothing of 'implant': a polygon that overlaps it, or "
    ):
        area_means(problem, bone, ("implant",))


@variants
def test_samples_and_smoothed_densities(variant):
    """On either side of the interface its own; at the corners on it, for a continuous picture, bone's."""
    scene = replace(beside(variant), mesh=square(4, shape=variant.cells[0]))
    problem = gx.discretise(scene, variant)
    found = problem.sample_density(np.array([[0.49, 0.3], [0.51, 0.3], [2.0, 0.0]]))
    assert found == pytest.approx([1.1, 4.5, np.nan], rel=1e-13, nan_ok=True)
    smooth = smoothed_density(problem)
    space = smooth.function_space
    own = space.dofmap.index_map.size_local
    x, rho = space.tabulate_dof_coordinates()[:own, 0], smooth.x.array[:own]
    assert rho == pytest.approx(np.where(x < 0.5 + 1e-9, 1.1, 4.5), rel=1e-13)


# -- what is shown and written -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.Q1Q1, gx.P2P1], ids=lambda v: v.name)
@pytest.mark.parametrize("smoothed", [False, True], ids=["raw", "smoothed"])
def test_an_implant_is_not_painted_in_bones_colours(variant, smoothed, shared_folder):
    """It is grey, half of the body, and has no part in the range of colours."""
    import matplotlib.image

    _, problem = run(beside(variant, 40.0), variant)
    body = plots._body(problem, relative=False, smoothed=smoothed, magnification=1.0)
    grey = COMM.bcast(float(np.isnan(body.values).mean()))
    assert grey == 0.5
    if COMM.rank == 0:
        assert np.nanmax(body.values) < 5.0
    path = shared_folder / "density.png"
    plots.density(problem, path, smoothed=smoothed)
    COMM.barrier()
    image = (matplotlib.image.imread(path)[:, :, :3] * 255).round().astype(int)
    metal = np.all(image == int(plots.RESTING_COLOUR[1:3], 16), axis=2)
    coloured = np.ptp(image, axis=2) > 25
    assert 0.6 < metal.sum() / coloured.sum() < 1.5


def test_a_profile_has_a_gap(shared_folder):
    """The density of metal along a line would dwarf that of bone."""
    problem = gx.discretise(beside(gx.Q1P0), gx.Q1P0)
    places = np.column_stack([np.linspace(0.02, 0.98, 12), np.full(12, 0.3)])
    assert problem.sample_growing(places) == pytest.approx((places[:, 0] < 0.5).astype(float))
    plots.along_length({"Q1P0": problem}, shared_folder / "line.png", places)


@pytest.mark.serial
@variants
def test_files_tell_what_grows(variant, tmp_path):
    """ParaView must be able to hide an implant, and finds its density as it is; elsewhere there is no such field."""
    pyvista = pytest.importorskip("pyvista")
    plain = gx.solve(block(square(2, shape=variant.cells[0])), variant, out=tmp_path / "plain")
    split = gx.solve(beside(variant), variant, out=tmp_path / "split")
    for name in ("fields", "raw"):
        (file,) = plain.folder.glob(f"{name}*.vtu")
        assert "grows" not in pyvista.read(file).cell_data
        (file,) = split.folder.glob(f"{name}*.vtu")
        grid = pyvista.read(file)
        grows = grid.cell_data["grows"] == 1
        assert grows.sum() == (~grows).sum() > 0
        if "density" in grid.cell_data:
            assert grid.cell_data["density"][~grows] == pytest.approx(4.5, rel=1e-12)
            assert grid.cell_data["density"][grows].max() < 2.0
            continue
        for cell in (*np.flatnonzero(~grows)[:3], *np.flatnonzero(grows)[:3]):
            values = grid.point_data["density"][grid.get_cell(cell).point_ids]
            assert values == pytest.approx(4.5, rel=1e-12) if not grows[cell] else np.all(values < 2.0)


def test_tables_and_summaries_say_what_they_are_of(capsys):
    """Where all grows they say nothing more than before."""
    for growing, words in ((None, ""), (("bone",), "densities and mass of what grows: 'bone'")):
        result = gx.solve(beside(gx.Q1P0, growth=STILL) if growing else block(), gx.Q1P0)
        summary = results.summary(result)
        assert summary.get("growing") == (growing and list(growing))
        report.steps(result)
        shown = " ".join(capsys.readouterr().out.split())
        assert COMM.rank > 0 or (words in shown and ("of what grows" in shown) == bool(words))
