"""The site of the documentation: nothing is left out of it, and what it shows runs."""

import hashlib
import html
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import growthx
from docs.site import contents, links, prose
from docs.site.contents import HERE, ROOT


def listed():
    """The entries of all toctrees, on the site's own pages."""
    pages = [path.read_text(encoding="utf-8") for path in HERE.glob("*.md")]
    trees = [tree for page in pages for tree in re.findall(r"```\{toctree\}\n(.*?)```", page, re.DOTALL)]
    entries = (line for tree in trees for line in tree.splitlines() if line and not line.startswith(":"))
    return [re.sub(r".*<(.*)>", r"\1", entry) for entry in entries]  # those with a title of their own, too


def test_every_page_is_in_the_site():
    """Whoever adds a page, a result or a tutorial need not know that there is a site: this test does."""
    folders = {
        "docs": (contents.EXPLANATIONS, "*.md"),
        "docs/howto": (contents.HOWTOS, "*.md"),
        "docs/tutorials": (contents.TUTORIALS, "*.py"),
        "benchmarks/results": (contents.RESULTS, "*.md"),
        "docs/site": (contents.OWN, "*.md"),
    }
    for folder, (names, pattern) in folders.items():
        assert sorted(names) == sorted(path.stem for path in (ROOT / folder).glob(pattern)), folder
    assert {path.stem for path in ROOT.glob("*.md")} == set(contents.PROJECT)


def test_every_page_is_in_one_toctree():
    """Else Sphinx leaves it where no reader finds it, or has it twice."""
    pages = {
        *(f"docs/{name}" for name in contents.EXPLANATIONS),
        *(f"docs/howto/{name}" for name in contents.HOWTOS),
        *(f"benchmarks/results/{name}" for name in contents.RESULTS),
        *(f"tutorials/{name}" for name in contents.TUTORIALS),
        *(f"api/{group.page}" for group in contents.GROUPS),
        *(f"api/of_{module}" for module in growthx._MODULES),
        *contents.PROJECT,
        *contents.OWN,
        "commands",
        "messages",
    }
    assert sorted(listed()) == sorted(pages - {"index"})


def test_every_public_name_is_on_one_page():
    """A new name is in the reference as soon as it is public."""
    names = [name for group in contents.GROUPS for name in contents.names_of(group)]
    assert sorted(names) == sorted(growthx._HOME)
    assert all(contents.names_of(group) for group in contents.GROUPS)
    assert all(contents.members_of(module) for module in growthx._MODULES)


def test_links_of_its_own_pages_hold():
    """To the repository's pages, which are staged at their own places, and to those that are made."""
    made = {"commands.md", "messages.md", *(f"tutorials/{name}.ipynb" for name in contents.TUTORIALS)}
    own = {f"{name}.md" for name in contents.OWN}
    for path in HERE.glob("*.md"):
        for target in re.findall(r"\]\(([^)\s]+)\)", path.read_text(encoding="utf-8")):
            file = target.partition("#")[0]
            assert file in made | own or (ROOT / file).is_file(), f"{path.name}: {target}"


def test_the_page_on_files_has_what_a_run_leaves(shared_folder):
    """Every file, every column of the history and every key of --json, as a run has them today."""
    page = (HERE / "files.md").read_text(encoding="utf-8")
    told = {word for code in re.findall(r"`([^`\n]+)`", page) for word in re.split(r"[,\s]+", code)}
    result = growthx.solve(growthx.scenes.plate(2), growthx.Q1P0, out=shared_folder / "run", checkpoint=10)
    assert set(growthx.results.summary(result)) <= told
    header = (shared_folder / "run" / "history.csv").read_text(encoding="utf-8").splitlines()[0]
    assert {name for name in header.split(",") if not name.startswith("reaction_")} <= told
    files = {re.sub(r"(_p)?\d+(_\d+)?|-\d+", "", path.name) for path in (shared_folder / "run").iterdir()}
    assert files <= {re.sub(r"(_p)?…|-…|-N+", "", name) for name in told}


def test_the_page_on_exit_statuses_has_all_of_them():
    """As the help of every command tells them."""
    from growthx.cli.program import EPILOG

    statuses, *_ = EPILOG.partition("In parallel")
    page = (HERE / "exit_statuses.md").read_text(encoding="utf-8")
    assert re.findall(r"\b\d+\b", statuses) == re.findall(r"^\| (\d+) \|", page, re.MULTILINE)


def test_docstrings_become_text():
    """What docutils would take for markup is told as it stands; parameters become a list, public names links."""
    lines = prose.as_text(
        ["Of |x| and ρ*.", "", "young, poisson: of σ_zz, see", "`Mesh` and `E`.  n: exponent.", "Raises InputError."],
        {"Mesh"},
    )
    assert lines == [
        "Of \\|x\\| and ρ\\*.",
        "",
        "- **young, poisson**: of σ\\_zz, see \\ :py:obj:`Mesh <growthx.Mesh>`\\  and \\ ``E``\\ .",
        "",
        "- **n**: exponent.",
        "",
        "Raises InputError.",
        "",
    ]
    assert prose.as_text(["    a = 1"], ()) == [".. code-block:: text", "", "    a = 1", ""]
    example = ["n: exponent.", "", "Example:", "    >>> 1 * 2", "    2"]
    shown = [".. code-block:: pycon", "", "    >>> 1 * 2", "    2", ""]
    assert prose.as_text(example, ()) == ["- **n**: exponent.", "", "Example:", "", *shown]


@pytest.mark.serial
def test_links_that_lead_nowhere_are_found(tmp_path):
    """A page, an anchor and a picture that are not there; what is there, and other hosts, are left alone."""
    (tmp_path / "api").mkdir()
    (tmp_path / "a%b.html").write_text('<p id="here"><a href="#here"><a href="#there"><img src="no.png">', "utf-8")
    (tmp_path / "api" / "b.html").write_text(
        '<a href="../a%25b.html#here"><a href="../c.html?x=1"><a href="https://doi.org/1">', "utf-8"
    )
    assert links.broken(tmp_path) == ["a%b.html: #there", "a%b.html: no.png", "api/b.html: ../c.html?x=1"]


@pytest.mark.serial
@pytest.mark.parametrize("name", contents.TUTORIALS)
def test_a_tutorial_runs(name, tmp_path):
    """As a script, as its page says, to the pictures that it shows; it ends with what it has promised."""
    script = ROOT / "docs" / "tutorials" / f"{name}.py"
    run = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    text = script.read_text(encoding="utf-8")
    pictures = set(re.findall(r"!\[.*?\]\((.*?)\)", re.sub(r"\n# ", " ", text)))
    assert {path.name for path in tmp_path.iterdir()} == pictures


@pytest.mark.serial
def test_run_docs_takes_no_other_words():
    """A misspelt option is told before anything is fetched or built."""
    run = subprocess.run([ROOT / "run", "docs", "--opn"], capture_output=True, text=True, timeout=60)
    assert run.returncode == 1 and run.stderr == "growthx: docs takes no more than --open: '--opn' is not known\n"


@pytest.mark.slow
@pytest.mark.serial
def test_the_site_is_built(tmp_path):
    """Without a warning, with what `./run docs` has fetched; every page is there, and the tutorials' pictures."""
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "growthx"
    wanted = hashlib.sha256((HERE / "requirements.txt").read_bytes()).hexdigest()[:12]
    packages = cache / f"docs-{wanted}-{sys.version_info.major}.{sys.version_info.minor}"
    if not packages.is_dir():
        pytest.skip("Sphinx is not there: ./run docs fetches it")
    path = os.pathsep.join([str(ROOT), str(packages)])
    command = [sys.executable, "-m", "docs.site", tmp_path]
    run = subprocess.run(
        command, env={**os.environ, "PYTHONPATH": path}, cwd=tmp_path, capture_output=True, text=True, timeout=600
    )
    assert run.returncode == 0 and run.stderr == "", run.stdout + run.stderr
    assert all((tmp_path / "html" / f"{page}.html").is_file() for page in ("index", *listed()))
    messages = html.unescape((tmp_path / "html" / "messages.html").read_text(encoding="utf-8"))
    assert "--bounds LOW HIGH would be right" in messages and "’" not in messages, "as they are printed"
    assert {"bar.png", "column.png"} <= {path.name for path in (tmp_path / "html" / "_images").iterdir()}
    for name in contents.TUTORIALS:
        shown = (tmp_path / "html" / "tutorials" / f"{name}.html").read_text(encoding="utf-8")
        assert len(re.findall(r"This page took \d+ s and \d+ MB", shown)) == 1 and "peak memory" not in shown, name
        offered = (tmp_path / "html" / "_sources" / "tutorials" / f"{name}.ipynb").read_text(encoding="utf-8")
        assert "peak memory" not in offered, name
