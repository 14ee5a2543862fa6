"""What a run leaves on disk: readable, right, in global numbers, and never over something else."""

import csv
import errno
import json
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import basix
import dolfinx
import numpy as np
import pytest
import ufl
from blocks import COMM, ROLLERS, block, densities, displacements, elastic_energy, gathered, square

import growthx as gx
from growthx import results
from growthx.common.errors import InputError, OutputError
from growthx.constitutive.kinematics import principal_changes
from growthx.discretisation.variants import CATALOGUE
from growthx.fem import kernels
from growthx.fem.compat import interpolation_points
from growthx.meshing.sampling import positions
from growthx.results import series
from growthx.results.states import vtu

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
FIELDS = ["density", "relative_change", "stimulus", "mass_source", "major_stress", "minor_stress"]


def homogeneous(shape, **changes):
    """A block in uniaxial tension with free sides, so that its fields are known."""
    return block(
        square(3, 0.05, shape=shape),
        supports=ROLLERS,
        loads=(gx.Traction("right", (0.3, 0.0)),),
        **changes,
    )


@variants
def test_cell_means_of_a_homogeneous_block(variant):
    """Every field against the same law at the block's stretches; the Cauchy stress is P̄ᵢλᵢ/J."""
    scene = homogeneous(variant.cells[0])
    problem = gx.solve(scene, variant, tolerance=1e-12).problem
    x, y, u, v = displacements(problem).T
    strains = u[np.isclose(x, 1.0)].mean(), v[np.isclose(y, 1.0)].mean(), 0.0
    rho = problem.mass()  # of the unit square
    along, across = 1 + strains[0], 1 + strains[1]
    J = along * across
    energy = scene.material.elastic_energy(*principal_changes(strains))
    first, second, _ = scene.material.principal_stresses(strains, rho)
    expected = {
        "density": rho,
        "relative_change": rho / 1.2 - 1,
        "stimulus": scene.growth.stimulus(rho, energy, scene.material),
        "mass_source": scene.growth.mass_source(rho, energy, scene.material),
        "major_stress": first * along / J,
        "minor_stress": second * across / J,
    }
    fields = results.cell_fields(problem)
    assert list(fields) == FIELDS
    assert rho != pytest.approx(1.2, rel=1e-2)
    for name, value in expected.items():
        assert gathered(fields[name]) == pytest.approx(np.full(scene.mesh.cell_count, value), rel=1e-9, abs=1e-10), name


def test_density_means_are_weighed_by_volume():
    """A cell's mean is ∫ρ over the cell by its volume: with it the cells' masses add up to the body's."""
    problem = gx.solve(block(square(3, 0.1)), gx.Q1Q1).problem
    domain = problem.scene.mesh.domain
    volumes = dolfinx.fem.assemble_vector(
        kernels.form(ufl.TestFunction(dolfinx.fem.functionspace(domain, ("DG", 0))) * ufl.dx)
    ).array
    density = results.cell_fields(problem)["density"]
    assert COMM.allreduce(float(density @ volumes[: len(density)])) == pytest.approx(problem.mass(), rel=1e-12)


def test_nothing_grows_where_growth_was_not_asked_for():
    """The mass source written there is zero, not what the law would give."""
    problem = gx.solve(block(square(4), growing=("bone",)), gx.Q1).problem
    source = results.cell_fields(problem)["mass_source"]
    implant = problem.scene.mesh.region("implant")
    implant = implant[implant < len(source)]
    assert not np.any(source[implant])
    assert COMM.allreduce(float(np.abs(source).max(initial=0.0))) > 0


def test_relative_change_where_the_reference_density_varies():
    """ρ* may be a field: the change is relative to the one at its place."""
    material = gx.Material(young=1.0, reference_density={"bone": 1.0, "implant": 2.0})
    scene = replace(block(square(4)), material=material, growth=gx.EnergyDrivenGrowth(0.0, rate=0.0))
    problem = gx.solve(scene, gx.Q1).problem
    fields = results.cell_fields(problem)
    assert gathered(fields["relative_change"]) == pytest.approx(np.zeros(16), abs=1e-14)
    assert sorted(gathered(fields["density"])) == pytest.approx([1.0] * 8 + [2.0] * 8)


def written(folder, result):
    """Write a result into a new folder below the shared one, and wait for all ranks."""
    made = results.new_folder(folder / "run", COMM)
    results.write(made, result)
    COMM.barrier()
    return made


def arrays(folder, section):
    """Names of the arrays of the only time."""
    (file,) = folder.glob("fields*.pvtu")
    parts = ElementTree.parse(file).getroot().iter(f"P{section}")
    return {array.get("Name") for part in parts for array in part.iter("PDataArray")}


@variants
def test_fields_are_on_disk(variant, shared_folder):
    """ParaView finds the displacement at points and everything else in cells, with the time."""
    folder = written(shared_folder, gx.solve(block(square(shape=variant.cells[0])), variant))
    assert arrays(folder, "PointData") >= {"displacement", "smoothed_density"}
    assert arrays(folder, "CellData") >= set(FIELDS)
    (entry, *_) = ElementTree.parse(folder / "fields.pvd").getroot().iter("DataSet")
    assert float(entry.get("timestep")) == 0.4


@pytest.mark.serial
def test_fields_read_back_are_those_of_the_state(tmp_path):
    """What a reader of the files gets, cell by cell and node by node."""
    pyvista = pytest.importorskip("pyvista")
    result = gx.solve(block(square(3, 0.05)), gx.Q1)
    folder = written(tmp_path, result)
    (file,) = folder.glob("fields*.vtu")
    grid = pyvista.read(file)
    order = np.lexsort(np.round(grid.cell_centers().points[:, :2].T, 9))
    cells = result.scene.mesh.owned_cells
    middles = dolfinx.mesh.compute_midpoints(result.scene.mesh.domain, 2, cells)
    own = np.lexsort(np.round(middles[:, :2].T, 9))
    for name, values in results.cell_fields(result.problem).items():
        assert grid.cell_data[name][order] == pytest.approx(values[own], rel=1e-12), name
    farthest = np.abs(np.asarray(grid.point_data["displacement"])[:, :2]).max()
    assert farthest == pytest.approx(np.abs(result.problem.displacement.x.array).max(), rel=1e-12)


@variants
def test_history_is_the_steps(variant, shared_folder):
    """One row per accepted step, all numbers global and written once, with the reactions of each support."""
    result = gx.solve(block(square(shape=variant.cells[0])), variant)
    folder = written(shared_folder, result)
    with (folder / "history.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == [
        *("time", "time_step", "error", "load", "rejected", "newton_iterations", "factorisations", "residual"),
        *(
            "round_off",
            "mass",
            "mass_defect",
            "force_defect",
            "moment_defect",
            "min_density",
            "max_density",
            "lumped_cells",
        ),
        *("reaction_left_x", "reaction_left_y", "wall_s", "peak_memory_mb"),
    ]
    assert len(rows) == len(result.steps) == 4
    for row, step in zip(rows, result.steps, strict=True):
        assert float(row["time"]) == step.time
        assert float(row["mass"]) == step.mass
        assert int(row["newton_iterations"]) == step.newton_iterations
        assert float(row["residual"]) == step.newton.residual_norms[-1] <= 1e-10
        assert float(row["reaction_left_x"]) == step.reactions["left"][0]


@pytest.mark.serial
@pytest.mark.parametrize("name", ["Q1P0", "Q1", "Q2", "Q1sri", "S2fri", "P1P0", "P1", "P2"])
def test_raw_fields_are_exact_at_every_point(name, tmp_path):
    """A cell for each density, with its place in it, on the deformed shape, with the exact values.

    Where the mean source of a cell drives its one density, the stimulus is that of the whole cell.
    """
    pyvista = pytest.importorskip("pyvista")
    variant = gx.variants.named(name)
    result = gx.solve(block(square(3, 0.05, shape=variant.cells[0])), variant)
    problem, mesh = result.problem, result.scene.mesh
    (file,) = written(tmp_path, result).glob("raw*.vtu")
    grid = pyvista.read(file)
    points = interpolation_points(problem.density_space.element)
    assert grid.n_cells == mesh.cell_count * len(points)
    owner = grid.find_containing_cell(positions(mesh, points).reshape(-1, 3))
    assert sorted(owner) == list(range(grid.n_cells))
    density = problem.density_at(points).ravel()
    assert grid.cell_data["density"][owner] == pytest.approx(density, rel=1e-15, abs=0)  # 16 digits are written
    assert grid.cell_data["relative_change"][owner] == pytest.approx(density / 1.2 - 1, rel=1e-14)
    if name == "Q1P0":
        stimulus = results.cell_fields(problem)["stimulus"]
        assert stimulus != pytest.approx(stimulus_at(problem, points, density), rel=1e-6)
    else:
        stimulus = stimulus_at(problem, points, density)
    assert grid.cell_data["stimulus"][owner] == pytest.approx(stimulus, rel=1e-12)
    sizes = grid.compute_cell_sizes(length=False, volume=False).cell_data["Area"]
    assert sizes.sum() == pytest.approx(1.0, rel=1e-12) and sizes.min() > 0
    corners = basix.geometry(basix.CellType[mesh.cell_name])
    for place, moved in zip(
        positions(mesh, corners).reshape(-1, 3), problem.displacement_at(corners).reshape(-1, 2), strict=True
    ):
        node = grid.find_closest_point(place)
        assert grid.points[node] == pytest.approx(place, abs=1e-12)
        assert grid.point_data["displacement"][node][:2] == pytest.approx(moved, rel=1e-12, abs=1e-15)


def stimulus_at(problem, points, density):
    """[ρ/ρ*]^(−m) Ψ₀ at points of the cells by DOLFINx's evaluation of the displacement's gradient and NumPy."""
    mesh, material = problem.scene.mesh, problem.scene.material
    gradient = kernels.expression(ufl.grad(problem.displacement), points).eval(mesh.domain, mesh.owned_cells)
    return problem.scene.growth.stimulus(density, elastic_energy(material, gradient.reshape(-1, 2, 2)), material)


@pytest.mark.serial
@pytest.mark.parametrize("name", ["Q1Q1", "Q2Q2", "S2Q1", "P2P2"])
def test_raw_fields_of_nodal_densities_are_the_nodes(name, tmp_path):
    """A continuous density keeps its own degree on disk: all its nodes and their exact values."""
    pyvista = pytest.importorskip("pyvista")
    variant = gx.variants.named(name)
    result = gx.solve(block(square(3, 0.05, shape=variant.cells[0])), variant)
    (file,) = written(tmp_path, result).glob("raw*.vtu")
    grid = pyvista.read(file)
    rows = np.column_stack([grid.points[:, :2], grid.point_data["density"]])
    assert rows[np.lexsort(np.round(rows[:, :2].T, 9))] == pytest.approx(
        densities(result.problem), rel=1e-12, abs=1e-12
    )
    assert np.abs(grid.point_data["displacement"]).max() > 0.01


@pytest.mark.parametrize("name", ["Q1", "Q1P0", "P2", "Q1Q1", "P2P2"])
def test_raw_fields_of_all_ranks_are_on_disk(name, shared_folder):
    """Each rank writes its own cells; together they are as many as in a serial run."""
    variant = gx.variants.named(name)
    result = gx.solve(block(square(4, shape=variant.cells[0])), variant)
    folder = written(shared_folder, result)
    files = sorted(folder.glob("raw*.vtu"))
    assert len(files) == COMM.size
    pieces = [int(re.search(rb'NumberOfCells="(\d+)"', file.read_bytes())[1]) for file in files]
    densities = len(interpolation_points(result.problem.density_space.element)) if variant.density.local else 1
    assert sum(pieces) == result.scene.mesh.cell_count * densities


def test_a_run_without_steps_leaves_nothing(shared_folder):
    """No file without a converged step behind it: the state at rest could be taken for a result."""
    scene = block(supports=(gx.Support("left"), gx.Support("right", (-1.5, 0.0))), loads=())
    with pytest.raises(gx.RunEndedEarly) as ended:
        gx.solve(replace(scene, program=gx.Program(step=0.1, until=0.1)), gx.Q1P0, out=shared_folder / "out")
    assert list((shared_folder / "out").iterdir()) == []
    with pytest.raises(OutputError, match=r"^the run of the scene 'block' has no accepted step: there is nothing to"):
        written(shared_folder, ended.value.result)
    assert list((shared_folder / "run").iterdir()) == []


def test_a_folder_with_something_in_it_is_refused(shared_folder):
    """Results of another day must stay as they are."""
    if COMM.rank == 0:
        (shared_folder / "precious.txt").write_text("mine")
    COMM.barrier()
    with pytest.raises(InputError, match="not empty"):
        results.new_folder(shared_folder, COMM)
    assert [path.name for path in shared_folder.iterdir()] == ["precious.txt"]


def test_a_folder_below_a_file_is_refused(shared_folder):
    """The operating system's reason, in one sentence, on all ranks."""
    if COMM.rank == 0:
        (shared_folder / "file").write_text("")
    COMM.barrier()
    with pytest.raises(InputError, match="cannot be made"):
        results.new_folder(shared_folder / "file" / "below", COMM)


def test_a_free_folder_is_found_beside_the_full_one(shared_folder):
    """Demos may be run again and again: each run gets a folder of its own."""
    for name in ("out", "out-2", "out-3"):
        folder = results.free_folder(shared_folder / "out", COMM)
        assert folder.name == name
        if COMM.rank == 0:
            (folder / "something").write_text("")
        COMM.barrier()


def test_a_history_is_not_written_over(shared_folder):
    """Also within a folder: the second writing is refused by the file itself."""
    result = gx.solve(block(), gx.Q1P0)
    folder = written(shared_folder, result)
    before = (folder / "history.csv").read_bytes()
    if COMM.rank == 0:
        with pytest.raises(FileExistsError):
            results.write_history(folder, result)
    COMM.barrier()
    assert (folder / "history.csv").read_bytes() == before


# -- a disk that is full, a folder that is not there -------------------------------------------------------------------


def full_disk(monkeypatch, ending):
    """Have the system refuse, at the last moment, what is written to files of that ending."""
    write = vtu.write_whole

    def cut(content):
        yield from content
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def write_whole(file, content, **options):
        write(file, cut(content) if file.name.endswith(ending) else content, **options)

    monkeypatch.setattr(vtu, "write_whole", write_whole)


@pytest.mark.parametrize("ending", [f"_p{COMM.size - 1}_000000.vtu", "0.pvtu", "fields.pvd", "raw.pvd"])
@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1], ids=["Q1", "Q1Q1"])
def test_files_cut_off_are_noticed_and_none_stays(variant, ending, shared_folder, monkeypatch):
    """Half a file would be taken for a result; what one rank cannot write, all ranks miss."""
    result = gx.solve(block(), variant)
    with monkeypatch.context() as patch:
        full_disk(patch, ending)
        with pytest.raises(
            OutputError, match=r"^the results cannot be written to \S*run \(No space left on device\): "
        ):
            written(shared_folder, result)
        assert list((shared_folder / "run").iterdir()) == []
        COMM.barrier()  # all have looked
    results.write(shared_folder / "run", result)  # the folder may be used again
    assert {file.suffix for file in (shared_folder / "run").iterdir()} == {".pvd", ".pvtu", ".vtu", ".csv"}


@pytest.mark.serial
@pytest.mark.parametrize("limit", [0, 3000])
def test_a_full_disk_leaves_no_results(limit, tmp_path):
    """The real thing, as near as a test may come: the system takes no more than some bytes of each file.

    The history was there before.
    """
    program = (
        "import resource, sys; from growthx.cli import main; import growthx.results\n"
        "write = growthx.results.FieldWriter.__init__\n"
        "def limited(*arguments):\n"
        f"    resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))\n"
        "    write(*arguments)\n"
        "growthx.results.FieldWriter.__init__ = limited\n"
        "sys.exit(main(['plate', '--elements', '8', '--json', '--out', 'out']))"
    )
    run = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert run.returncode == OutputError.exit_status
    assert run.stderr.startswith("growthx: the results cannot be written to out (") and run.stderr.count("\n") == 1
    assert {file.name for file in tmp_path.rglob("*")} == {"out", "history.csv"}


def test_a_folder_that_vanished_is_made_again(shared_folder):
    """Hours of computing are worth more than the folder that somebody tidied away meanwhile."""
    result = gx.solve(block(), gx.Q1P0)
    results.write(shared_folder / "gone" / "run", result)
    assert (shared_folder / "gone" / "run" / "history.csv").exists()


def test_a_place_where_nothing_can_be_is_named(shared_folder):
    """A file in the way: one sentence on all ranks, and the file stays."""
    if COMM.rank == 0:
        (shared_folder / "file").write_text("mine")
    COMM.barrier()
    result = gx.solve(block(), gx.Q1P0)
    with pytest.raises(OutputError, match=r"^the results cannot be written to \S*file \(Not a directory\): "):
        results.write(shared_folder / "file", result)
    assert (shared_folder / "file").read_text() == "mine"


def test_what_appeared_in_the_folder_meanwhile_stays(shared_folder):
    """Nothing is written over, even if it came after the folder was found empty."""
    result = gx.solve(block(), gx.Q1P0)
    folder = results.new_folder(shared_folder / "run", COMM)
    if COMM.rank == 0:
        (folder / "fields.pvd").write_text("mine")
    COMM.barrier()
    with pytest.raises(OutputError, match=r"fields\.pvd is there already"):
        results.write(folder, result)
    assert [(file.name, file.read_text()) for file in folder.iterdir()] == [("fields.pvd", "mine")]


def test_leavings_of_a_killed_run_are_no_results(shared_folder):
    """What was never finished is hidden, in nobody's way, and gone after the next run."""
    result = gx.solve(block(), gx.Q1P0)
    if COMM.rank == 0:
        (shared_folder / "run" / series.HIDDEN).mkdir(parents=True)
        (shared_folder / "run" / series.HIDDEN / "fields.pvd").write_text("half")
    COMM.barrier()
    folder = written(shared_folder, result)
    assert not (folder / series.HIDDEN).exists()


@pytest.mark.parametrize("name", ["with space", "Ψ₀ ü", "quote'\"s", "line\nbreak", "%s{0}", "-dash", "dot.", "\udcff"])
def test_folders_of_any_name(name, shared_folder):
    """Names go through C++, XML and messages: each of them has rules of its own."""
    result = gx.solve(block(), gx.Q1, out=shared_folder / name)
    assert result.folder == shared_folder / name
    entries = list(ElementTree.parse(shared_folder / name / "raw.pvd").getroot().iter("DataSet"))
    assert entries and all((shared_folder / name / entry.get("file")).is_file() for entry in entries)


@pytest.mark.parametrize("path", ["null\0byte", "x" * 300, 5, None, b"bytes", ["list"]], ids=repr)
@pytest.mark.parametrize("make", [results.new_folder, results.free_folder])
def test_what_is_no_path_is_refused(path, make):
    """The system's own words for it are a ValueError or a TypeError, and on one rank only."""
    with pytest.raises(InputError, match=r"^the folder .*: (one you may write to|its path) would be right$"):
        make(path, COMM)


@variants
def test_the_summary_is_scalars_and_json(variant):
    """What --json prints: numbers as numbers, the same on all ranks but for the clock."""
    cells = {"quadrilateral": 9, "triangle": 18}[variant.cells[0]]
    numbers = json.loads(json.dumps(dict(results.summary(gx.solve(block(square(shape=variant.cells[0])), variant)))))
    assert (numbers["cells"], numbers["points"], numbers["steps"], numbers["converged"]) == (
        cells,
        cells * variant.points_per_cell(variant.cells[0]),
        4,
        True,
    )
    assert numbers["min_density"] < numbers["mass"] < numbers["max_density"]
    assert "reason" not in numbers
    own = {key: value for key, value in numbers.items() if not key.endswith("_s")}
    assert COMM.allgather(own) == [own] * COMM.size
