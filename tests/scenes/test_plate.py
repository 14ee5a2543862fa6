"""The plate against digits that three independent codes and DOLFINx agree on."""

import numpy as np
import pytest
from mpi4py import MPI

import growthx as gx
from growthx import scenes

# (variant, N): u_y at (2, ½), lowest and highest density
DIGITS = {
    ("Q1", 16): (-0.977558381103, 0.50140796289, 1.30563420424),
    ("Q1", 64): (-0.979847242852, 0.500680916101, 1.53344722965),
    ("Q1Q1", 16): (-0.977998317637, 0.501543959201, 1.43914318868),
    ("Q1Q1", 64): (-0.979879395487, 0.49880690748, 1.6845174158),
    ("Q1P0", 16): (-0.980390316794, 0.503006644527, 1.19545381986),
    ("Q1P0", 64): (-0.980055893301, 0.501369760864, 1.41836774514),
}


def deflection(problem):
    """u_y at (2, ½)."""
    space = problem.displacement_space
    x = space.tabulate_dof_coordinates()[: space.dofmap.index_map.size_local]
    tip = np.flatnonzero(np.isclose(x[:, 0], 2.0) & np.isclose(x[:, 1], 0.5))
    values = problem.displacement.x.array[2 * tip + 1]
    (found,) = np.concatenate(MPI.COMM_WORLD.allgather(values))
    return found


CASES = [pytest.param(*case, marks=pytest.mark.slow if case == ("Q1Q1", 64) else ()) for case in DIGITS]


@pytest.mark.parametrize(("variant", "cells"), CASES)
def test_known_digits(variant, cells):
    """Model, tangent, time program and tolerance all enter: eleven digits do not agree by chance."""
    result = gx.solve(scenes.plate(cells), gx.variants.named(variant))
    found = (deflection(result.problem), *result.problem.density_range())
    assert found == pytest.approx(DIGITS[variant, cells], rel=1e-9)
    assert result.time == 2.5
    assert len(result.steps) == 25
