from __future__ import annotations

from collections.abc import Iterator

import fsspec
import pytest


@pytest.fixture
def remote() -> Iterator[str]:
    """The address of an empty folder in this process's memory."""
    files = fsspec.filesystem("memory")
    yield "memory://gear-tests"
    if files.exists("/gear-tests"):
        files.rm("/gear-tests", recursive=True)
