"""Options that change a scene: growth laws by name, exponents of a weight, point forces, histories, or a sentence."""

from dataclasses import fields, replace

import numpy as np
import pytest
from blocks import COMM, block, cube, square

import growthx as gx
from growthx.cli.bar import BAR
from growthx.cli.changes import laws, loads
from growthx.cli.program import _Parser, _parser
from growthx.common.errors import InputError
from growthx.constitutive import growth
from growthx.constitutive.laws import catalogue, stimuli

TABLE = "t,value\n0,0\n0.1,1\n0.25,1\n0.25,0.3\n0.4,0.5\n"


def changed(arguments, scene=None):
    """A scene after these options, with those of the scene's own exponents."""
    parser = _Parser()
    BAR.arguments(parser)
    laws.add_laws(parser)
    loads.add_loads(parser)
    options = parser.parse_args(arguments)
    laws.check(options)
    return loads.with_loads(laws.with_laws(scene or block(square(2)), options), options)


def test_every_law_has_a_name():
    """Whatever is a public law of growthx/constitutive can be asked for, and its help says by what name."""
    public = {
        kind
        for module in (growth, stimuli)
        for name, kind in vars(module).items()
        if isinstance(kind, type) and name in gx.__all__ and not getattr(kind, "__abstractmethods__", None)
    }
    assert public == set(catalogue.NAMED.values())
    for name, kind in catalogue.NAMED.items():
        assert name in laws.LAW and all(parameter in laws.LAW for parameter in catalogue.parameters(kind))


@pytest.mark.parametrize("name", catalogue.NAMED)
def test_laws_are_made_of_words(name):
    """Each with a number for each of its parameters, which all arrive."""
    kind = catalogue.NAMED[name]
    values = {part: 0.3 + 0.01 * number for number, part in enumerate(catalogue.parameters(kind))}
    values = {part: value for part, value in values.items() if part not in ("factor", "exponent", "concentration")}
    more = {part: 3.5 for part in ("exponent", "concentration") if part in catalogue.parameters(kind)}
    words = [f"{part}={value}" for part, value in {**values, **more}.items()]
    made = changed(["--law", name, *words]).growth
    assert type(made) is kind
    assert all(getattr(made, part) == value for part, value in {**values, **more}.items())


def test_what_is_not_said_is_the_scenes_own():
    """Of a law of the same kind its parameters, of any its bounds; then the defaults of the law."""
    scene = block(square(2), growth=gx.EnergyDrivenGrowth(0.01, 5.0, bounds=(0.1, 2.0)))
    assert changed(["--law", "energy", "exponent=4"], scene).growth == replace(scene.growth, exponent=4.0)
    strain = changed(["--law", "strain", "attractor=0.1"], scene).growth
    assert strain == gx.StrainDrivenGrowth(0.1, bounds=(0.1, 2.0))
    for text, factor in (
        ("martin", gx.MartinSurface()),
        ("martin:2.1", gx.MartinSurface(2.1)),
        ("power:0.5", gx.PowerOfDensity(0.5)),
        ("none", None),
    ):
        words = ["set_point=0.5", f"factor={text}", "memory=none", "concentration=3"]
        assert changed(["--law", "daily-stress-remodelling", *words]).growth.factor == factor


def test_exponents_are_a_weight():
    """In place of n, with which they are refused."""
    material = changed(["--exponents", "2", "3", "1.0", "1.25"]).material
    assert material.density_exponent == gx.PiecewisePower(2.0, 3.0, between=(1.0, 1.25))
    assert changed([]).material == block(square(2)).material


def test_forces_at_points_are_added():
    """To those of the scene, in the plane and in space, and what bears them is their sum."""
    scene = changed(["--point-force", "1", "0.5", "-1e-3", "0"])
    assert scene.loads[1:] == (gx.PointForce((1.0, 0.5), (-1e-3, 0.0)),)
    scene = block(square(2), loads=())
    two = changed(["--point-force", "1", "0.5", "0.003", "0", "--point-force", "1", "1", "0", "0.002"], scene)
    result = gx.solve(two, gx.Q1P0)
    assert result.steps[-1].reactions["left"] == pytest.approx([-0.003, -0.002], abs=1e-12)
    in_space = changed(["--point-force", "1", "0.5", "0.5", "0.01", "0", "0"], block(cube(2), loads=()))
    assert in_space.loads == (gx.PointForce((1.0, 0.5, 0.5), (0.01, 0.0, 0.0)),)


@pytest.fixture
def table(shared_folder):
    """The file of a table with a jump."""
    file = shared_folder / "history.csv"
    if COMM.rank == 0:
        file.write_text(TABLE, encoding="utf-8")
    COMM.barrier()
    return file


def test_a_history_drives_all_loads(table):
    """Those of cases and of the option, too; its jump is the end of a step, and forces are the table's."""
    cases = (
        gx.LoadCase("walking", 3.0, (gx.Traction("right", (0.02, 0.0)),)),
        gx.LoadCase("stairs", 1.0, (gx.Pressure("top", 0.01),)),
    )
    scene = changed(["--history", str(table)], block(square(2), loads=(), cases=cases))
    parts = (*scene.supports, *scene.all_loads)
    assert len(parts) == 3 and all(isinstance(part.history, gx.Table) for part in parts)
    pulled = changed(["--history", str(table), "--point-force", "1", "0.5", "0.01", "0"], block(square(2), loads=()))
    steps = gx.solve(pulled, gx.Q1P0).steps
    assert [step.time for step in steps] == pytest.approx([0.1, 0.2, 0.25, 0.3, 0.4])
    shares = [-step.reactions["left"][0] / 0.01 for step in steps]
    assert shares == pytest.approx([1.0, 1.0, 1.0, 0.3 + 0.2 / 3, 0.5], rel=1e-9)


OWN = gx.Traction("right", (0.1, 0.0), history=np.sin)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--law", "hooke"], "there is no growth law 'hooke': one of energy, specific-energy, "),
        (["--law", "strain", "x=1"], "the growth law strain has no parameter 'x': one of attractor, rate, dead_zone, "),
        (["--law", "strain", "rate=5"], "the growth law strain has no attractor, in the unit of its stimulus: "),
        (["--law", "strain", "attractor"], "--law is followed by 'attractor': PARAMETER=VALUE would be right"),
        (["--law", "strain", "attractor=high"], "attractor is 'high': a number, or 'none' where "),
        (["--law", "strain", "attractor=none"], "the attractor stimulus .* is None: a number of at least 0"),
        (["--law", "strain", "rate=1", "rate=2"], "--law has two values of rate, 1 and 2: one would be right"),
        (["--law", "energy", "bounds=1"], "the bounds of density are no parameter of --law: --bounds LOW HIGH "),
        (["--law", "energy", "factor=martin"], "the growth law energy has no parameter 'factor': "),
        (["--law", "energy-remodelling", "set_point=1", "factor=2"], "factor is '2': martin, martin:DENSITY, power:"),
        (["--law", "energy-remodelling", "set_point=1", "factor=power:x"], "factor is 'x': a number"),
        (["--m", "3", "--law", "strain", "attractor=1"], "--m 3 is of the scene's own law: beside --law, exponent=3 "),
        (["--n", "2", "--exponents", "2", "3", "1", "1.2"], "--n 2 is given beside --exponents, which say it: "),
        (["--exponents", "2", "3", "1.2", "1"], r"the densities between two exponents are \(1.2, 1.0\): "),
        (["--point-force", "1", "0.5", "0.1"], "--point-force has 3 numbers: the 4 of X Y FX FY would be right"),
        (["--point-force", "9", "0.5", "0.1", "0"], r"the load at \(9, 0.5\) is 8 away from the body: "),
        (["--history", "nowhere.csv"], r"the history nowhere.csv cannot be read \(No such file"),
    ],
)
def test_what_cannot_be_meant_is_named(arguments, sentence):
    """One sentence with the value, where it came from and what would be right."""
    with pytest.raises(InputError, match=f"^{sentence}") as caught:
        changed(arguments)
    assert "\n" not in str(caught.value)


def test_histories_of_ones_own_and_none_are_named(table):
    """A load that has a history, and one that can have none, are not driven by another in silence."""
    pull = gx.OpenTraction("right", lambda u, rho, x: -u)
    for load, sentence in ((OWN, "the Traction on 'right' has a history of its own: "), (pull, "follows no history: ")):
        with pytest.raises(InputError, match=sentence):
            changed(["--history", str(table)], block(square(2), loads=(load,)))


def test_small_negative_numbers_are_numbers():
    """As -1e-3, which Python's own parser of words takes for an option."""
    words = ["plate", "--point-force", "2", "0.5", "0", "-1e-3"]
    assert _parser().parse_args(words).point_force == [[2.0, 0.5, 0.0, -1e-3]]


def test_laws_have_only_parameters_that_words_can_say():
    """Numbers, None or a factor: a law with another kind of parameter needs a word for it."""
    for kind in catalogue.NAMED.values():
        assert {part.type for part in fields(kind)} <= {
            "Field",
            "float",
            "float | None",
            "RateFactor | None",
            "tuple[float | None, float | None]",
        }
