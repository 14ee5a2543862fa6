"""FFCx's C code is read line by line, and what is not known is refused: numbers are right, or taken one by one."""

import re

import dolfinx
import numpy as np
import pytest
import ufl
from blocks import COMM, square

from growthx.common.communicators import steady
from growthx.fem import kernels
from growthx.fem.assembly import Compiler, assemble
from growthx.fem.sums import lanes, sweeps

FRAME = """
void tabulate_tensor_integral_a1(double* restrict A,
                                    const double* restrict w)
{{
{lines}
}}

ufcx_integral integral_a1 =
{{
}};
static ufcx_integral* form_integrals_form_b2[1] = {{&integral_a1}};
"""


def translated(*lines):
    """The lines of a kernel as its function on lanes has them."""
    (function,) = lanes.translated(FRAME.format(lines="\n".join(lines)), "some").values()
    return function[function.index("{") :]


@pytest.mark.parametrize(
    "line",
    [
        "double x = erf(w[0]);",
        "double x = w[0] * pow(w[1], 2);",
        "double x = J_c0 * facet[entity_local_index[0]][0];",
        "double x = w[0] ? 1.0 : w[1] ? 2.0 : 3.0;",
        "bool b = w[0] < 1.0 && w[1] < 2.0;",
        "int i = 3;",
        "float x = 1.0;",
        "if (w[0] < 1.0) x = 2.0;",
        "for (int i = 0; i < n; ++i)",
        "x -= 1.0;",
        "A[0] += foo(w[0]);",
        "goto end;",
    ],
)
def test_unknown_lines_are_refused(line):
    """None of them is written by FFCx as it is now for cells; another one might."""
    with pytest.raises(lanes.NotTranslatedError):
        translated(line)


def test_code_without_a_kernel_is_refused():
    """An integral of which nothing is found, as of another version's files."""
    with pytest.raises(lanes.NotTranslatedError):
        lanes.translated("static ufcx_integral* form_integrals_form_b2[1] = {&integral_a1};", "some")
    with pytest.raises(lanes.NotTranslatedError):
        lanes.translated("", "some")


def test_tables_stay_scalars():
    """What is the same in all cells is kept once."""
    table = "static const double FE[1][1][2] = {{{-0.5, 1e-05}}};"
    function = translated(table, "double x = 0.0;", "x += w[0] * FE[0][0][1];")
    assert table in function
    assert "lanes x = none + (0.0);" in function


FORMS = {
    "whole powers": lambda u: u**2 + u**-3 + (1 + u) ** 7,
    "other powers": lambda u: u**0.5 + u**-1.5 + (1 + u) ** u,
    "choices": lambda u: ufl.conditional(ufl.lt(u, 0.6), u, ufl.ln(u)) + ufl.conditional(ufl.ge(u, 0.5), 1.0, u),
    "choices of what may be no number": lambda u: ufl.conditional(ufl.gt(u, 0.6), ufl.ln(u - 0.6), u),
    "joined conditions": lambda u: ufl.conditional(ufl.And(ufl.lt(u, 0.7), ufl.Not(ufl.lt(u, 0.4))), u, -u),
    "one of two conditions": lambda u: ufl.conditional(ufl.Or(ufl.lt(u, 0.4), ufl.gt(u, 0.7)), u, 2.0),
    "largest and smallest": lambda u: ufl.max_value(u, 0.5) + ufl.min_value(u, 0.6) + abs(u - 0.55),
    "functions": lambda u: ufl.exp(u) + ufl.sin(u) * ufl.cos(u) + ufl.tanh(u) + ufl.atan2(u, 1 + u) + ufl.sqrt(u),
}


@pytest.mark.parametrize("name", FORMS)
def test_numbers_are_those_of_one_cell(monkeypatch, name):
    """What weak forms may say, beside what those of growthx do, against NumPy's one value for each cell."""
    monkeypatch.setattr(sweeps, "FEWEST", 0)
    monkeypatch.setattr(sweeps, "WIDTH", 1)
    domain = square(5).domain
    space = dolfinx.fem.functionspace(domain, ("DG", 0))
    u = dolfinx.fem.Function(space)
    u.interpolate(lambda x: 0.1 + 0.8 * x[0] * (1 - 0.3 * x[1]))
    weak_form = FORMS[name](u) * ufl.TestFunction(space) * ufl.dx
    form = Compiler().residual(weak_form)
    found = assemble(form)
    assert form.sweep is not None
    form.sweep = None
    assert found == pytest.approx(assemble(form), rel=1e-15, abs=1e-15)
    assert COMM.allreduce(float(np.abs(found).sum())) > 0.1


def test_what_cannot_be_translated_is_taken_one_by_one(monkeypatch):
    """A function that is not known is no error, and is not tried again."""
    monkeypatch.setattr(sweeps, "FEWEST", 0)
    domain = square(5).domain
    space = dolfinx.fem.functionspace(domain, ("DG", 0))
    u = dolfinx.fem.Function(space)
    u.x.array[:] = 0.5
    for _ in range(2):
        form = Compiler().residual(ufl.erf(u) * ufl.TestFunction(space) * ufl.dx)
        assert form.sweep is None
    assert COMM.allreduce(float(assemble(form).sum())) == pytest.approx(0.5204998778)


@pytest.mark.filterwarnings("ignore")
def test_a_compiler_that_knows_no_vectors_is_enough(monkeypatch, capfd):
    """What it refuses is taken one by one."""
    monkeypatch.setattr(sweeps, "FEWEST", 0)
    monkeypatch.setattr(sweeps, "GATHER", "no code in C")
    space = dolfinx.fem.functionspace(square(5).domain, ("DG", 0))
    form = Compiler().residual(ufl.TestFunction(space) * ufl.dx)
    capfd.readouterr()  # its complaints
    assert form.sweep is None
    assert COMM.allreduce(float(assemble(form).sum())) == pytest.approx(1.0)


def test_ffcx_still_writes_what_is_read():
    """A plain form of this version is translated, and has vectors where it had numbers."""
    domain = square(5).domain
    space = dolfinx.fem.functionspace(domain, ("Lagrange", 1))
    u = dolfinx.fem.Function(space)
    weak_form = ufl.inner(ufl.grad(u), ufl.grad(ufl.TestFunction(space))) * ufl.dx
    folder = kernels._options(steady(domain.comm), weak_form)["cache_dir"]
    (function,) = lanes.translated(next(folder.glob("*.c")).read_text(), "some").values()
    assert not re.search(r"(?<!static const )\bdouble\b(?! \*|\* restrict c)", function)
