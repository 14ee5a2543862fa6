"""A display for VTK to draw on."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

from growthx.common.errors import GrowthxError


@contextmanager
def display() -> Iterator[None]:
    """Debian's VTK draws on an X server: an invisible one where there is none."""
    if os.environ.get("DISPLAY") or os.name == "nt":
        yield
        return
    read, write = os.pipe()
    try:
        server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), "-screen", "0", "1600x1600x24", "-nolisten", "tcp"],
            pass_fds=(write,),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
    except FileNotFoundError:
        raise GrowthxError("no picture without a display: set DISPLAY or install Xvfb") from None
    os.close(write)
    with os.fdopen(read) as answer:
        number = answer.readline().strip()
    os.environ["DISPLAY"] = f":{number}"
    try:
        yield
    finally:
        del os.environ["DISPLAY"]
        server.terminate()
        server.wait()
