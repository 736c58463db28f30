"""Output into a full disk is discarded once, without a second error at the interpreter's exit."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no full device")
def test_the_interpreter_exits_quietly() -> None:
    assert printing("from gear.cli.closed_output import discard_output; print('lost'); discard_output()") == (0, b"")
    status, errors = printing("print('lost')")
    assert status != 0 and errors


def printing(code: str) -> tuple[int, bytes]:
    """Status and errors of a program whose buffered output goes into a full disk."""
    env = {key: value for key, value in os.environ.items() if key != "PYTHONUNBUFFERED"}
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run([sys.executable, "-c", code], stdout=full, stderr=subprocess.PIPE, check=False, env=env)
    return done.returncode, done.stderr
