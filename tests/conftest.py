"""For every test: torch keeps to one thread, so that tests beside each other do not wait for each other's threads.

NumPy is to multiply matrices as it does when assets are made. MuJoCo draws without a display. Worlds of the tiny town
are compiled once per process.
"""

from __future__ import annotations

import gc
import os
from pathlib import Path

import pytest

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("MUJOCO_GL", "egl")  # tests of assets draw without a display; read when mujoco is first imported

import authoring
from tests import compiled_worlds

assert authoring.KERNELS in os.environ

COMPILED = compiled_worlds.install(pytest.MonkeyPatch())


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Tests of the room `world` compile every world; all others share those of the tiny town."""
    COMPILED.is_on = "tests/world/" not in item.path.as_posix()


@pytest.fixture(scope="module")
def mypy_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where mypy keeps what it knows of gear and NumPy from one package of a module's tests to the next."""
    return tmp_path_factory.mktemp("mypy")


def pytest_collection_finish() -> None:
    """What is imported by now stays: garbage collections, such as that of every world, need not go through it."""
    gc.collect()
    gc.freeze()
