"""Every test runs in one rank or in several; a test that starts programs of its own is marked `serial`."""

import faulthandler
import gc
import itertools
import os
import re
import signal
import sys
from pathlib import Path
from typing import TextIO

import pytest
from mpi4py import MPI

COMM = MPI.COMM_WORLD
HANGS = 600.0  # seconds after which a test does not end by itself
COLLECTED = 50  # tests between two collections of garbage on several ranks
SAID = pytest.StashKey[TextIO]()
COMPLAINT = re.compile(r"^.*(?:PETSC ERROR|WARNING!|CHOLMOD (?:error|warning)).*$", re.MULTILINE)


@pytest.hookimpl(trylast=True)
def pytest_configure(config):
    """Let rank 0 alone report, and programs that tests start hear Ctrl-C: in the background, shells have them deaf."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    said = os.fdopen(os.dup(sys.__stderr__.fileno()), "w")  # not what pytest keeps of a test's
    config.add_cleanup(said.close)
    config.stash[SAID] = said
    if COMM.size > 1:
        gc.disable()
    if COMM.rank > 0:
        nowhere = open(os.devnull, "w")  # noqa: SIM115
        config.add_cleanup(nowhere.close)
        config.pluginmanager.get_plugin("terminalreporter")._tw._file = nowhere


def pytest_collection_modifyitems(items):
    """Leave out tests that start programs when this is itself a rank: they would hang."""
    if COMM.size > 1:
        skip = pytest.mark.skip(reason="starts programs of its own, which hang inside an MPI rank")
        for item in items:
            if item.get_closest_marker("serial"):
                item.add_marker(skip)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """Let each rank say where it is in a test that hangs; several are ended, lest a whole run be waited for."""
    faulthandler.dump_traceback_later(HANGS, exit=COMM.size > 1, file=item.config.stash[SAID])
    try:
        return (yield)
    finally:
        faulthandler.cancel_dump_traceback_later()


_tests = itertools.count(1)


def pytest_runtest_teardown():
    """Free what tests have left at the same time on all ranks.

    OpenMPI numbers a new communicator by trial, until one is free on all of them: where each has gaps of its own, as
    collections at a time of its own leave them, every vector of DOLFINx' takes it hundreds of trials.
    """
    if COMM.size > 1 and next(_tests) % COLLECTED == 0:
        gc.collect()


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    """Let what PETSc complains of be an error, as Python's warnings are.

    End all ranks when a test fails on one: the others may be waiting for it.
    """
    outcome = yield
    report = outcome.get_result()
    complaints = COMPLAINT.findall(report.capstdout + report.capstderr)
    if report.when == "call" and report.passed and complaints:
        report.outcome, report.longrepr = "failed", f"PETSc complained: {complaints[0]}"
    if COMM.size > 1 and report.failed:
        print(
            f"rank {COMM.rank} of {COMM.size}: {item.nodeid} failed\n{report.longreprtext}",
            file=sys.__stderr__,
            flush=True,
        )
        COMM.Abort(1)


@pytest.fixture
def shared_folder(tmp_path):
    """An empty folder that all ranks see, as rank 0's."""
    return Path(COMM.bcast(str(tmp_path)))
