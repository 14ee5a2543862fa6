"""Scans as users have them: read as NIfTI or from arrays, turned into densities; densities of runs as NIfTI.

What users call is here by its name.
"""

from growthx.meshing.images.density import ScanDensity
from growthx.meshing.images.scan import Scan, from_array, read
from growthx.results.ct.sampled import write

__all__ = ["Scan", "ScanDensity", "from_array", "read", "write"]
