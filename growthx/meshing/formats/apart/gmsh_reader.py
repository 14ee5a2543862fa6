"""Run in a process of its own by `process`: a mesh of gmsh's version 3, which only gmsh reads, in its version 4.1."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np


def arrays(path: str, values: Mapping[str, float], refuse: Callable[[str], None]) -> dict[str, Any]:
    """The bytes of the same mesh in version 4.1; the folder of work is a temporary one."""
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    for name, value in (("General.Terminal", 0), ("Mesh.SaveAll", 1), ("Mesh.MshFileVersion", 4.1), ("Mesh.Binary", 1)):
        gmsh.option.setNumber(name, value)
    gmsh.logger.start()
    try:
        gmsh.open(path)
        wrong = [line for line in gmsh.logger.get() if line.startswith("Error")]
        gmsh.write("converted.msh")
    except Exception as error:
        wrong = [str(error)]
    if wrong:
        refuse(f"cannot be read by gmsh ({wrong[0]}): a whole file, or one of version 4.1, is needed")
    return {"msh": np.fromfile("converted.msh", dtype=np.uint8)}
