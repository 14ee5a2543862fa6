"""Values that an equation of their own defines at each point of a body, found wherever a form needs them.

In UFL a symbol stands for such a value.  What is compiled has in its place values at its own points of integration,
whichever they are, and these are brought up to date right before it is assembled or evaluated: no state holds them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import basix.ufl
import dolfinx
import numpy as np
import ufl
from ufl.corealg.map_dag import map_expr_dag
from ufl.corealg.multifunction import MultiFunction

from growthx.fem.point_values import rule_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from growthx.common.arrays import Floats, Marks

    Rule = tuple[Floats, Floats]  # points of the reference cell, (points, dim), and weights
    Compile = Callable[[Any, Floats], dolfinx.fem.Expression]  # of UFL at points

MOST = 50  # iterations
NEAR = 1e-8  # of the size of what drives a value: a step after which, by quadratic convergence, round-off is left
LARGEST = 1.0  # step of the logarithm of 1 + z


class Implicit:
    """A value z at each point with g(z) = 0, found by Newton's method: not a number where that fails.

    It begins with what was found last and, where that fails, with zero; what is found is the same but for round-off.

    symbol: what stands for it in UFL; equation, slope: g and ∂g/∂z, of the symbol.
    """

    def __init__(
        self, domain: dolfinx.mesh.Mesh, equation: Callable[[Any], Any], size: Any, *, above: bool = True
    ) -> None:
        """equation: g in UFL of a variable for z.  size: of what drives z, in UFL, no unit.

        above: whether z is above −1: its equation is then solved for ln(1 + z).
        """
        self.symbol = dolfinx.fem.Function(dolfinx.fem.functionspace(domain, ("DG", 0)))
        self.symbol.x.array[:] = np.nan  # where it were taken for a field, all would be lost, and seen
        variable = ufl.variable(self.symbol)
        equation_of = equation(variable)
        self.equation, self.slope = map(_expanded, (equation_of, ufl.diff(equation_of, variable)))
        self._size, self._above = size, above
        self._found: dict[bytes, PointValues] = {}

    def at(self, rule: Rule, compile: Compile) -> PointValues:
        """Its values at the points of a rule, made once for all (collective)."""
        key = np.round(np.column_stack(rule), 12).tobytes()
        if key not in self._found:
            self._found[key] = PointValues(self, rule, compile)
        return self._found[key]

    def measures(self) -> list[Any]:
        """What an iteration looks at, in UFL."""
        return [self.equation, self.slope, ufl.as_ufl(self._size)]

    def step(self, z: Floats, equation: Floats, slope: Floats) -> tuple[Floats, Floats]:
        """The next z, and the step to it by which it is judged."""
        if not self._above:
            step = -equation / slope
            return z + step, step
        step = -equation / (equation + (1 + z) * slope)
        return z + (1 + z) * np.expm1(np.clip(step, -LARGEST, LARGEST)), step


class PointValues:
    """The values at some points of each cell, as a function for forms with these points of integration."""

    def __init__(self, implicit: Implicit, rule: Rule, compile: Compile) -> None:
        domain, (points, weights) = implicit.symbol.function_space.mesh, rule
        # FFCx integrates by the rule of such an element, whatever the form says: the weights are to be the same.
        element = basix.ufl.quadrature_element(domain.basix_cell().name, points=points, weights=weights)
        self.function = dolfinx.fem.Function(dolfinx.fem.functionspace(domain, element))
        topology = domain.topology
        self._implicit, self._domain = implicit, domain
        self._cells = np.arange(topology.index_map(topology.dim).size_local, dtype=np.int32)
        self._places = self.function.function_space.dofmap.list[: len(self._cells)]
        measures = ufl.replace(ufl.as_vector(implicit.measures()), {implicit.symbol: self.function})
        self._measures = compile(measures, points)
        fields = ufl.algorithms.extract_coefficients(measures)
        self._fields = [field for field in fields if field is not self.function]
        self._seen: list[Floats] = []

    def refresh(self) -> None:
        """Find them anew if anything that they depend on has changed."""
        now = [field.x.array for field in self._fields]
        if self._seen and all(np.array_equal(*pair) for pair in zip(now, self._seen, strict=True)):
            return
        self._seen = [each.copy() for each in now]
        z, known = self._from(np.nan_to_num(self.function.x.array[self._places]))
        if not known.all():
            z, known = self._from(np.zeros_like(z))
        self.function.x.array[self._places] = np.where(known, z, np.nan)

    def _from(self, z: Floats) -> tuple[Floats, Marks]:
        """What Newton's method finds from a start, and where it does."""
        known = np.zeros(z.shape, dtype=bool)
        with np.errstate(all="ignore"):
            for _ in range(MOST):
                if known.all():
                    break
                z, known = self._next(z, known)
        return z, known

    def _next(self, z: Floats, known: Marks) -> tuple[Floats, Marks]:
        """One iteration, and which values need no other."""
        self.function.x.array[self._places] = z
        measures = self._measures.eval(self._domain, self._cells).reshape(*z.shape, 3)
        equation, slope, size = np.moveaxis(measures, -1, 0)
        found, step = self._implicit.step(z, equation, slope)
        return np.where(known, z, found), known | (np.abs(step) <= NEAR * np.minimum(size, 1.0))


def refresh(compiled: Any) -> None:
    """Bring the values that a compiled form or expression needs up to date."""
    for values in getattr(compiled, "implicit_values", ()):
        values.refresh()


def at_points(form: ufl.Form, implicits: Iterable[Implicit], compile: Compile) -> tuple[ufl.Form, list[PointValues]]:
    """A form with values at its points of integration in the place of symbols, and these values (collective)."""
    used = [implicit for implicit in implicits if implicit.symbol in form.coefficients()]
    if not used:
        return form, []
    integrals, values = [], []
    for integral in form.integrals():
        integrand = integral.integrand()
        known = set(ufl.algorithms.extract_coefficients(integrand))
        here = {each.symbol: each.at(rule_of(integral), compile) for each in used if each.symbol in known}
        functions = {symbol: found.function for symbol, found in here.items()}
        integrals.append(integral.reconstruct(integrand=_with(integrand, functions)) if here else integral)
        values += [each for each in here.values() if each not in values]
    return ufl.Form(integrals), values


def at_places(value: Any, X: Floats, implicits: Iterable[Implicit], compile: Compile) -> tuple[Any, list[PointValues]]:
    """The same of an expression at points X of the reference cell, (points, dim) (collective)."""
    known = set(ufl.algorithms.extract_coefficients(value))
    rule = X, np.full(len(X), 1 / len(X))  # nothing is integrated by these weights
    here = {each.symbol: each.at(rule, compile) for each in implicits if each.symbol in known}
    if not here:
        return value, []
    functions = {symbol: found.function for symbol, found in here.items()}
    return _with(value, functions), list(here.values())


def _with(value: Any, functions: dict[Any, Any]) -> Any:
    """An expression with functions for symbols, in derivatives by these, too.

    UFL's own replaces in derivatives when they are worked out, where an expression is longest.
    """
    return map_expr_dag(_Replacer(functions), value)


class _Replacer(MultiFunction):
    def __init__(self, functions: dict[Any, Any]) -> None:
        super().__init__()
        self._functions = functions

    expr = MultiFunction.reuse_if_untouched

    def coefficient(self, o: Any) -> Any:
        return self._functions.get(o, o)


def _expanded(value: Any) -> Any:
    return ufl.algorithms.expand_derivatives(ufl.as_ufl(value))
