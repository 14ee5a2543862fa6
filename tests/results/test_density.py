"""The density that a run has left in its folder, read back by any number of ranks."""

import subprocess
import sys

import numpy as np
import pytest
from blocks import COMM, block, densities, square

import growthx as gx
from growthx.results import checkpoints

VARIANTS = pytest.mark.parametrize(
    "variant", [gx.Q1, gx.Q1P0, gx.Q2, gx.Q1Q1, gx.Q2Q2, gx.P1, gx.P2P2], ids=lambda variant: variant.name
)


@VARIANTS
@pytest.mark.parametrize("growing", [None, ("bone",)], ids=["whole", "in part"])
def test_a_folder_holds_the_density_to_the_bit(variant, growing, shared_folder):
    """With checkpoints or without: the end of the run, or, of a run that was killed, its last checkpoint."""
    scene = block(square(3, 0.05, shape=variant.cells[0]), growing=growing)
    for name, every in (("plain", None), ("kept", 2)):
        grown = gx.solve(scene, variant, out=shared_folder / name, checkpoint=every)
        read = gx.read_density(shared_folder / name)
        mesh = square(3, 0.05, shape=variant.cells[0])
        new = gx.discretise(block(mesh, growing=growing, initial_density=gx.transfer(read, mesh, variant)), variant)
        assert np.array_equal(densities(new), densities(grown.problem))
        assert np.array_equal(new.densities_of_cells(), grown.problem.densities_of_cells())
        other = square(4, shape=variant.cells[0])
        new = gx.discretise(block(other, growing=growing, initial_density=gx.transfer(read, other, variant)), variant)
        if growing is None:
            assert new.mass() == pytest.approx(grown.problem.mass(), rel=1e-10)
    last = gx.read_density(checkpoints.find(shared_folder / "kept", COMM))
    assert np.array_equal(last.densities, read.densities) and last.time == read.time == pytest.approx(0.4)
    assert "at t = 0.4" in repr(read)


def test_what_holds_no_density_is_said(shared_folder):
    """A folder of something else, a file of something else, one that is cut off."""
    with pytest.raises(gx.InputError, match=r"there is no density of a run in .*checkpoint= leaves"):
        gx.read_density(shared_folder)
    gx.solve(block(), gx.Q1, out=shared_folder / "run")
    with pytest.raises(gx.InputError, match=r"history\.csv is damaged or no density of a run"):
        gx.read_density(shared_folder / "run" / "history.csv")
    file = shared_folder / "run" / "density.zip"
    COMM.barrier()
    if COMM.rank == 0:
        file.write_bytes(file.read_bytes()[:-200])
    COMM.barrier()
    with pytest.raises(gx.InputError, match=r"density\.zip is damaged"):
        gx.read_density(shared_folder / "run")
    with pytest.raises(gx.InputError, match="the folder of the run is 3"):
        gx.read_density(3)


PROGRAM = """
import sys
sys.path.insert(0, {tests!r})
import numpy as np
from blocks import COMM, block, densities, square
import growthx as gx
for variant in (gx.Q1, gx.Q1P0, gx.Q1Q1, gx.P2P2):
    mesh = square(4, 0.05, shape=variant.cells[0])
    read = gx.read_density({folder!r} + "/" + variant.name)
    problem = gx.discretise(block(mesh, initial_density=gx.transfer(read, mesh, variant)), variant)
    found = densities(problem)
    if COMM.rank == 0:
        np.save({folder!r} + "/" + variant.name + ".npy", found)
"""


@pytest.mark.serial
def test_more_ranks_begin_as_one_has_ended(tmp_path):
    """To the bit: where a density is in a file does not depend on who has its cell."""
    from pathlib import Path

    variants = (gx.Q1, gx.Q1P0, gx.Q1Q1, gx.P2P2)
    grown = {
        variant: gx.solve(block(square(4, 0.05, shape=variant.cells[0])), variant, out=tmp_path / variant.name)
        for variant in variants
    }
    program = PROGRAM.format(tests=str(Path(__file__).parents[1]), folder=str(tmp_path))
    subprocess.run(["mpirun", "-n", "2", sys.executable, "-c", program], check=True, timeout=300, capture_output=True)
    for variant in variants:
        found, known = np.load(tmp_path / f"{variant.name}.npy"), densities(grown[variant].problem)
        assert np.array_equal(found[:, 2], known[:, 2])
        assert found == pytest.approx(known, abs=1e-14)  # places are told by other cells
