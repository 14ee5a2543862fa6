"""Cells add up by hand to what DOLFINx assembles: half of it, by blocks of nodes."""

import dolfinx
import numpy as np
import pytest
from blocks import COMM, block, cube, square

import growthx as gx
from growthx.fem.sums.cell_sums import CellSums, can_be_added


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.P2], ids=lambda variant: variant.name)
def test_blocks_know_their_places(variant):
    """Each pair of nodes that share a cell of this rank's once, the higher one first, in rising order."""
    problem = gx.discretise(block(square(3, 0.04, shape=variant.cells[0])), variant)
    space = problem.displacement_space
    pairs = CellSums(space).pairs
    cells = space.mesh.topology.index_map(2).size_local
    nodes = [space.dofmap.index_map.local_to_global(row) for row in space.dofmap.list[:cells]]
    expected = sorted({(int(a), int(b)) for row in nodes for a in row for b in row if a >= b})
    assert pairs.tolist() == [list(pair) for pair in expected]


def test_what_is_added_is_the_same_at_each_call():
    """The sum begins at zero, of whatever cells a form has: none of this rank's, some or all."""
    problem = gx.discretise(block(cube(2, 0.04), growing=("bone",)), gx.Q1P0)
    problem.system.begin_step(0.1, 0.5)
    problem.system.out_of_balance()
    sums, forms = CellSums(problem.displacement_space), problem.system.own_tangents[0]
    both, again = sums(forms), sums(forms)
    assert np.array_equal(both, again)
    assert both == pytest.approx(sums(forms[:1]) + sums(forms[1:]))
    assert COMM.allreduce(float(np.abs(both).max(initial=0.0))) > 0


def test_functions_that_turn_are_refused():
    """Those of high degree on the edges of triangles depend on which way the edge is run through."""
    domain = square(2, shape="triangle").domain

    assert can_be_added(dolfinx.fem.functionspace(domain, ("Lagrange", 2, (2,))))
    assert not can_be_added(dolfinx.fem.functionspace(domain, ("N1curl", 2)))
