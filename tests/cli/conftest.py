"""The command line in the process of the tests."""

import signal

import pytest

from growthx.cli import main


@pytest.fixture
def in_process(capsys, monkeypatch, tmp_path):
    """`growthx` in this process, which spares the start of another one: status, stdout and stderr."""

    def run(*arguments):
        before = signal.getsignal(signal.SIGTERM)
        try:
            status = main([str(argument) for argument in arguments])
        finally:
            signal.signal(signal.SIGTERM, before)
        return status, *capsys.readouterr()

    monkeypatch.chdir(tmp_path)
    return run
