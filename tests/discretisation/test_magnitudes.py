"""Slips of units show before anything is solved: a warning, once, and none for scenes that mean what they say."""

import logging
from dataclasses import replace

import dolfinx
import numpy as np
import pytest
from blocks import COMM, block, cube, square

import growthx as gx
from growthx.discretisation.checks import magnitudes
from growthx.discretisation.checks.magnitudes import doubt
from growthx.discretisation.variants import suited

MUCH, LITTLE = "strains its body by orders of magnitude too much", "strains its body by orders of magnitude too little"


def said(scene, variant=None):
    """What is strange about a scene, the same on all ranks."""
    variant = gx.variants.default(scene.mesh.cell_name) if variant is None else variant
    found = doubt(gx.discretise(scene, variant))
    assert len(set(COMM.allgather(found))) == 1 and len(found) < 500
    return found


def scaled_forces(scene, factor):
    """The scene with other forces."""
    return replace(
        scene, loads=tuple(replace(load, force=tuple(factor * f for f in load.force)) for load in scene.loads)
    )


def femur_in_metres(thickness):
    """The femur with lengths in m; the thickness, too, or still in mm."""
    scene = gx.scenes.femur(thickness=thickness)
    mesh = gx.meshing.read(gx.meshing.locate("femur_658.msh"))
    mesh.domain.geometry.x[:] *= 1e-3
    loads = tuple(replace(load, weight=lambda x, load=load: load.weight(1e3 * x)) for load in scene.loads)
    return replace(scene, mesh=mesh, loads=loads)


@pytest.mark.parametrize(
    "make",
    [
        *(gx.scenes.femur, lambda: gx.scenes.femur(separate=True), lambda: gx.scenes.femur(weights=(1.0, 1.0, 1.0))),
        lambda: gx.scenes.femur(shape="triangle", size=8),
        *(lambda: gx.scenes.bar(elements=10), lambda: gx.scenes.bar(gx.scenes.CONTINUOUS, 20)),
        *(lambda: gx.scenes.plate(1), lambda: gx.scenes.plate(16), lambda: gx.scenes.plate(4, shape="triangle")),
        *(block, lambda: block(cube()), lambda: block(square(shape="triangle"))),
        lambda: block(loads=(gx.Traction("right", (2.5, 0.0)),)),
        lambda: block(loads=(), supports=(gx.Support("left"), gx.Support("right", (1.5, None)))),
        lambda: block(loads=(gx.Pressure("right", 0.1),)),
        lambda: block(loads=(gx.OpenTraction("right", lambda u, rho, x: -u),)),
        lambda: block(loads=(gx.BodyForce((0.1, 0.0)),)),
        lambda: block(loads=(gx.Traction("right", (0.1, 0.0), history=np.sin),)),
        lambda: block(growth=gx.EnergyDrivenGrowth(0.0)),
        lambda: block(growth=gx.EnergyDrivenGrowth(lambda x: 0.01 + 0.01 * x[0])),
        lambda: block(growth=gx.StrainDrivenGrowth(0.05)),
        lambda: block(growth=gx.StressDrivenGrowth(0.05)),
        lambda: block(growth=gx.SpecificEnergyDrivenGrowth(0.01)),
        lambda: block(loads=(), influx=(gx.Influx("right", 0.1),)),
    ],
)
def test_sensible_scenes_are_left_alone(make):
    """A warning that comes without a reason is not read when there is one."""
    scene = make()
    assert said(scene, gx.Q1Q1 if scene.influx else None) == ""


@pytest.mark.parametrize("variant", suited("quadrilateral"), ids=lambda variant: variant.name)
def test_slips_show_in_every_variant(variant):
    """Nodal forces are made otherwise in each."""
    scene = gx.scenes.femur()
    assert said(scene, variant) == ""
    assert MUCH in said(scaled_forces(scene, 1e6), variant) and LITTLE in said(scaled_forces(scene, 1e-3), variant)


def test_a_femur_in_metres():
    """Moduli in MPa and lengths in m, the commonest of all; all of it in SI is right."""
    for thickness in (30.0, 0.03):
        assert MUCH in (sentence := said(femur_in_metres(thickness)))
        assert "lengths in m where moduli are in MPa" in sentence and "with Young's modulus 5e+02" in sentence
    scene = femur_in_metres(0.03)
    material, growth = replace(scene.material, young=500e6), replace(scene.growth, attractor=0.01e6)
    assert said(replace(scene, material=material, growth=growth)) == ""


def test_moduli_in_pascal():
    """With loads in N and lengths in mm; with the attractor in that unit or the other."""
    scene = gx.scenes.femur()
    material = replace(scene.material, young=500e6)
    for attractor in (0.01, 0.01e6):
        growth = replace(scene.growth, attractor=attractor)
        sentence = said(replace(scene, material=material, growth=growth))
        assert LITTLE in sentence and "are moduli in Pa where forces are in N and lengths in mm" in sentence


@pytest.mark.parametrize("mesh", [square, cube], ids=["square", "cube"])
def test_a_traction_of_a_million_moduli(mesh):
    """Whatever law drives the growth, and however stiff the body is."""
    for young in (1.0, 1e9):
        for growth in (gx.EnergyDrivenGrowth(0.01 * young), gx.StrainDrivenGrowth(0.01), gx.EnergyDrivenGrowth(0.0)):
            load = gx.Traction("right", (1e6 * young, 0.0, 0.0)[: mesh().dim])
            scene = block(mesh(2), loads=(load,), material=gx.Material(young), growth=growth)
            assert MUCH in (sentence := said(scene)) and "a strain of about 1e+06" in sentence
            assert ("per thickness" in sentence) == (scene.mesh.dim == 2)


def test_an_attractor_in_another_unit():
    """Strains are sensible and the stimulus is not."""
    for factor, way in ((1e6, LITTLE), (1e-6, MUCH)):
        for law in (gx.EnergyDrivenGrowth(0.01 * factor), gx.StressDrivenGrowth(0.1 * factor)):
            assert way in said(block(growth=law))


def test_supports_that_move_too_far():
    """In mm where the mesh is in m."""
    for moved, way in ((100.0, MUCH), (1e-12, LITTLE)):
        supports = (gx.Support("left"), gx.Support("right", (moved, None)))
        assert way in (sentence := said(block(loads=(), supports=supports)))
        assert f"supports that move by {moved:.1g}" in sentence and "in the same unit" in sentence


@pytest.mark.parametrize("loads", [(), (gx.Traction("right", (0.0, 0.0)),), (gx.DistributedForce("left", (1.0, 0.0)),)])
def test_a_scene_without_loads(loads):
    """Forgotten, zero, or all of it at a support."""
    assert said(block(loads=loads)).startswith("the scene 'block' has no load, and none of its supports moves")


def test_load_cases_count_each_for_itself():
    """Weights make them neither smaller nor larger."""
    cases = tuple(
        gx.LoadCase(name, weight, (gx.Traction("right", (0.1, 0.0)),)) for name, weight in (("a", 1), ("b", 1e-9))
    )
    assert said(block(loads=(), cases=cases)) == ""
    large = gx.LoadCase("c", 1e-9, (gx.Traction("right", (1e5, 0.0)),))
    assert MUCH in said(block(loads=(), cases=(*cases, large)))


def test_stiff_regions_that_do_not_grow_do_not_count():
    """An implant may be two hundred times as stiff as the bone that the loads are meant for."""
    field = dolfinx.fem.Function(dolfinx.fem.functionspace((mesh := square(4)).domain, ("DG", 0)))
    field.x.array[:] = np.where(np.isin(mesh.local_cells, mesh.region("implant")), 110000.0, 500.0)
    growth = gx.EnergyDrivenGrowth(0.01, 1.0)
    for young in ({"bone": 500.0, "implant": 110000.0}, field):
        scene = block(mesh, growing=("bone",), material=gx.Material(young), growth=growth)
        assert said(replace(scene, loads=(gx.Traction("right", (3.0, 0.0)),))) == ""
        assert LITTLE in said(replace(scene, loads=(gx.Traction("right", (3e-3, 0.0)),)))


def test_laws_that_take_no_numbers_are_no_reason_to_end(monkeypatch):
    """What is not known is not said."""
    problem = gx.discretise(block(), gx.Q1)
    monkeypatch.setattr(gx.EnergyDrivenGrowth, "stimulus", lambda *arguments: 1 / 0)
    assert np.isnan(magnitudes._share(problem, 1.0, 1.0, 1.0)) and doubt(problem) == ""


def test_it_is_said_once_before_the_march(caplog, monkeypatch):
    """On rank 0, by every call that begins with a scene."""
    monkeypatch.setattr(magnitudes, "_said", set())
    monkeypatch.setattr(logging.getLogger("growthx"), "propagate", True)
    scene = block(square(2), loads=())
    for call in (gx.march, gx.solve, gx.discretise):
        call(scene, gx.Q1)
    messages = [record.getMessage() for record in caplog.records if record.name == "growthx"]
    assert len(messages) == (1 if COMM.rank == 0 else 0)
    assert all(message.startswith("growthx: the scene 'block' has no load") for message in messages)
    assert all(record.levelno == logging.WARNING for record in caplog.records if record.name == "growthx")
