"""A dead load of one's own is one class: what it says is what the body bears, and what pictures show."""

from collections.abc import Callable
from dataclasses import dataclass

import matplotlib.image
import numpy as np
import pytest
from blocks import COMM, block, cube, densities, displacements, square

import growthx as gx
from growthx import plots
from growthx.common.errors import InputError
from growthx.post import drawing


@dataclass(frozen=True)
class Belt(gx.Load):
    """A toy load: a traction on the part of a boundary below a height, with an arrow where the belt is."""

    on: str
    traction: tuple[float, float]
    height: float
    history: Callable[[float], float] | None = None

    @property
    def place(self):
        return f"on the belt of '{self.on}'"

    def measure(self, mesh, degree):
        return mesh.boundary_measure(self.on, degree)

    def intensity(self, x):
        return np.outer(self.traction, x[1] < self.height)

    def arrow(self, mesh):
        return gx.Arrow(self.traction, (1.0, self.height / 2), "belt")


def whole(x):
    return np.outer((0.1, -0.05), np.ones(x.shape[1]))


def same(one, other):
    """Whether two loads lead to the same run."""
    first, second = (gx.solve(block(square(3, 0.05), loads=(load,)), gx.Q1).problem for load in (one, other))
    assert densities(first) == pytest.approx(densities(second), rel=1e-9)
    assert displacements(first) == pytest.approx(displacements(second), rel=1e-9, abs=1e-12)


def test_a_load_of_ones_own_is_borne():
    """As the same traction said by growthx's own class."""
    same(Belt("right", (0.1, -0.05), 2.0), gx.Traction("right", (0.1, -0.05)))


def test_what_a_load_says_of_itself_is_obeyed():
    """Its measure, its resultant and its history, with what it inherits from growthx's own loads."""
    on_top = {"measure": lambda self, mesh, degree: mesh.boundary_measure("top", degree)}
    turned = type("Turned", (gx.Traction,), on_top)
    same(turned("right", (0.0, 0.05)), gx.Traction("top", (0.0, 0.05)))
    held = type("Held", (gx.Traction,), {"resultant": (0.1, -0.05)})
    same(held("right", (2.0, -1.0)), gx.Traction("right", (0.1, -0.05)))
    double = type("Double", (gx.DistributedForce,), {"resultant": property(lambda self: (0.1, -0.05))})
    same(double("right", (0.05, -0.025)), gx.DistributedForce("right", (0.1, -0.05)))
    late = type("Late", (Belt,), {})
    same(late("right", (0.1, 0.0), 2.0, lambda t: t), gx.Traction("right", (0.1, 0.0), history=lambda t: t))
    always = {"history": property(lambda self: lambda t: t), "intensity": lambda self, x: whole(x)}
    steady = type("Steady", (gx.Load,), {**always, **on_top, "place": "on 'top'"})
    same(steady(), gx.Traction("top", (0.1, -0.05), history=lambda t: t))


def test_its_arrow_is_in_the_picture(shared_folder):
    """In the first colour of arrows, and not without them; other loads have none."""
    colour = np.array([0xD5, 0x5E, 0x00]) / 255
    problem = gx.solve(block(square(6), loads=(Belt("right", (0.1, -0.05), 0.7),)), gx.Q1).problem
    for loads in (True, False):
        path = shared_folder / f"{loads}.png"
        plots.density(problem, path, arrows=loads)
        COMM.barrier()
        image = matplotlib.image.imread(path)[:, :, :3]
        found = np.count_nonzero(np.abs(image - colour).max(axis=2) < 0.02)
        assert (found > 300) if loads else found == 0
    (arrow,) = drawing.arrows_of(problem)
    assert (arrow.force, arrow.label) == ((0.1, -0.05), "belt")
    assert drawing.arrows_of(gx.discretise(block(loads=(gx.BodyForce((0.0, -0.1)),)), gx.Q1)) == []


def test_the_arrow_of_a_distributed_force_is_at_its_middle():
    """Of what is weighted, which is the same on any number of ranks; one of size zero is none."""
    force = gx.DistributedForce("right", (0.1, 0.0), weight=lambda x: 1.0 * (x[1] > 0.5), case="gait")
    none = gx.DistributedForce("right", (0.0, 0.0))
    (arrow,) = drawing.arrows_of(gx.discretise(block(square(4), loads=(force, none)), gx.Q1))
    narrow = gx.DistributedForce("right", (0.1, 0.0), weight=lambda x: 1.0 * (np.abs(x[1] - 0.5) < 0.01))
    assert narrow.arrow(square(4)).place == pytest.approx((1.0, 0.5))
    assert arrow.place == pytest.approx((1.0, 0.75)) and (arrow.force, arrow.label) == ((0.1, 0.0), "gait")


@pytest.mark.parametrize(
    ("arrow", "sentence"),
    [
        (5, "the arrow of the load on my side is 5: an Arrow or None would be right"),
        (gx.Arrow((1.0, 0.0, 0.0), (0.0, 0.0)), "has 3 entries of its force: the mesh needs 2"),
        (gx.Arrow((1.0, 0.0), (0.0,)), "has 1 entries of its place: the mesh needs 2"),
    ],
    ids=["number", "force", "place"],
)
def test_arrows_that_cannot_be_drawn_are_refused(arrow, sentence, shared_folder):
    """Before anything is drawn."""
    parts = {"place": "on my side", "arrow": lambda self, mesh: arrow}
    mine = type("Mine", (gx.Traction,), parts)("right", (0.1, 0.0))
    problem = gx.discretise(block(square(2), loads=(mine,)), gx.Q1P0)
    with pytest.raises(InputError, match=sentence):
        plots.density(problem, shared_folder / "never.png")


@pytest.mark.parametrize("values", [("x", (0.0, 0.0)), ((1.0,), None), ((1.0,), (np.nan,)), ((1.0,), (1.0,), 5)])
def test_what_is_no_arrow_is_refused(values):
    """When it is made."""
    with pytest.raises(InputError, match="would be right"):
        gx.Arrow(*values)


def test_a_load_without_what_it_needs_is_refused():
    """Python's own sentence names what is missing; what is no load at all is refused by the scene."""
    with pytest.raises(TypeError, match=r"abstract.* '?measure"):
        type("Half", (gx.Load,), {"place": "here", "intensity": lambda self, x: whole(x)})()
    with pytest.raises(InputError, match="an entry of loads of the scene 'block' is"):
        block(loads=(type("None", (), {"place": "here"})(),))


def test_the_arrow_of_a_traction_is_its_resultant():
    """Its force at the middle of what it loads, on facets of any shape; one that balances itself has none."""
    (arrow,) = drawing.arrows_of(gx.discretise(block(square(4), loads=(gx.Traction("right", (0.1, -0.02)),)), gx.Q1))
    assert arrow.force == pytest.approx((0.1, -0.02)) and arrow.place == pytest.approx((1.0, 0.5))
    for shape in ("hexahedron", "tetrahedron"):
        rising = gx.Traction("right", lambda x: np.vstack([0 * x[0], 0 * x[0], 2.0 * x[1]]))
        arrow = rising.arrow(cube(4, shape=shape))
        assert arrow.force == pytest.approx((0.0, 0.0, 1.0), abs=1e-12)
        assert arrow.place == pytest.approx((1.0, 2 / 3, 0.5), rel=0.05)
    bending = gx.Traction("right", lambda x: np.vstack([x[1] - 0.5, 0 * x[0]]))
    assert drawing.arrows_of(gx.discretise(block(square(4), loads=(bending,)), gx.Q1)) == []
