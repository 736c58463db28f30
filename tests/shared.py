"""What all processes of a run of the tests have together."""

from __future__ import annotations

import contextlib
import os
import resource
from collections.abc import Iterator
from pathlib import Path

import pytest


def shared_folder(tmp_path_factory: pytest.TempPathFactory, name: str) -> Path:
    """A folder of that name, shared by all processes; a writer must hold its `gear.dataset.locks.dataset_lock`."""
    run = tmp_path_factory.getbasetemp()
    return (run.parent if "PYTEST_XDIST_WORKER" in os.environ else run) / name


@contextlib.contextmanager
def few_files(further: int) -> Iterator[None]:
    """A context in which this process can open only a few further files."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    listed = list(Path("/proc/self/fd").iterdir())  # with the descriptor of the listing itself, which is closed again
    opened = {int(path.name) for path in listed if path.is_symlink()}
    free = [number for number in range(max(opened) + 2 + further) if number not in opened]
    resource.setrlimit(resource.RLIMIT_NOFILE, (free[further], hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
