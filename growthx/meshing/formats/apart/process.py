"""Reading in a process of its own, for libraries that a damaged file can make crash, hang or fill the memory.

The child is this file itself, run as a script with nothing of growthx and no MPI: it loads a reader, another file
beside this one that imports what it needs, and hands back the arrays of its function

    arrays(path, values, refuse)    a dictionary of arrays; refuse(sentence) ends it with an InputError there
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

MEMORY = 4 << 30, 200  # bytes that a child may have, and how many times as many as its file has
SECONDS = 60.0, 20.0  # that a child may take, and how many for each megabyte of its file
_OF_MPI = ("OMPI_", "PMIX_", "PRTE_", "PMI_", "MPI_", "HYDRA_")  # a child is no rank of this program
_REFUSED = "refused"
_LAST_WORDS = 4096  # bytes of what a child says on its end


def arrays(
    reader: str | Path, path: Path, values: Mapping[str, float], seconds: tuple[float, float] = SECONDS
) -> dict[str, Any]:
    """What a reader makes of a file, in a process of its own; InputError if that comes to no end of its own.

    reader: a module of this folder by its name, or a file.
    """
    from growthx.common.errors import InputError

    reader = Path(__file__).with_name(f"{reader}.py") if isinstance(reader, str) else reader
    size = path.stat().st_size
    memory = MEMORY[0] + MEMORY[1] * size
    limit = seconds[0] + seconds[1] * size / 1e6
    environment = {name: value for name, value in os.environ.items() if not name.startswith(_OF_MPI)}
    environment |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory(prefix="growthx-") as folder, (Path(folder) / "said").open("w+b") as said:
        out = Path(folder) / "arrays.npz"
        # -P: modules of this folder have the names of libraries.
        command = [sys.executable, "-P", __file__, str(reader), str(path.resolve()), str(out), str(memory)]
        try:
            done = subprocess.run(
                [*command, json.dumps(dict(values))],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=said,
                env=environment,
                cwd=folder,
                timeout=limit,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise InputError(f"{path} could not be read in {limit:.0f} s: a smaller or whole file is needed") from None
        if not out.is_file():
            said.seek(max(0, said.seek(0, os.SEEK_END) - _LAST_WORDS))
            raise InputError(_why(path, done.returncode, said.read().decode(errors="replace"), memory))
        with np.load(out, allow_pickle=False) as found:
            read = {name: found[name] for name in found.files}
    if _REFUSED in read:
        raise InputError(f"{path} {read[_REFUSED]}")
    return read


def _why(path: Path, status: int, said: str, memory: int) -> str:
    """What to say of a child that left nothing but some last words."""
    lines = said.strip().splitlines()
    last = lines[-1] if lines else ""
    if "MemoryError" in last or "bad_alloc" in last:
        return f"{path} would take more than {memory / 2**30:.0f} GiB to read: a smaller or whole file is needed"
    if "No module named" in last:
        return f"reading {path} needs a library that is not installed ({last.rsplit(': ', 1)[-1]}): see packages.txt"
    end = f"signal {-status}" if status < 0 else f"status {status}"
    return (
        f"{path} cannot be read (its library ended by {end}{f': {last[:200]}' if last else ''}): a whole file is needed"
    )


def _child(reader: str, path: str, out: str, memory: str, values: str) -> None:
    """Read a file and leave its arrays; what is printed goes nowhere that counts."""
    import resource
    import runpy
    import warnings

    warnings.simplefilter("ignore")
    for what, most in (
        (resource.RLIMIT_AS, int(memory)),
        (resource.RLIMIT_FSIZE, int(memory)),
        (resource.RLIMIT_CORE, 0),
    ):
        hard = resource.getrlimit(what)[1]
        resource.setrlimit(what, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))

    class Refused(BaseException):
        pass

    def refuse(sentence: str) -> None:
        raise Refused(" ".join(sentence.split()))

    read: Callable[..., dict[str, Any]] = runpy.run_path(reader)["arrays"]
    try:
        found = read(path, json.loads(values), refuse)
    except Refused as refusal:
        found = {_REFUSED: np.array(str(refusal))}
    np.savez(out + ".part.npz", **found)
    os.replace(out + ".part.npz", out)
    os._exit(0)  # libraries are not waited for, nor asked how they feel


if __name__ == "__main__":
    _child(*sys.argv[1:])
