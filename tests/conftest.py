"""For every test: torch keeps to one thread, so that tests beside each other do not wait for each other's threads.

NumPy is to multiply matrices as it does when assets are made. MuJoCo draws without a display. Worlds of the tiny town
are compiled once per process.
"""

from __future__ import annotations

import gc
import os
import shutil
from pathlib import Path

import pytest

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("MUJOCO_GL", "egl")  # tests of assets draw without a display; read when mujoco is first imported

import authoring
from tests import compiled_worlds, shared

assert authoring.KERNELS in os.environ

COMPILED = compiled_worlds.install(pytest.MonkeyPatch())


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Tests of the room `world` compile every world; all others share those of the tiny town."""
    COMPILED.is_on = "tests/world/" not in item.path.as_posix()


@pytest.fixture(scope="session")
def mypy_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where mypy keeps what it finds in gear, NumPy and torch, so that it does not check them again for each test.

    One process of a run fills it, in most of a minute. The others get a copy, because mypy's database is not made for
    several writers.
    """
    filled = shared.once(tmp_path_factory, "mypy", shared.fill_mypy_cache)
    return Path(shutil.copytree(filled, tmp_path_factory.mktemp("mypy") / "cache"))


@pytest.fixture(scope="session")
def builder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fresh environment with the tests' packages and with what builds packages, for all processes of a run."""
    return shared.once(tmp_path_factory, "builder", shared.make_builder)


@pytest.fixture(scope="session")
def gear_wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of gear, built once for all processes of a run."""
    return next(shared.once(tmp_path_factory, "wheel", shared.build_gear).glob("*.whl"))


def pytest_collection_finish() -> None:
    """What is imported by now stays: garbage collections, such as that of every world, need not go through it."""
    gc.collect()
    gc.freeze()
