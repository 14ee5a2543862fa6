"""Bodies, and values on them: meshes with names from files or DOLFINx, where things are, fields that vary in space.

What users call is here by its name; the rest is in the modules.  Knows no growth.
"""

from growthx.meshing import formats
from growthx.meshing.files import PLANE_CELLS, from_arrays, load_gmsh, locate, read, triangles
from growthx.meshing.parts import Parts
from growthx.meshing.surfaces.patches import nearest, patches
from growthx.meshing.surfaces.sides import Patch

__all__ = [
    "PLANE_CELLS",
    "Parts",
    "Patch",
    "formats",
    "from_arrays",
    "load_gmsh",
    "locate",
    "nearest",
    "patches",
    "read",
    "triangles",
]
