"""The programs there are: the page each leaves in `results`, and about how long it takes.  Imports none of them."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent


@dataclass(frozen=True)
class Benchmark:
    """A program: its module below `benchmarks`, its page, and about how long it takes where nothing is known yet.

    page: in `results`, or a path in the checkout.
    """

    module: str
    page: str
    takes: str

    @property
    def path(self) -> str:
        """The page's place in the checkout."""
        return self.page if "/" in self.page else f"benchmarks/results/{self.page}"

    @property
    def command(self) -> str:
        """What Python is told in the checkout."""
        return f"python -m benchmarks.{self.module}"

    @property
    def file(self) -> Path:
        """Where the program is: a module, or the room of several."""
        path = ROOT.joinpath(*self.module.split("."))
        return path / "__main__.py" if path.is_dir() else path.with_suffix(".py")

    @property
    def measures(self) -> str:
        """The first line of its docstring."""
        text = ast.get_docstring(ast.parse(self.file.read_text(encoding="utf-8"))) or ""
        return text.partition("\n")[0].rstrip(".")

    @property
    def renderer(self) -> str:
        """The module whose `page()` renders the page from the CSV files."""
        own = self.file.name == "__main__.py"
        return f"benchmarks.{self.module}.page" if own else f"benchmarks.{self.module}"


CATALOGUE = (
    Benchmark("accuracy.convergence", "convergence.md", "about 15 minutes"),
    Benchmark("accuracy.error_vs_runtime", "error_vs_runtime.md", "hours"),
    Benchmark("accuracy.febio", "febio.md", "about 2 minutes, and the file of FEBio's test suite"),
    Benchmark("accuracy.paper_claims", "docs/paper.md", "about a minute"),
    Benchmark("accuracy.paper_tables", "paper_tables.md", "about 4 minutes"),
    Benchmark("robustness.globalisation", "globalisation.md", "about 7 minutes"),
    Benchmark("robustness.random_scenes", "random_scenes.md", "hours for a hundred thousand scenes"),
    Benchmark("speed.newton_step", "newton_step.md", "about 2 minutes"),
    Benchmark("speed.peers", "peers.md", "minutes, and the other codes' scripts and packages"),
    Benchmark("speed.profile_runs", "profile_runs.md", "minutes"),
    Benchmark("speed.scaling", "scaling.md", "about 15 minutes"),
    Benchmark("stability", "stability.md", "about 20 minutes"),
    Benchmark("stability.weinans", "weinans.md", "about 6 minutes"),
    Benchmark("stability.zero_one", "zero_one.md", "about 10 minutes"),
)
