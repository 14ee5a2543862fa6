"""Run in a process of its own by `apart`: a closed surface filled with tetrahedra by gmsh."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

SHARP = math.radians(40.0)  # between triangles, from which on an edge is kept where the surface is remeshed
SAME = 1e-9  # distance over the surface's extent, below which two corners are one


def arrays(path: str, values: Mapping[str, float], refuse: Callable[[str], None]) -> dict[str, Any]:
    """Points, tetrahedra, and triangles of the surface.

    values: size, of the tetrahedra; remesh, whether the surface gets triangles of that size too.
    """
    points, triangles = _surface(path, refuse)
    extent = np.ptp(points, axis=0)
    if "size" not in values:
        told = " × ".join(f"{length:.4g}" for length in extent)
        refuse(
            f"is a surface and is to be filled: with the size of the tetrahedra, such as size={extent.max() / 25:.2g} "
            f"(it extends by {told})"
        )
    count = abs(_volume(points, triangles)) / (values["size"] ** 3 / 8.5)
    if count > 3e7:
        refuse(f"would have about {count:.2g} tetrahedra of size {values['size']:g}: fewer than 30 million are right")
    shells = _shells(triangles)
    _check_closed(points, triangles, refuse)
    return _filled(points, triangles, shells, values["size"], bool(values.get("remesh", 0)), refuse)


def _surface(path: str, refuse: Callable[[str], None]) -> tuple[Any, Any]:
    """Corners, each once, and triangles of a file."""
    import meshio

    try:
        mesh = meshio.read(path)
    except MemoryError:
        raise
    except BaseException as error:
        said = " ".join(str(error).split())[:200]
        refuse(f"cannot be read ({type(error).__name__}{f': {said}' if said else ''}): a whole file is needed")
        raise
    blocks = [np.asarray(block.data, dtype=np.int64) for block in mesh.cells if block.type == "triangle"]
    others = {block.type for block in mesh.cells if len(block.data)} - {"triangle"}
    if others or not sum(map(len, blocks)):
        refuse(f"has {', '.join(sorted(others)) or 'no triangles'}: a surface of triangles is needed")
    points = np.asarray(mesh.points, dtype=float)
    if not np.all(np.abs(points) < 1e100):
        refuse("has corners that are nowhere, or too far to be meant: finite coordinates would be right")
    size = np.ptp(points, axis=0).max()
    _, first, place = np.unique(np.round(points / (SAME * size or 1.0)), axis=0, return_index=True, return_inverse=True)
    triangles = place.reshape(-1)[np.concatenate(blocks)]
    flat = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
    return points[first], triangles[~flat]


def _volume(points: Any, triangles: Any) -> float:
    """By the divergence theorem."""
    a, b, c = (points[triangles[:, corner]] - points.mean(axis=0) for corner in range(3))
    return float(np.einsum("ti,ti->t", a, np.cross(b, c)).sum() / 6)


def _check_closed(points: Any, triangles: Any, refuse: Callable[[str], None]) -> None:
    edges = np.sort(np.concatenate([triangles[:, pair] for pair in ([0, 1], [1, 2], [2, 0])]), axis=1)
    found, counts = np.unique(edges, axis=0, return_counts=True)
    for wrong, what in (
        (counts == 1, "is open: {} edges have one triangle"),
        (counts > 2, "meets itself: {} edges have more than two triangles"),
    ):
        if wrong.any():
            where = ", ".join(f"{x:.6g}" for x in points[found[wrong][0]].mean(axis=0))
            refuse(f"{what.format(np.count_nonzero(wrong))}, the first at ({where}): a closed surface is needed")


def _shells(triangles: Any) -> Any:
    """The connected shell of each triangle."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs = np.concatenate([triangles[:, :2], triangles[:, 1:]])
    size = triangles.max() + 1
    graph = coo_array((np.ones(len(pairs), dtype=np.int8), pairs.T), shape=(size, size))
    return np.unique(connected_components(graph, directed=False)[1][triangles[:, 0]], return_inverse=True)[1]


def _inside(points: Any, shell: Any, place: Any) -> bool:
    """Whether a shell winds about a place: by the solid angles of its triangles."""
    a, b, c = (points[shell[:, corner]] - place for corner in range(3))
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    top = np.einsum("ti,ti->t", a, np.cross(b, c))
    bottom = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    return abs(float(2 * np.arctan2(top, bottom).sum())) > 2 * math.pi


def _filled(
    points: Any, triangles: Any, shells: Any, size: float, remesh: bool, refuse: Callable[[str], None]
) -> dict[str, Any]:
    """Bodies between the shells: those in an odd number of others are holes of the one about them."""
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    for name, value in (
        ("MeshSizeMax", size),
        ("MeshSizeMin", 0 if not remesh else size / 4),
        ("MeshSizeFromPoints", 0),
        ("MeshSizeExtendFromBoundary", 1),
        ("Algorithm3D", 1),
    ):
        gmsh.option.setNumber(f"Mesh.{name}", value)
    parts = [triangles[shells == number] for number in range(shells.max() + 1)]
    about = [
        [other for other, shell in enumerate(parts) if other != number and _inside(points, shell, points[part[0, 0]])]
        for number, part in enumerate(parts)
    ]
    surfaces = []
    tag = 0
    for number, part in enumerate(parts, start=1):
        used, rows = np.unique(part, return_inverse=True)
        surface = gmsh.model.addDiscreteEntity(2, number)
        nodes = np.arange(tag + 1, tag + 1 + len(used))
        gmsh.model.mesh.addNodes(2, surface, nodes, points[used].reshape(-1))
        gmsh.model.mesh.addElementsByType(surface, 2, [], nodes[rows.reshape(-1)])
        tag += len(used)
        surfaces.append([surface])
    if remesh:
        surfaces = _classified(len(parts), surfaces)
    loops = [gmsh.model.geo.addSurfaceLoop(own) for own in surfaces]
    for number, above in enumerate(about):
        if len(above) % 2:
            continue
        holes = [loops[other] for other, over in enumerate(about) if number in over and len(over) == len(above) + 1]
        gmsh.model.geo.addVolume([loops[number], *holes])
    gmsh.model.geo.synchronize()
    try:
        gmsh.model.mesh.generate(3)
    except Exception as error:
        refuse(f"cannot be filled by gmsh ({error}): a surface that does not meet itself is needed, or remesh=1")
    tags, flat, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    cells, facets = (
        np.searchsorted(tags[order], gmsh.model.mesh.getElementsByType(kind)[1].reshape(-1, width))
        for kind, width in ((4, 4), (2, 3))
    )
    if not len(cells):
        refuse("encloses no body that gmsh could fill: a closed surface that does not meet itself is needed")
    return {"points": flat.reshape(-1, 3)[order], "cells": cells, "facets": facets}


def _classified(count: int, surfaces: list[list[int]]) -> list[list[int]]:
    """Surfaces with a geometry that gmsh can mesh anew, by the shell that they are of."""
    import gmsh

    gmsh.model.mesh.removeDuplicateNodes()
    gmsh.model.mesh.classifySurfaces(SHARP, True, True, math.pi)
    gmsh.model.mesh.createGeometry()
    found = [tag for _, tag in gmsh.model.getEntities(2)]
    if count == 1:
        return [found]
    curves = {tag: {abs(curve) for _, curve in gmsh.model.getBoundary([(2, tag)], oriented=False)} for tag in found}
    shells: list[list[int]] = []
    while found:
        shell, rim = [found.pop()], set()
        rim = set(curves[shell[0]])
        while near := [tag for tag in found if curves[tag] & rim]:
            for tag in near:
                found.remove(tag)
                shell.append(tag)
                rim |= curves[tag]
        shells.append(shell)
    return shells
