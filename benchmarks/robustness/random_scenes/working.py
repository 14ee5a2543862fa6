"""Processes that run scenes, one after another: what hangs is killed, what crashes is noticed, with its number."""

from __future__ import annotations

import json
import os
import selectors
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

import growthx as gx
from benchmarks.robustness.random_scenes import running, scenes
from benchmarks.robustness.random_scenes.running import Row

CODE = "from benchmarks.robustness.random_scenes.working import serve; serve()"
NICE = 10
LOOK = 0.5  # seconds between looks at what takes long
PATIENCE = 60.0  # seconds a process may take to end
ROOT = Path(__file__).parents[3]


def serve() -> None:
    """Run the scene of each number that stands on a line of the input, and answer with its row."""
    os.nice(NICE)
    # What libraries print must not stand among the answers.
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    for line in sys.stdin:
        print(json.dumps(asdict(running.run(int(line)))), file=answers, flush=True)


class _Worker:
    """One such process, and the scene it is at."""

    def __init__(self, log: Path) -> None:
        self._log = log
        self.seed: int | None = None
        self._start()

    def _start(self) -> None:
        with self._log.open("a") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-c", CODE],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
                cwd=ROOT,
            )

    def begin(self, seed: int) -> None:
        """Have it run a scene."""
        assert self.process.stdin is not None
        self.seed, self.began = seed, time.monotonic()
        self.process.stdin.write(f"{seed}\n")
        self.process.stdin.flush()

    def answer(self) -> Row:
        """The row of its scene; where there is none, it has crashed, and another process takes its place."""
        assert self.process.stdout is not None and self.seed is not None
        line = self.process.stdout.readline()
        if line:
            return Row(**json.loads(line))
        code = self.process.wait()
        name = signal.Signals(-code).name if code < 0 else f"exit status {code}"
        return self._replaced(running.CRASH, name)

    def stop_if_late(self, limit: float) -> Row | None:
        """Kill it if it has been at its scene for longer than so many seconds."""
        if self.seed is None or time.monotonic() - self.began < limit:
            return None
        self.process.kill()
        self.process.wait()
        return self._replaced(running.HANG, f"no end within {limit:g} s")

    def _replaced(self, outcome: str, kind: str) -> Row:
        assert self.seed is not None
        self._close()
        self._start()
        return failed(self.seed, outcome, kind, time.monotonic() - self.began)

    def end(self) -> None:
        """Let it go."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait(timeout=PATIENCE)
        self._close()

    def _close(self) -> None:
        for pipe in (self.process.stdin, self.process.stdout):
            assert pipe is not None
            with suppress(BrokenPipeError):
                pipe.close()


def failed(seed: int, outcome: str, kind: str, seconds: float) -> Row:
    """The row of a scene of which nothing came back."""
    try:
        each = scenes.trial(seed)
    except gx.GrowthxError:
        each = None
    return running.row(seed, each, seconds, outcome=outcome, kind=kind, sentence="")


def rows(seeds: Iterable[int], workers: int, limit: float, log: Path) -> Iterator[Row]:
    """The rows of some numbers as they come, by so many processes; limit: seconds for one scene.

    log: a file for what the processes say beside.
    """
    waiting = iter(seeds)
    selector = selectors.DefaultSelector()
    busy: list[_Worker] = []

    def give(worker: _Worker) -> None:
        seed = next(waiting, None)
        if seed is None:
            worker.end()
            return
        worker.begin(seed)
        selector.register(worker.process.stdout, selectors.EVENT_READ, worker)  # type: ignore[arg-type]
        busy.append(worker)

    for _ in range(workers):
        give(_Worker(log))
    while busy:
        ready = [key.data for key, _ in selector.select(LOOK)]
        for worker in list(busy):
            pipe = worker.process.stdout
            row = worker.answer() if worker in ready else worker.stop_if_late(limit)
            if row is not None:
                selector.unregister(pipe)  # type: ignore[arg-type]
                busy.remove(worker)
                yield row
                give(worker)
