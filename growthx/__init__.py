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

__version__ = "0.1.0"

# Where the public names live.  A module is imported when one of its names is first used: `import growthx` is light.
_HOME = {
    "Scene": "scene",
    "Support": "supports",
    "PointSupport": "supports",
    "Inertia": "scene",
    "LoadCase": "loads",
    "OpenTraction": "open_loads",
    "OpenBodyForce": "open_loads",
    "Pressure": "open_loads",
    "MassFlux": "transport",
    "PrescribedDensity": "transport",
    "Influx": "transport",
    "Traction": "loads",
    "DistributedForce": "loads",
    "BodyForce": "loads",
    "Program": "scene",
    "FixedSteps": "stepping",
    "AdaptiveSteps": "stepping",
    "TimeScheme": "time_schemes",
    "IMPLICIT_EULER": "time_schemes",
    "TR_BDF2": "time_schemes",
    "Mesh": "mesh",
    "Material": "material",
    "GrowthLaw": "growth",
    "EnergyDrivenGrowth": "growth",
    "SpecificEnergyDrivenGrowth": "growth",
    "StrainDrivenGrowth": "growth",
    "StressDrivenGrowth": "growth",
    "Variant": "variants",
    **dict.fromkeys(("Q1Q1", "Q2Q2", "S2Q1", "Q1P0", "Q1", "Q2", "Q1sri", "S2fri"), "variants"),
    **dict.fromkeys(("P1P1", "P2P2", "P2P1", "P1P0", "P1", "P2"), "variants"),
    "discretise": "marching",
    "march": "marching",
    "solve": "run",
    "homeostasis": "equilibrium",
    "Result": "run",
    "RunEndedEarly": "run",
    "guarded": "parallel",
    "GrowthxError": "errors",
    "InputError": "errors",
    "EndedEarly": "errors",
}
_MODULES = {"baselines", "meshing", "plots", "report", "results", "scenes", "variants", "wellposedness", "zones"}

__all__ = ["__version__", *_HOME, *_MODULES]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(importlib.import_module(f"growthx.{_HOME[name]}"), name)
    if name in _MODULES:
        return importlib.import_module(f"growthx.{name}")
    raise AttributeError(f"growthx has no '{name}'; it has {', '.join(sorted(__all__))}")


def __dir__() -> list[str]:
    return sorted(__all__)
