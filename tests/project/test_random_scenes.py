"""The random scenes' own assembly against growthx's, and some of the scenes, which must all end as they should."""

import csv
from dataclasses import replace

import numpy as np
import pytest

import growthx as gx
from benchmarks.robustness.random_scenes import (
    assembly,
    bodies,
    check,
    kept,
    program,
    reference,
    running,
    scenes,
    storing,
    working,
)
from benchmarks.robustness.random_scenes.model import Model
from growthx.fem.lumping import owned

pytestmark = pytest.mark.serial  # bodies of a few cells, looked at as whole arrays

PLANE = [(shape, variant) for shape in ("quadrilateral", "triangle") for variant in gx.variants.suited(shape)]
SPACE = [(shape, variant) for shape in ("hexahedron", "tetrahedron") for variant in gx.variants.suited(shape)]
LUMPED = [
    ("quadrilateral", gx.Q1Q1.lumped()),
    ("quadrilateral", gx.S2Q1.lumped(with_source=True)),
    ("triangle", gx.P2P1.lumped()),
    ("triangle", gx.P1P1.lumped(with_source=True)),
]


def names(pairs):
    return [f"{variant.name}-{shape}" for shape, variant in pairs]


def drawn(shape, variant, recipe, seed):
    """A scene of one kind."""
    rng = np.random.default_rng(seed)
    return scenes.Draw(rng, recipe, bodies.random_body(rng, shape), variant).trial(seed)


def assert_assembly_agrees(shape, variant, recipe, seed=3):
    """Forces and, of nodal densities, what is left of the balance of mass, at a random state."""
    each = drawn(shape, variant, recipe, seed)
    problem = gx.discretise(each.scene, variant)
    system, rng = problem.system, np.random.default_rng(seed)
    model, step = Model.of(problem, each.body), 0.3 * each.scene.program.step
    system.begin_step(step, 0.7, step)
    size = len(model.cases), model.counts[0], model.dim
    u = 1e-3 * np.ptp(each.body.points) * each.body.quality * rng.normal(size=size)
    old = problem.state.old_density.x.array.copy()
    unknown = system.unknown.x.array.copy()
    for part, values in zip(system.unknowns.parts, u, strict=True):
        unknown[part] = values.ravel()
    if model.is_nodal:
        unknown[system.unknowns.density_part] = old * rng.uniform(0.8, 1.3, len(old))
    system.start_from(unknown)
    found = system.out_of_balance()
    state = assembly.State(u, system.densities.iterate().copy(), old, step, 0.7)
    forces, sizes = assembly.momentum(model, state)
    weights = np.array([weight for weight, _ in model.cases])
    mine, size = np.zeros(len(found)), np.zeros(len(found))
    for part, weight, force, most in zip(system.unknowns.parts, weights, forces, sizes, strict=True):
        mine[part], size[part] = weight * force.ravel(), weight * most.ravel()
    if model.is_nodal:
        residual, most = assembly.nodal_mass(model, state)
        factor = float(system.densities.constants[0].value)
        part = system.unknowns.density_part
        mine[part], size[part] = factor * residual, factor * most
    else:
        residual, most = assembly.local_mass(model, state)
        assert np.abs(residual / most)[model.grows].max() < 1e-9
    for condition in system.conditions:
        mine[owned(condition)] = 0.0
    assert np.abs(mine - found).max() < 1e-9 * size.max()
    assert np.abs(found).max() > 1e-3 * size.max()  # something is compared


@pytest.mark.parametrize(("shape", "variant"), PLANE + LUMPED, ids=names(PLANE + LUMPED))
def test_own_assembly_finds_the_same_residual(shape, variant):
    """What looks at all scenes must itself be right, in every discretisation."""
    assert_assembly_agrees(shape, variant, "fields")


@pytest.mark.slow
@pytest.mark.parametrize(("shape", "variant"), SPACE, ids=names(SPACE))
def test_own_assembly_finds_the_same_residual_in_space(shape, variant):
    """The same for hexahedra and tetrahedra, some of whose weak forms take long to compile."""
    assert_assembly_agrees(shape, variant, "fields")


@pytest.mark.slow
@pytest.mark.parametrize("recipe", [name for name in scenes.RECIPES if name not in ("fields", "inertia")])
@pytest.mark.parametrize(
    ("shape", "variant"), [("triangle", gx.P2P1), ("quadrilateral", gx.Q1P0)], ids=["P2P1", "Q1P0"]
)
def test_own_assembly_knows_all_that_scenes_are_about(shape, variant, recipe):
    """Laws, load cases, regions at rest, flux."""
    if recipe == "transport" and variant.density.local:
        pytest.skip("densities that jump between cells conduct nothing")
    assert_assembly_agrees(shape, variant, recipe)


@pytest.mark.parametrize("shape", reference.DIMENSION)
def test_bodies_are_meshes(shape):
    """Slivers of all qualities, none of them turned over, whose numbers are found again in DOLFINx."""
    qualities = []
    for seed in range(30):
        body = bodies.random_body(np.random.default_rng(seed), shape)
        mesh = body.mesh()
        corners = mesh.domain.geometry.x[mesh.domain.geometry.dofmap][:, :, : mesh.dim]
        assert sorted(body.cells_of(body.nodes_at(corners))) == list(range(len(body.cells)))
        qualities.append(body.quality)
    assert min(qualities) >= 0.99 * bodies.POOREST
    assert min(qualities) < 1e-3 < 0.1 < max(qualities)


def test_a_scene_is_made_from_its_number_alone():
    """To the bit, so that a scene that fails can be had again."""
    one, again = scenes.trial(11), scenes.trial(11)
    assert np.array_equal(one.body.points, again.body.points)
    assert (one.recipe, one.strain, one.tolerance) == (again.recipe, again.strain, again.tolerance)
    assert scenes.trial(12).strain != one.strain


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda state: {"density": state.density * (1 + 1e-6)}, "mass"),
        (lambda state: {"u": state.u * (1 + 1e-6)}, "momentum"),
        (lambda state: {"density": -state.density}, "a density is not positive"),
        (lambda state: {"u": -1e6 * state.u}, "det F ≤ 0"),
        (lambda state: {"u": state.u + 1.0}, "a support is not where it should be"),
    ],
)
@pytest.mark.parametrize("variant", [gx.P1P0, gx.P1P1], ids=["local", "nodal"])
def test_what_is_wrong_is_found(variant, change, told):
    """A check that nothing fails would pass all scenes: a millionth off is wrong."""
    each = replace(drawn("triangle", variant, "fields", 11), stepping=gx.FixedSteps())
    problem = gx.discretise(each.scene, variant)
    watched, start = running.Watched(problem), problem.density.x.array.copy()
    watched.go(gx.march(each.scene, variant, problem))
    model, step, state = Model.of(problem, each.body), watched.steps[-1], watched.state(gx.IMPLICIT_EULER)
    assert check.verdict(model, state, step, 1e-10, start).wrong == ""
    assert told in check.verdict(model, replace(state, **change(state)), step, 1e-10, start).wrong


def test_some_random_scenes(tmp_path):
    """In the plane, of varying parameters: each ends with a solution that is right, or with a reason in a word."""
    seeds = [seed for seed in range(400) if wanted(scenes.trial(seed))][:40]
    rows = list(working.rows(seeds, 1, 300.0, tmp_path / "log"))
    assert sorted(row.seed for row in rows) == seeds
    assert [row for row in rows if row.outcome in running.FAILURES] == []
    assert sum(row.outcome == running.SOLVED for row in rows) > 20
    assert all(row.kind not in ("", "otherwise") for row in rows if row.outcome == running.EARLY)


def wanted(each):
    return each.recipe == "fields" and len(each.body.points[0]) == 2 and "lumped" not in each.variant.name


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "outcome", "kind"), [(164, running.EARLY, "a corner is crushed"), (813, running.SOLVED, "")]
)
def test_what_was_once_wrong_is_not(seed, outcome, kind):
    """A corner folded to det F = 1e-16 under a lumped source; supports that bear a millionth of the force scale."""
    row = running.run(seed)
    assert (row.outcome, row.kind) == (outcome, kind)


def test_a_scene_that_hangs_or_crashes_is_counted(tmp_path, monkeypatch):
    """With its number, and those after it are run all the same."""
    rows = list(working.rows([1, 2], 1, 0.0, tmp_path / "log"))
    assert {(row.seed, row.outcome) for row in rows} <= {(1, running.HANG), (2, running.HANG)}
    monkeypatch.setattr(working, "CODE", "import os; input(); os.abort()")
    rows = list(working.rows([1, 2], 1, 60.0, tmp_path / "log"))
    assert [(row.seed, row.outcome, row.kind) for row in rows] == [(seed, running.CRASH, "SIGABRT") for seed in (1, 2)]


def test_rows_are_kept_and_counted(tmp_path):
    """A row that is run again takes the place of the first one."""
    kept = storing.Appending(tmp_path)
    lost = running.row(3, None, 1.0, outcome=running.HANG, kind="no end")
    for row in (replace(lost, sentence=""), replace(lost, seed=4, outcome=running.SOLVED, kind="", sentence="")):
        kept.add(row)
    kept.add(replace(lost, outcome=running.WRONG, kind="mass", sentence="a, b"))
    kept.close()
    rows = storing.read(tmp_path)
    assert [(row.seed, row.outcome) for row in rows] == [(3, running.WRONG), (4, running.SOLVED)]
    storing.summarise(rows, tmp_path)
    with (tmp_path / storing.FAILED).open() as file:
        assert [row["seed"] for row in csv.DictReader(file)] == ["3"]


def test_rows_are_kept_for_other_machines(tmp_path):
    """In blocks that are read again, small, with no power of ten reached that was not; newer rows win."""
    size = 10 ** np.random.default_rng(5).uniform(-14, -9, 2000)
    lost = running.row(0, None, 1.234, outcome=running.SOLVED, kind="", sentence="said", quality=0.0999)
    rows = [replace(lost, seed=9000 + number, momentum=momentum) for number, momentum in enumerate(size)]
    kept.add(tmp_path, rows[::2])
    kept.add(tmp_path, [*rows[1::2], replace(lost, seed=9000, outcome=running.WRONG)])
    found = kept.read(tmp_path)
    assert [row.seed for row in found] == list(range(9000, 11000))
    assert (found[0].outcome, found[0].sentence, found[1].sentence) == (running.WRONG, "said", "")
    assert found[1].program == program.program()
    assert (found[1].quality, found[1].seconds) == (0.09, 1.2)
    assert [row.momentum for row in found[1:]] == pytest.approx([row.momentum for row in rows[1:]], rel=0.34)
    files = sorted((tmp_path / kept.FOLDER).iterdir())
    assert [file.name for file in files] == ["000.csv.xz", "001.csv.xz"]
    assert sum(file.stat().st_size for file in files) < 6 * len(rows)
    before = files[1].read_bytes()
    kept.add(tmp_path, [])
    kept.add(tmp_path, rows[-3:])
    assert files[1].read_bytes() == before  # the same rows, the same file


def test_rows_tell_the_program_apart(tmp_path, monkeypatch):
    """A line of growthx that changes makes it another one."""
    before = program.program()
    (tmp_path / "module.py").write_text("a = 1\n")
    monkeypatch.setattr(program, "PACKAGE", tmp_path)
    one = program.program.__wrapped__()
    (tmp_path / "module.py").write_text("a = 2\n")
    assert len({before, one, program.program.__wrapped__()}) == 3
