"""Which growthx this is, and where: at the bottom of the house, so that no module imports the whole for it."""

from __future__ import annotations

from pathlib import Path

__version__ = "0.2.0"
PACKAGE = Path(__file__).resolve().parents[1]  # the folder growthx
