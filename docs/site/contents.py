"""What the site has, page by page; needs nothing but growthx."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import growthx

ROOT = Path(__file__).resolve().parents[2]
HERE = ROOT / "docs" / "site"

TUTORIALS = (  # docs/tutorials/NAME.py, in the order in which they are read
    "bar",
    "own_mesh",
    "own_material",
    "own_law",
    "load_cases",
    "implant",
    "in_space",
    "ct",
    "calibration",
    "long_runs",
)
HOWTOS = (  # docs/howto/NAME.md
    "per_region",
    "read_mesh",
    "choose_variant",
    "load_history",
    "bounds",
    "stop",
    "history_and_movie",
    "read_results",
    "restart",
    "many_cores",
    "faster",
    "cite",
)
EXPLANATIONS = (  # docs/NAME.md
    "theory",
    "models",
    "energies",
    "loads",
    "algorithms",
    "robustness",
    "speed",
    "meshes",
    "ct",
    "femur3d",
    "stem",
    "fields",
    "states",
    "paper",
    "versions",
    "architecture",
)
RESULTS = (  # benchmarks/results/NAME.md
    "paper_tables",
    "convergence",
    "error_vs_runtime",
    "peers",
    "stability",
    "zero_one",
    "weinans",
    "febio",
    "newton_step",
    "globalisation",
    "profile_runs",
    "scaling",
    "random_scenes",
)
OWN = ("index", "tutorials", "howto", "explanations", "results", "reference", "files", "exit_statuses", "glossary")
PROJECT = ("README", "CONTRIBUTING", "CHANGELOG", "CODE_OF_CONDUCT")


@dataclass(frozen=True)
class Group:
    """Public names that are told on one page.

    page: its name.  title: its heading.  rooms: beginnings of the homes of its names in `growthx._HOME`.
    """

    page: str
    title: str
    rooms: tuple[str, ...]


GROUPS = (
    Group(
        "scene",
        "Scenes, supports and programs",
        ("model.scene", "model.supports", "model.program", "model.inertia", "constitutive.kinematics"),
    ),
    Group("loads", "Loads", ("model.loads", "model.open_loads", "model.arrows", "model.actions")),
    Group("meshes", "Meshes", ("meshing",)),
    Group(
        "materials",
        "Materials and stored energies",
        ("constitutive.material", "constitutive.e", "constitutive.weights"),
    ),
    Group("growth", "Growth laws", ("constitutive.growth", "constitutive.laws", "constitutive.sources")),
    Group("transport", "Mass that moves", ("constitutive.flux", "model.transport")),
    Group("discretisations", "Discretisations", ("discretisation.",)),
    Group("runs", "Runs and their results", ("run", "stepping", "results", "post")),
    Group("errors", "Errors and exits", ("common",)),
)


def names_of(group: Group) -> list[str]:
    """The public names of a group: those whose homes begin as its rooms, and no earlier group's."""
    return [name for name, home in growthx._HOME.items() if _first_group(home) is group]


def _first_group(home: str) -> Group | None:
    return next((group for group in GROUPS if home.startswith(group.rooms)), None)


def members_of(module: str) -> list[str]:
    """The names of one of growthx's modules, its `__all__` or what it defines, but those that `gx` has itself."""
    room = getattr(growthx, module)
    own = [name for name, value in vars(room).items() if getattr(value, "__module__", None) == room.__name__]
    names = getattr(room, "__all__", own)
    return [name for name in names if not name.startswith("_") and name not in growthx._HOME]


def found(path: str) -> Any:
    """What a public name such as 'ct.read' names."""
    value: Any = growthx
    for part in path.split("."):
        value = getattr(value, part)
    return value


def documented() -> set[str]:
    """All that the API pages tell, as 'Scene', 'Mesh.cell_values', 'ct.read'."""
    tops = [*growthx._HOME, *(f"{module}.{name}" for module in growthx._MODULES for name in members_of(module))]
    inner = [
        f"{top}.{name}"
        for top in tops
        if inspect.isclass(value := found(top))
        for name, member in vars(value).items()
        if not name.startswith("_") and getattr(member, "__doc__", None) and (callable(member) or is_property(member))
    ]
    return {"__version__", *tops, *inner}


def is_property(member: Any) -> bool:
    """Whether an attribute of a class is computed by a function of its own."""
    return isinstance(member, property | staticmethod | classmethod) or hasattr(member, "func")


def public_bases(bases: Iterable[Any]) -> list[Any]:
    """Those that users know; what else a class is built on is growthx's own affair."""
    return [
        base for base in bases if base is Exception or getattr(growthx, getattr(base, "__name__", ""), None) is base
    ]


def is_module(value: Any) -> bool:
    """Whether a public name is a room, which has names of its own."""
    return isinstance(value, ModuleType)
