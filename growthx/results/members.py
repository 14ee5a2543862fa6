"""A file of arrays with a header in JSON and the SHA-256 of both: whole under its name, or not there."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.common.arrays import Floats


def write(file: Path, header: dict[str, Any], arrays: dict[str, Floats], *, compressed: bool = False) -> None:
    """Write a header and arrays; OSError if there is no room for them, and then nothing is there."""
    text = json.dumps(header, default=lambda value: value.tolist())
    members = {"header": np.frombuffer(text.encode(), dtype=np.uint8), **arrays}
    part = file.with_name(f".{file.name}.part")
    try:
        with part.open("wb") as stream:
            save = np.savez_compressed if compressed else np.savez
            save(stream, sha256=np.array(_digest(members)), **members)  # type: ignore[arg-type]
            stream.flush()
            os.fsync(stream.fileno())
        part.replace(file)
    finally:
        part.unlink(missing_ok=True)


def read(
    file: Path, kind: str, known: int, instead: Callable[[], str] = lambda: ": another one would be right"
) -> tuple[dict[str, Any], dict[str, Floats]]:
    """The header and the arrays of a file.

    kind: what it should be, in words.  known: the format that is.  instead: the end of a sentence about a damaged one.
    Raises InputError if it is none, damaged, or of another format.
    """
    try:
        with file.open("rb") as stream, np.load(stream, allow_pickle=False) as members:
            arrays = {name: members[name] for name in members.files}
        digest, header = str(arrays.pop("sha256")), json.loads(arrays["header"].tobytes())
        version = header["format"]
        intact = version != known or digest == _digest(arrays)
    except Exception as error:  # NumPy, zipfile and zlib have many ways to say that a file is not what it should be
        raise InputError(f"{file} is damaged or no {kind} ({error}){instead()}") from error
    if version != known:
        raise InputError(f"the {kind} {file} has format {version}: this version of growthx reads format {known}")
    if not intact:
        raise InputError(f"{file} is damaged (its checksum is wrong){instead()}")
    del arrays["header"]
    return header, arrays


def _digest(members: dict[str, Any]) -> str:
    found = hashlib.sha256()
    for name in sorted(members):
        array = np.ascontiguousarray(members[name])
        found.update(f"{name} {array.dtype.str} {array.shape}".encode())
        found.update(array)
    return found.hexdigest()
