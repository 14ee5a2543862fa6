"""The command `growthx`: one module for each scene, and how their results are shown."""

from growthx.cli.program import main

__all__ = ["main"]
