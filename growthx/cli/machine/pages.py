"""Which pages of the documentation tell more about a part of growthx."""

from __future__ import annotations

from pathlib import Path

from growthx.common.installed import PACKAGE

# Beginnings of names of modules, the more particular ones first, and the pages of docs that tell about them.
TELL = {
    "baselines": ("models",),
    "cli.changes.laws": ("models", "energies"),
    "cli.changes.loads": ("loads", "howto/load_history"),
    "cli.femur3d": ("femur3d",),
    "cli.implants": ("stem",),
    "cli.mesh": ("meshes",),
    "cli.movie": ("howto/history_and_movie",),
    "cli.picture": ("fields",),
    "cli.scan": ("ct",),
    "cli.states": ("states", "howto/history_and_movie"),
    "cli": ("theory",),
    "common.communicators": ("howto/many_cores",),
    "common.overrides": ("models", "energies"),
    "constitutive.elastic": ("energies",),
    "constitutive.energies": ("energies",),
    "constitutive.expressions": ("models", "energies"),
    "constitutive.material": ("energies", "howto/per_region"),
    "constitutive.weights": ("energies",),
    "constitutive.flux": ("theory",),
    "constitutive.kinematics": ("theory",),
    "constitutive": ("models", "theory"),
    "discretisation.constraints": ("loads",),
    "discretisation.loading": ("loads",),
    "discretisation.laws": ("energies", "howto/per_region"),
    "discretisation.transfers": ("states",),
    "discretisation.variants": ("howto/choose_variant",),
    "discretisation": ("theory", "algorithms"),
    "fem": ("algorithms", "versions"),
    "meshing.fields": ("howto/per_region",),
    "meshing.images": ("ct",),
    "meshing": ("meshes", "howto/read_mesh"),
    "model.program": ("howto/load_history",),
    "model.transport": ("theory",),
    "model.exponents": ("models",),
    "model": ("loads", "theory"),
    "post.movie": ("howto/history_and_movie",),
    "post.comparing.shielding": ("stem",),
    "post.comparing": ("ct",),
    "post.wellposedness": ("models", "robustness"),
    "post.zones": ("femur3d",),
    "post": ("fields",),
    "results.checkpoints": ("howto/restart",),
    "results.ct": ("ct",),
    "results": ("states", "howto/read_results"),
    "run": ("robustness", "howto/stop"),
    "scenes.bar": ("paper",),
    "scenes.stem": ("stem",),
    "scenes": ("theory", "femur3d"),
    "solvers": ("robustness", "algorithms"),
    "stepping.equilibrium": ("howto/stop", "robustness"),
    "stepping": ("robustness",),
}
GENERAL = ("theory",)  # of what is common to all


def pages_on(module: str) -> tuple[str, ...]:
    """Names of the pages that tell about a module, as 'loads' and 'howto/load_history'."""
    return next((pages for part, pages in TELL.items() if f"{module}.".startswith(f"{part}.")), GENERAL)


def folder() -> Path | None:
    """Where the pages are, beside a checkout's code; None of what is installed."""
    beside = PACKAGE.parent / "docs"
    return beside if (beside / "theory.md").is_file() else None


def titles() -> dict[str, str]:
    """All pages by name with their titles; none where they are not."""
    here = folder()
    found = sorted([*here.glob("*.md"), *here.glob("howto/*.md")]) if here else []
    return {str(page.relative_to(here).with_suffix("")): _title(page) for page in found if here}


def _title(page: Path) -> str:
    with page.open(encoding="utf-8") as lines:
        return lines.readline().lstrip("# ").strip()
