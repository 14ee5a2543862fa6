"""A field that follows from a state is one row of a table: means over cells, values at points and files have it."""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest
from blocks import COMM, ROLLERS, block, cube, elastic_energy, gathered, square

import growthx as gx
from growthx import results
from growthx.common.errors import InputError
from growthx.fem import kernels
from growthx.fem.assembly import CellMeans
from growthx.fem.sums import sweeps
from growthx.post import derived
from growthx.post.derived import CellFields


def energy(problem):
    return problem.expressions.energy()


def stresses(problem):
    """Entries of the stress in the plane."""
    sigma = problem.expressions.stress()
    return [sigma[0, 0], sigma[1, 1], sigma[0, 1]]


def mises(entries):
    x, y, shear = np.moveaxis(entries, -1, 0)
    return np.sqrt(x**2 + y**2 - x * y + 3 * shear**2)


ENERGY = results.DerivedField("energy", energy)
MISES = results.DerivedField("mises_in_plane", stresses, mises)


@pytest.fixture
def register(monkeypatch):
    """What registers fields for one test."""
    monkeypatch.setattr(derived, "FIELDS", dict(derived.FIELDS))
    return results.register


def bent(**changes):
    return block(square(3, 0.05), **changes)


def names(folder, stem):
    """Names of the arrays of cells that each state of a series shows."""
    roots = [ElementTree.parse(file).getroot() for file in sorted(folder.glob(f"{stem}*.pvtu"))]
    assert roots
    return [
        {array.get("Name") for part in root.iter("PCellData") for array in part.iter("PDataArray")} for root in roots
    ]


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1P0, gx.Q1Q1], ids=str)
def test_one_row_is_in_means_and_files(variant, register, shared_folder):
    """In all of them, beside those that are there without it; nodes of a continuous density know no energies."""
    register(ENERGY)
    register(MISES)
    problem = gx.solve(bent(), variant, out=shared_folder / "out").problem
    COMM.barrier()
    found = results.cell_fields(problem)
    assert list(found)[-2:] == ["energy", "mises_in_plane"] and "density" in found
    assert all(set(found) <= have for have in names(shared_folder / "out", "fields"))
    for have in names(shared_folder / "out", "raw"):
        assert ({"energy", "mises_in_plane", "stimulus"} <= have) == variant.density.local
        assert "mass_source" not in have


def test_numbers_of_a_row_are_those_of_its_expression(register):
    """In uniaxial tension, where the stress is one number; and the energy at points, by NumPy."""
    import ufl

    register(ENERGY)
    register(MISES)
    loads = (gx.Traction("right", (0.3, 0.0)),)
    problem = gx.solve(block(square(3, 0.05), supports=ROLLERS, loads=loads), gx.Q1, tolerance=1e-12).problem
    found = results.cell_fields(problem)
    assert gathered(found["mises_in_plane"]) == pytest.approx(gathered(found["major_stress"]), rel=1e-8)
    points = problem.variant.integration_points("quadrilateral")
    at_points = derived.PointFields(problem, points).values()
    mesh = problem.scene.mesh
    gradient = kernels.expression(ufl.grad(problem.displacement), points).eval(mesh.domain, mesh.owned_cells)
    known = elastic_energy(problem.scene.material, gradient.reshape(-1, 2, 2))
    assert at_points["energy"].ravel() == pytest.approx(known, rel=1e-10)
    assert at_points["mises_in_plane"].shape == at_points["density"].shape == (len(mesh.owned_cells), 4)
    assert gathered(found["energy"]) == pytest.approx(np.full(9, COMM.bcast(known[0] if len(known) else 0.0)), rel=1e-8)


def test_one_compilation_serves_all_states(shared_folder, monkeypatch):
    """A series of a hundred times must not wait for as many compilations, and has the state of each time."""
    problem = gx.discretise(bent(), gx.Q1)
    writers = [make(shared_folder, problem) for make in (results.FieldWriter, results.raw.raw_writer)]
    fields = derived.CellFields(problem)
    with monkeypatch.context() as patch:
        patch.setattr(type(problem.compile), "__call__", lambda *arguments: pytest.fail("compiled once more"))
        for number in (1, 2):
            problem.density.x.array[:] *= 1.5
            for writer in writers:
                writer.write(float(number))
            assert fields.values()["density"] == pytest.approx(1.2 * 1.5**number, rel=1e-12)
    for writer in writers:
        writer.close()
    COMM.barrier()
    assert len(list(shared_folder.glob("fields_p0_*.vtu"))) == len(list(shared_folder.glob("raw_p0_*.vtu"))) == 2


def test_principal_stresses_in_space():
    """Of the six entries that are told, as of all nine."""
    problem = gx.solve(block(cube(2, 0.05)), gx.Q1P0).problem
    sigma = problem.expressions.stress()
    entries = [sigma[i, j] for i in range(3) for j in range(3)]
    spaces = problem.spaces
    means = CellMeans(problem.scene.mesh.domain, entries, spaces.whole_volume, spaces.compile)().reshape(-1, 3, 3)
    found = results.cell_fields(problem)
    principal = np.linalg.eigvalsh(means)
    assert found["major_stress"] == pytest.approx(principal[:, 2], rel=1e-9, abs=1e-12)
    assert found["minor_stress"] == pytest.approx(principal[:, 0], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.P1P0, gx.P1P1], ids=str)
def test_means_of_several_cells_at_once(variant, monkeypatch):
    """Series take the means of many cells in lanes of a vector: the same as one by one, also of a last, short lane."""
    monkeypatch.setattr(sweeps, "FEWEST", 0)
    monkeypatch.setattr(sweeps, "WIDTH", 1)  # whatever the CPU
    problem = gx.solve(block(cube(3, 0.05, variant.cells[1])), variant).problem
    in_lanes, one_by_one = CellFields(problem, often=True), CellFields(problem)
    assert in_lanes._means._total.sweep is not None and getattr(one_by_one._means._total, "sweep", None) is None
    expected = one_by_one.values()
    for name, found in in_lanes.values().items():
        size = np.abs(expected[name]).max(initial=0.0)
        assert found == pytest.approx(expected[name], rel=1e-11, abs=1e-12 * size)
    problem.density.x.array[:] *= 1.5
    assert in_lanes.values()["density"] == pytest.approx(1.5 * expected["density"], rel=1e-12)


@pytest.mark.parametrize("name", ["density", "minor_stress", "grows", "displacement", "smoothed_density"])
def test_names_of_growthx_itself_are_taken(name, register):
    """Two arrays of one name in a file: a reader would take either."""
    with pytest.raises(InputError, match=f"there is a field '{name}' already"):
        register(replace(ENERGY, name=name))


def test_a_row_may_be_changed(register):
    """In a notebook, whose cell is run once more."""
    register(ENERGY)
    register(replace(ENERGY, raw=False))
    assert list(derived.FIELDS).count("energy") == 1 and not derived.FIELDS["energy"].raw


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"name": 5}, "the name of a field"),
        ({"value": 5}, "the value of the field 'energy'"),
        ({"reading": 5}, "reading, of the field 'energy'"),
        ({"exact": 5}, "exact, of the field 'energy'"),
        ({"raw": 1}, "raw, of the field 'energy'"),
    ],
)
def test_what_is_no_row_is_refused(changes, sentence):
    """When it is made."""
    with pytest.raises(InputError, match=sentence):
        replace(ENERGY, **changes)
    with pytest.raises(InputError, match="a DerivedField would be right"):
        results.register(energy)


@pytest.mark.parametrize(
    "field",
    [
        results.DerivedField("stresses", stresses),
        results.DerivedField("stress", lambda problem: problem.expressions.stress()),
        results.DerivedField("mises", energy, mises),
        results.DerivedField("number", lambda problem: "many"),
    ],
    ids=lambda field: field.name,
)
def test_values_that_cannot_be_told_are_refused(field, register):
    """With the name of the field, before anything is compiled."""
    register(field)
    with pytest.raises(InputError, match=rf"the value of the field '{field.name}' is .*scalars? in UFL would be right"):
        results.cell_fields(gx.discretise(bent(), gx.Q1))
