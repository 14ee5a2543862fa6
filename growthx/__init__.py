"""growthx: density growth at finite strains (Kuhl, Menzel & Steinmann 2003) on FEniCSx.

import growthx as gx

result = gx.solve(gx.scenes.femur(), gx.Q1P0)
print(result.problem.mass())
"""

from __future__ import annotations

import importlib
import os
from typing import Any

# One thread per rank: MPI is the parallelism, and threads of the BLAS would compete with it for the cores.
os.environ.setdefault("OMP_NUM_THREADS", "1")

from growthx.common.installed import __version__

# Where the public names live.  A module is imported when one of its names is first used: `import growthx` is light.
_HOME = {
    "Scene": "model.scene",
    "Plane": "constitutive.kinematics",
    "Support": "model.supports",
    "PointSupport": "model.supports",
    "Inertia": "model.inertia",
    "Load": "model.loads",
    "Arrow": "model.arrows",
    "LoadCase": "model.loads",
    "OpenLoad": "model.open_loads",
    "OpenTraction": "model.open_loads",
    "OpenBodyForce": "model.open_loads",
    "Pressure": "model.open_loads",
    "MassFlux": "constitutive.flux",
    "PrescribedDensity": "model.transport",
    "Influx": "model.transport",
    "Traction": "model.loads",
    "DistributedForce": "model.loads",
    "NodalLoad": "model.actions.concentrated",
    "PointForce": "model.actions.concentrated",
    "NodalForces": "model.actions.concentrated",
    "LineForce": "model.actions.concentrated",
    "Moment": "model.actions.faces",
    "Rotation": "model.actions.faces",
    "RigidFace": "model.actions.rigid",
    "Spring": "model.actions.springs",
    "Foundation": "model.actions.springs",
    "Table": "model.actions.histories",
    "BodyForce": "model.loads",
    "Program": "model.program",
    "FixedSteps": "stepping.control",
    "AdaptiveSteps": "stepping.control",
    "TimeScheme": "stepping.time_schemes",
    "IMPLICIT_EULER": "stepping.time_schemes",
    "TR_BDF2": "stepping.time_schemes",
    "Mesh": "meshing.mesh",
    "StoredEnergy": "constitutive.energies",
    "DensityWeight": "constitutive.weights",
    "PiecewisePower": "constitutive.weights",
    "Material": "constitutive.material",
    "SaintVenantKirchhoff": "constitutive.elastic.isotropic",
    "Hencky": "constitutive.elastic.isotropic",
    "MooneyRivlin": "constitutive.elastic.isotropic",
    "Ogden": "constitutive.elastic.isotropic",
    "LinearElasticity": "constitutive.elastic.small_strain",
    "FibredNeoHooke": "constitutive.elastic.fibres",
    "MassSource": "constitutive.sources",
    "GrowthLaw": "constitutive.growth",
    "EnergyDrivenGrowth": "constitutive.growth",
    "SpecificEnergyDrivenGrowth": "constitutive.growth",
    "StrainDrivenGrowth": "constitutive.growth",
    "StressDrivenGrowth": "constitutive.growth",
    "Remodelling": "constitutive.laws.remodelling",
    "EnergyRemodelling": "constitutive.laws.stimuli",
    "SpecificEnergyRemodelling": "constitutive.laws.stimuli",
    "StrainRemodelling": "constitutive.laws.stimuli",
    "DailyStressRemodelling": "constitutive.laws.stimuli",
    "MartinSurface": "constitutive.laws.rates",
    "PowerOfDensity": "constitutive.laws.rates",
    "Variant": "discretisation.variants",
    **dict.fromkeys(("Q1Q1", "Q2Q2", "S2Q1", "Q1P0", "Q1", "Q2", "Q1sri", "S2fri"), "discretisation.variants"),
    **dict.fromkeys(("P1P1", "P2P2", "P2P1", "P1P0", "P1", "P2"), "discretisation.variants"),
    "discretise": "discretisation.discretise",
    "march": "stepping.marching",
    "solve": "run",
    "transfer": "discretisation.transfers.transfer",
    "read_density": "results.density",
    "compare": "post.comparing.comparison",
    "shielding": "post.comparing.shielding",
    "homeostasis": "stepping.equilibrium",
    "loaded": "stepping.equilibrium",
    "Result": "stepping.record",
    "RunEndedEarly": "run",
    "guarded": "common.exits",
    "GrowthxError": "common.errors",
    "InputError": "common.errors",
    "EndedEarly": "common.errors",
}
_MODULES = {
    "baselines": "baselines",
    "ct": "results.ct",
    "functions": "constitutive.functions",
    "meshing": "meshing",
    "plots": "post.plots",
    "report": "cli.report",
    "results": "results",
    "scenes": "scenes",
    "variants": "discretisation.variants",
    "wellposedness": "post.wellposedness",
    "zones": "post.zones",
}

__all__ = ["__version__", *_HOME, *_MODULES]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(importlib.import_module(f"growthx.{_HOME[name]}"), name)
    if name in _MODULES:
        return importlib.import_module(f"growthx.{_MODULES[name]}")
    from growthx.common.errors import no_such_name

    raise no_such_name("growthx", name, __all__)


def __dir__() -> list[str]:
    return sorted(__all__)
