"""A mesh whose boundaries and regions have names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from numbers import Integral
from typing import Any

import dolfinx
import numpy as np
import ufl
from mpi4py import MPI

from growthx.common.arrays import Floats, Indices, Marks
from growthx.common.checks import is_function, require_function, require_kind, require_name, require_number
from growthx.common.communicators import steady
from growthx.common.errors import InputError, raise_on_all, shown
from growthx.common.overrides import Sealed
from growthx.common.words import place_in_words, quoted_names
from growthx.fem.cells import counted
from growthx.meshing.cell_data import of_cells
from growthx.meshing.content import Origin
from growthx.meshing.surfaces.sides import Patch, corners_and_sides, numbers_of_file, sides_within

Locator = Callable[[Floats], Marks]


@dataclass(frozen=True)
class Mesh(Sealed, replaceable=()):
    """A DOLFINx mesh with named boundaries (facet indices) and named regions (cell indices).

    The index arrays are local to the rank, int32, sorted, and may hold ghosts.  Lengths are in the user's unit.
    origin: where the cells and nodes that the rank knows stood in the file, or in what DOLFINx was given.
    near: what was found near the places of names that hold nothing, for the sentence that says so.
    comm: the communicator of its ranks for all but DOLFINx, see `communicators`.

    Example:
        >>> import dolfinx, numpy as np
        >>> from mpi4py import MPI
        >>> domain = dolfinx.mesh.create_unit_square(MPI.COMM_WORLD, 2, 2)
        >>> gx.Mesh.with_names(domain, {"left": lambda x: np.isclose(x[0], 0.0)})
        Mesh(8 triangles; boundaries 'left'; regions none)
    """

    domain: dolfinx.mesh.Mesh
    boundaries: Mapping[str, Indices]
    regions: Mapping[str, Indices] = field(default_factory=dict)
    origin: Origin = field(default=None, repr=False, compare=False)  # type: ignore[assignment]
    near: Mapping[str, str] = field(default_factory=dict, repr=False, compare=False)
    comm: MPI.Intracomm = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        _require_domain(self.domain)
        object.__setattr__(self, "comm", steady(self.domain.comm))
        if self.origin is None:
            object.__setattr__(self, "origin", given_order(self.domain))
        for parts, what in ((self.boundaries, "boundaries"), (self.regions, "regions")):
            require_kind(parts, Mapping, f"what names the {what} of a mesh", "a mapping from names to indices")

    # In short: on their own, dataclasses show every index.
    def __repr__(self) -> str:
        from growthx.meshing import mesh

        return f"Mesh({mesh.mesh_in_words(self)})"

    @classmethod
    def with_names(
        cls,
        domain: dolfinx.mesh.Mesh,
        boundaries: Mapping[str, Locator],
        regions: Mapping[str, Locator] | None = None,
    ) -> Mesh:
        """Name the parts of a DOLFINx mesh by functions of position: x of shape (3, points) to booleans (points,).

        Raises InputError, on all ranks, for what is no such mesh or function (collective).
        """
        _require_domain(domain)
        for parts, what in ((boundaries, "boundaries"), (regions or {}, "regions")):
            require_kind(parts, Mapping, f"what names the {what} of a mesh", "a mapping from names to functions")
            for name, locator in parts.items():
                require_name(name, f"a name in the {what} of a mesh")
                require_function(locator, f"the place of '{name}'", "a function of position")
        dim = domain.topology.dim
        domain.topology.create_connectivity(dim - 1, dim)
        find = dolfinx.mesh.locate_entities_boundary
        sides = {name: _located(find, domain, dim - 1, name, locator) for name, locator in boundaries.items()}
        find = dolfinx.mesh.locate_entities
        cells = {name: _located(find, domain, dim, name, locator) for name, locator in (regions or {}).items()}
        return cls(
            domain,
            {name: found for name, (found, _) in sides.items()},
            {name: found for name, (found, _) in cells.items()},
            near={name: near for some in (sides, cells) for name, (_, near) in some.items()},
        )

    def named(self, boundaries: Mapping[str, Any] | None = None, regions: Mapping[str, Any] | None = None) -> Mesh:
        """The same mesh with more names (collective).

        boundaries: for each name a function of position, as in `with_names`; the numbers of nodes in the order of the
            mesh's file, which mean the sides on the surface with all of their corners among them; a patch of the
            surface (`patches`); or a tuple or list of those, which mean all of them.  Numbers are the same on all ranks
        regions: for each name a function of position, or numbers of cells in the order of the file

        Raises InputError, on all ranks, for a name that is there, and for one that would be of nothing: it says what is
        near.
        """
        facets, cells = dict(self.boundaries), dict(self.regions)
        for given, known, what in ((boundaries or {}, facets, "boundaries"), (regions or {}, cells, "regions")):
            require_kind(given, Mapping, f"what names the {what} of a mesh", "a mapping from names to what they mean")
            for name in given:
                require_name(name, f"a name in the {what} of a mesh")
                if name in known:
                    raise InputError(f"the mesh has '{name}' among its {what}: a name of its own would be right")
        for name, meant in (boundaries or {}).items():
            facets[name] = self._all_sides(name, meant)
        for name, meant in (regions or {}).items():
            cells[name] = self._cells(name, meant)
        return Mesh(self.domain, facets, cells, self.origin, self.near)

    def _all_sides(self, name: str, meant: Any) -> Indices:
        several = isinstance(meant, (tuple, list)) and not all(isinstance(one, Integral) for one in meant)
        return np.unique(np.concatenate([self._sides(name, one) for one in (meant if several else (meant,))]))

    def _sides(self, name: str, meant: Any) -> Indices:
        if isinstance(meant, Patch):
            if meant.domain is not self.domain:
                raise InputError(
                    f"a patch of the boundary '{name}' is of another mesh: one of this mesh would be right"
                )
            return meant.facets
        if not is_function(meant):
            return sides_within(self.domain, self.origin, meant, name, self.comm)
        find = dolfinx.mesh.locate_entities_boundary
        self.domain.topology.create_connectivity(self.dim - 1, self.dim)
        found, near = _located(find, self.domain, self.dim - 1, name, meant)
        if not self.comm.allreduce(len(found)):
            raise InputError(_nothing("boundary", name, self, near))
        return found

    def _cells(self, name: str, meant: Any) -> Indices:
        if is_function(meant):
            found, near = _located(dolfinx.mesh.locate_entities, self.domain, self.dim, name, meant)
            if not self.comm.allreduce(len(found)):
                raise InputError(_nothing("region", name, self, near))
            return found
        numbers = numbers_of_file(meant, self.origin.cell_count, f"the cells of the region '{name}'", self.comm)
        return np.flatnonzero(np.isin(self.origin.cells, numbers)).astype(np.int32)

    @property
    def dim(self) -> int:
        """Number of space dimensions of the cells."""
        return int(self.domain.topology.dim)

    def cell_values(self, values: Any, elsewhere: float | None = None) -> dolfinx.fem.Function:
        """A field with one value in each cell, by the name of data that came with the mesh or by an array.

        values: of an array one for each cell, in the order of the file or of the arrays that the mesh was made of,
            the same on all ranks; after a split by `refine`, for each cell before it
        elsewhere: value for cells that have none

        InputError if there are no such data, or cells without a finite value (collective).
        """
        function = dolfinx.fem.Function(dolfinx.fem.functionspace(self.domain, ("DG", 0)))
        function.name = values if isinstance(values, str) else "cell values"
        function.x.array[:] = of_cells(values, self.origin, self.comm)
        if elsewhere is not None:
            require_number(elsewhere, "the value elsewhere", "a number", lambda _: True)
            function.x.array[np.isnan(function.x.array)] = elsewhere
        if without := self.comm.allreduce(int(np.count_nonzero(~np.isfinite(function.x.array[self.owned_cells])))):
            raise InputError(
                f"the values '{function.name}' are no numbers in {without} of {self.cell_count} cells: one in each is "
                "needed, or one for all others as elsewhere="
            )
        return function

    @property
    def cell_count(self) -> int:
        """Number of cells on all ranks."""
        return int(self.domain.topology.index_map(self.dim).size_global)

    @property
    def owned_cells(self) -> Indices:
        """Indices of the cells this rank owns."""
        return np.arange(self.domain.topology.index_map(self.dim).size_local, dtype=np.int32)

    @property
    def local_cells(self) -> Indices:
        """Indices of the cells this rank knows: its own, then ghosts."""
        index_map = self.domain.topology.index_map(self.dim)
        return np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)

    @property
    def cell_name(self) -> str:
        """Shape of the cells, such as "quadrilateral"."""
        return str(self.domain.topology.cell_name())

    def boundary(self, name: str) -> Indices:
        """Facets of the boundary `name`; InputError if no such boundary exists."""
        return _named(self.boundaries, name, "boundary", self)

    def region(self, name: str) -> Indices:
        """Cells of the region `name`; InputError if no such region exists."""
        return _named(self.regions, name, "region", self)

    def corner(self, at: tuple[float, ...]) -> Indices:
        """The corner of cells at a place, (dim,), none or one; InputError if it is on no rank (collective)."""
        if len(at) != self.dim:
            raise InputError(
                f"the support at {place_in_words(at)} has {len(at)} coordinates: the mesh needs {self.dim}"
            )
        comm, x = self.comm, self.domain.geometry.x
        size = comm.allreduce(float(np.abs(x).max(initial=0.0)), MPI.MAX)
        self.domain.topology.create_connectivity(0, self.dim)
        found = dolfinx.mesh.locate_entities(
            self.domain, 0, lambda y: np.abs(y[: self.dim].T - np.array(at)).max(axis=1, initial=0.0) <= 1e-9 * size
        )
        if not comm.allreduce(len(found)):
            raise InputError(
                f"no node of the mesh is at {place_in_words(at)}: a corner of a cell would be right for a support"
            )
        return found

    def boundary_measure(self, name: str, degree: int) -> ufl.Measure:
        """Surface measure of one named boundary, integrating polynomials of `degree` exactly.

        Facets inside the body are there once, seen from one of their two cells: what is integrated must not depend on
        which.
        """
        cells, places = self._seen_from(self.owned_facets(name))
        # The facets themselves: what marks on facets inside the body mean to "ds" is another thing in each DOLFINx.
        facets = np.column_stack([cells, places]).astype(np.int32).reshape(-1)
        return self._measure("ds", [(1, facets)], degree)

    def volume_measure(self, region: str | None, degree: int) -> ufl.Measure:
        """Volume measure of a named region, or of the whole mesh, integrating polynomials of `degree` exactly."""
        cells = self.local_cells if region is None else self.region(region)
        return self._measure("dx", dolfinx.mesh.meshtags(self.domain, self.dim, cells, np.ones_like(cells)), degree)

    def _measure(self, kind: str, parts: Any, degree: int) -> ufl.Measure:
        metadata = {"quadrature_degree": degree}
        return ufl.Measure(kind, domain=self.domain, subdomain_data=parts, subdomain_id=1, metadata=metadata)

    def facet_counts(self, name: str) -> tuple[int, int]:
        """Number of facets of a boundary that lie inside the body, and of all of its facets (collective)."""
        facets = self.owned_facets(name)
        inner = np.isin(facets, dolfinx.mesh.exterior_facet_indices(self.domain.topology), invert=True)
        counts = np.array([np.count_nonzero(inner), len(facets)])
        self.comm.Allreduce(MPI.IN_PLACE, counts)
        return int(counts[0]), int(counts[1])

    def owned_facets(self, name: str) -> Indices:
        """The facets of a boundary that this rank owns: over all ranks, each once."""
        facets = np.unique(self.boundary(name)).astype(np.int32)
        topology = self.domain.topology
        topology.create_connectivity(self.dim - 1, self.dim)
        topology.create_connectivity(self.dim, self.dim - 1)
        return facets[facets < topology.index_map(self.dim - 1).size_local]

    def _seen_from(self, facets: Indices) -> tuple[Indices, Indices]:
        """A cell beside each of some facets, one of this rank where there is, and which of its facets it is."""
        if not len(facets):  # nor perhaps cells
            return facets, facets
        topology = self.domain.topology
        around, sides = topology.connectivity(self.dim - 1, self.dim), topology.connectivity(self.dim, self.dim - 1)
        first, last = around.offsets[facets], around.offsets[facets + 1] - 1
        cells = np.minimum(around.array[first], around.array[last])  # ghosts come after a rank's own
        of_cells = sides.array.reshape(
            topology.index_map(self.dim).size_local + topology.index_map(self.dim).num_ghosts, -1
        )
        return cells, np.argmax(of_cells[cells] == facets[:, np.newaxis], axis=1)


def given_order(domain: dolfinx.mesh.Mesh) -> Origin:
    """Where cells and nodes stood in what DOLFINx was given to make the mesh of; as it counts them where it forgot."""
    topology, geometry = domain.topology, domain.geometry
    cells, nodes = topology.index_map(topology.dim), geometry.index_map()
    try:
        given = np.asarray(topology.original_cell_index, dtype=np.int64)
    except RuntimeError:  # of a topology that was put together by hand
        given = np.empty(0, dtype=np.int64)
    return Origin(
        _of_all(given, cells), cells.size_global, _of_all(geometry.input_global_indices, nodes), nodes.size_global
    )


def _of_all(given: Any, index_map: Any) -> Indices:
    """Numbers of all that a rank knows, or DOLFINx's own numbers if there are not as many."""
    count = index_map.size_local + index_map.num_ghosts
    if len(given) == count:
        return np.asarray(given, dtype=np.int64)
    return np.asarray(index_map.local_to_global(np.arange(count, dtype=np.int32)), dtype=np.int64)


def _require_domain(domain: Any) -> None:
    require_kind(domain, dolfinx.mesh.Mesh, "the domain of a mesh", "a dolfinx.mesh.Mesh")
    dims = domain.topology.dim, domain.geometry.dim
    if dims not in ((2, 2), (3, 3)):
        raise InputError(
            f"the cells of the mesh have dimension {dims[0]} in a space of {dims[1]}: 2 of both or 3 would be right"
        )


def _located(find: Any, domain: dolfinx.mesh.Mesh, dim: int, name: str, locator: Locator) -> tuple[Indices, str]:
    """Entities that a finder of DOLFINx has by a locator, and what is near if it has none (collective).

    InputError on all ranks if the locator is of no use.
    """
    problem = ""

    def marks(x: Floats) -> Marks:
        nonlocal problem
        try:
            found = np.asarray(locator(x))
            if found.dtype != bool or found.shape not in ((), (x.shape[1],)):
                problem = f"an array of {found.dtype} of shape {found.shape} for {x.shape[1]} points"
        except Exception as error:  # on one rank, perhaps: as it is, it would leave the others waiting
            problem = shown(error)
        if problem:
            return np.zeros(x.shape[1], dtype=bool)
        return np.array(np.broadcast_to(found, x.shape[1]))

    entities: Indices = find(domain, dim, marks)
    where = f"the function that places '{name}' gave"
    raise_on_all(steady(domain.comm), problem and f"{where} {problem}: True or False for each point would be right")
    comm = steady(domain.comm)
    return entities, "" if comm.allreduce(len(entities)) else corners_and_sides(domain, marks, comm)


def _named(parts: Mapping[str, Indices], name: str, kind: str, mesh: Mesh) -> Indices:
    require_name(name, f"the name of a {kind}")
    if name not in parts:
        known = ", ".join(f"'{known}'" for known in sorted(parts)) or "none at all"
        raise InputError(f"the mesh has no {kind} named '{name}'; it has {known}")
    if mesh.comm.allreduce(len(parts[name])) == 0:
        raise InputError(_nothing(kind, name, mesh, mesh.near.get(name, "")))
    return parts[name]


def _nothing(kind: str, name: str, mesh: Mesh, near: str) -> str:
    """What to say of a name that holds nothing (collective)."""
    wanted = "side of a cell on the surface" if kind == "boundary" else "cell"
    return (
        f"the {kind} '{name}' of the mesh is empty: no {wanted} lies with all of its corners there, "
        f"{f'{near}, ' if near else ''}and the mesh extends from {_extent(mesh)} (of a place, np.isclose forgives "
        "round-off)"
    )


def _extent(mesh: Mesh) -> str:
    """The lowest and the highest coordinates of a mesh, as text (collective)."""
    x = mesh.domain.geometry.x
    ends = []
    for sign in (-1, 1):  # the lowest is the highest of what is negative
        end = np.max(sign * x, axis=0, initial=-np.inf)
        mesh.comm.Allreduce(MPI.IN_PLACE, end, MPI.MAX)
        ends.append(place_in_words(sign * end[: mesh.dim], 4))
    return " to ".join(ends)


def mesh_in_words(of: Mesh) -> str:
    """Cells, boundaries and regions, on one line."""
    parts = [cells_in_words(of)]
    parts += [
        f"{what} {quoted_names(names)}" for what, names in (("boundaries", of.boundaries), ("regions", of.regions))
    ]
    return "; ".join(parts)


def cells_in_words(of: Mesh) -> str:
    """The number and shape of the cells."""
    return counted(of.cell_count, of.cell_name)
