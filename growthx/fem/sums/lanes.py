"""Kernels that take several cells at once: the C code of FFCx with vectors, a lane for each cell, where it has numbers.

Cells of few integration points leave the vectors of a CPU empty: FFCx writes kernels of one cell.  What it writes is
regular enough to be read line by line: numbers that depend on the cell become vectors, tables stay as they are.  A
kernel with a line of another kind is not translated, and cells are taken one by one.
"""

from __future__ import annotations

import re

# Vectors as GCC and Clang know them.  Where the condition of a choice does not hold, what is chosen from may be NaN.
TYPES = """
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined(__AVX512F__)
enum { LANES = 8 };
#if !defined(__clang__)
#pragma GCC target("prefer-vector-width=512")
#endif
#elif defined(__AVX2__)
enum { LANES = 4 };
#else
enum { LANES = 2 };
#endif
typedef double lanes __attribute__((vector_size(8 * LANES), may_alias));
typedef __typeof__((lanes){0} < (lanes){0}) marks;
static const lanes none = {0};

static inline lanes chosen(marks where, lanes one, lanes other)
{
  return (lanes)(((marks)one & where) | ((marks)other & ~where));
}

/* The loops become calls of the vectors of the C library, where it has them. */
#define OF_ONE(function) static inline lanes function##_on_lanes(lanes x) \\
{ \\
  double values[LANES], found[LANES]; \\
  memcpy(values, &x, sizeof(x)); \\
  for (int l = 0; l < LANES; ++l) found[l] = function(values[l]); \\
  memcpy(&x, found, sizeof(x)); \\
  return x; \\
}
#define OF_TWO(function) static inline lanes function##_on_lanes(lanes x, lanes y) \\
{ \\
  double values[LANES], others[LANES], found[LANES]; \\
  memcpy(values, &x, sizeof(x)); \\
  memcpy(others, &y, sizeof(y)); \\
  for (int l = 0; l < LANES; ++l) found[l] = function(values[l], others[l]); \\
  memcpy(&x, found, sizeof(x)); \\
  return x; \\
}
"""
OF_ONE = ["sqrt", "fabs", "cos", "sin", "tan", "acos", "asin", "atan", "cosh", "sinh", "tanh", "exp", "log"]
OF_TWO = ["pow", "fmin", "fmax", "atan2"]
FUNCTIONS = "\n".join([*(f"OF_ONE({name})" for name in OF_ONE), *(f"OF_TWO({name})" for name in OF_TWO)]) + "\n"

SIGNATURE = """static void {name}(lanes* restrict A, const lanes* restrict w, const double* restrict c,
  const lanes* restrict coordinate_dofs)"""

KERNEL = re.compile(
    r"^void tabulate_tensor_(integral_\w+)\([^)]*\)\n(\{.*?^\}$)(?=\s*(?:bool enabled_coefficients_|ufcx_integral )\1)",
    re.MULTILINE | re.DOTALL,
)
ORDER = re.compile(r"^static ufcx_integral\* form_integrals_form_\w+\[\d+\] = \{(.*?)\};", re.MULTILINE | re.DOTALL)
TABLE = re.compile(r"static const double \w+(\[\d+\])+ = [{}\s\d.,e+-]+;\n")
LOOP = re.compile(r"for \(int (\w+) = 0; \1 < \d+; \+\+\1\)")
ROOM = re.compile(r"double (\w+)((?:\[\d+\])+) = \{0\};")
NUMBER = re.compile(r"double (\w+) = (.*);")
CONDITION = re.compile(r"bool (\w+) = (.*);")
ASSIGNED = re.compile(r"(\w+(?:\[[\w\s()*+\[\]]+\])*) (\+?=) (.*);")
SUM = re.compile(r"[\w\s.()\[\]*/+-]|(?<=\d)e[+-]\d")  # what may stand in a sum of products
FOREIGN = re.compile(r"[A-Za-z_]\w*\s*\(|entity_local_index|quadrature_permutation")  # calls, and what sides need
CALL = re.compile(r"(\w+)\((.*)\)")
CHOICE = re.compile(r"(\w+) \? ([^?:]+) : ([^?:]+)")
COMPARED = re.compile(r"([^<>=!&|?]+) (<|>|<=|>=|==|!=) ([^<>=!&|?]+)")
JOINED = re.compile(r"(\w+) (&&|\|\|) (\w+)")
NEGATED = re.compile(r"!\(?(\w+)\)?")
WHOLE = re.compile(r"-?\d+(\.0)?")
HIGHEST = 16  # whole exponent that products are written for


class NotTranslatedError(Exception):
    """A line is of no known kind."""


def translated(code: str, prefix: str) -> dict[str, str]:
    """C functions for several cells at once, by their names, of the integrals of FFCx's code in their order.

    Raises NotTranslatedError where that has a line of no known kind.
    """
    kernels = {found[1]: found[2] for found in KERNEL.finditer(code)}
    order = ORDER.search(code)
    if order is None:
        raise NotTranslatedError("no integrals")
    functions = {}
    for i, integral in enumerate(order[1].split(",")):
        name, body = f"{prefix}_{i}", kernels.get(integral.strip().removeprefix("&"))
        if body is None:
            raise NotTranslatedError(f"{integral} has no kernel")
        functions[name] = f"{SIGNATURE.format(name=name)}\n{_body(body)}\n"
    return functions


def _body(body: str) -> str:
    tables = [table[0] for table in TABLE.finditer(body)]
    return "\n".join(["{", *tables, *map(_line, TABLE.sub("", body).splitlines()[1:])])


def _line(line: str) -> str:
    text = line.strip()
    if text in ("", "{", "}") or text.startswith("//"):
        return "" if text.startswith("//") else text
    if LOOP.fullmatch(text):
        return text
    if found := ROOM.fullmatch(text):
        return f"lanes {found[1]}{found[2]} = {{{{0}}}};"
    if found := NUMBER.fullmatch(text):
        return f"lanes {found[1]} = {_vector(found[2])};"
    if found := CONDITION.fullmatch(text):
        return f"marks {found[1]} = {_condition(found[2])};"
    if found := ASSIGNED.fullmatch(text):
        return f"{found[1]} {found[2]} {_vector(found[3])};"
    raise NotTranslatedError(text)


def _vector(text: str) -> str:
    """An expression as one that is a vector whatever it is made of."""
    if found := CHOICE.fullmatch(text):
        return f"chosen({found[1]}, {_sum(found[2])}, {_sum(found[3])})"
    found = CALL.fullmatch(text)
    if found and found[1] in OF_ONE:
        return f"{found[1]}_on_lanes({_sum(found[2])})"
    if found and found[1] in OF_TWO:
        one, comma, other = found[2].rpartition(", ")
        if not comma:
            raise NotTranslatedError(text)
        if found[1] == "pow" and WHOLE.fullmatch(other):
            return _whole_power(_sum(one), int(float(other)))
        return f"{found[1]}_on_lanes({_sum(one)}, {_sum(other)})"
    return _sum(text)


def _sum(text: str) -> str:
    """Sums and products alone."""
    if SUM.sub("", text) or FOREIGN.search(text):
        raise NotTranslatedError(text)
    return f"none + ({text})"


def _whole_power(base: str, exponent: int) -> str:
    if not 0 < abs(exponent) <= HIGHEST:
        return f"pow_on_lanes({base}, none + {exponent})"
    product = f"({{ const lanes base = {base}; {' * '.join(['base'] * abs(exponent))}; }})"
    return product if exponent > 0 else f"1.0 / {product}"


def _condition(text: str) -> str:
    if found := COMPARED.fullmatch(text):
        return f"({_sum(found[1])}) {found[2]} ({_sum(found[3])})"
    if found := JOINED.fullmatch(text):
        return f"{found[1]} {found[2][0]} {found[3]}"
    if found := NEGATED.fullmatch(text):
        return f"~{found[1]}"
    raise NotTranslatedError(text)
