"""Folders that all processes of a run of the tests share, such as a wheel that is built once; limits of open files."""

from __future__ import annotations

import contextlib
import os
import resource
import subprocess
import sys
import sysconfig
import venv
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from gear.dataset.locks import dataset_lock
from gear.reporting import display
from gear.values.progress import Callbacks

ROOT = Path(__file__).parents[1]

USES_OF_GEAR = """
import gear
import gear.testing.attack_contract
import gear.testing.controller_contract
import gear.testing.defense_contract
import gear.testing.logger_contract
import gear.testing.metric_contract
import gear.testing.model_contract
import gear.testing.task_contract
"""
"""What the tests of a plugin package import, and with it most of gear."""


def shared_folder(tmp_path_factory: pytest.TempPathFactory, name: str) -> Path:
    """A folder of that name, shared by all processes; a writer must hold its `gear.dataset.locks.dataset_lock`."""
    run = tmp_path_factory.getbasetemp()
    return (run.parent if "PYTEST_XDIST_WORKER" in os.environ else run) / name


def once(tmp_path_factory: pytest.TempPathFactory, name: str, fill: Callable[[Path], None]) -> Path:
    """The shared folder of that name; `fill` puts into it what it holds, once in a run.

    Args:
        tmp_path_factory: pytest's maker of folders, one per process.
        name: name of the folder.
        fill: called with the empty folder by the first process that needs it; the others wait.
    """
    shared = shared_folder(tmp_path_factory, name)
    with dataset_lock(shared):
        if not (shared / "whole").exists():
            (shared / "content").mkdir(exist_ok=True)
            fill(shared / "content")
            (shared / "whole").touch()
    return shared / "content"


def call(*command: str | Path, cwd: Path, env: dict[str, str] | None = None) -> str:
    """What a command prints; the test fails if the command does.

    Args:
        command: its words.
        cwd: the folder in which it runs.
        env: its environment; None for that of the tests.
    """
    words = [str(word) for word in command]
    done = subprocess.run(words, cwd=cwd, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{words}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def make_environment(folder: Path) -> None:
    """Makes a virtual environment that also sees the packages of the tests' own environment.

    So pip installs only what is missing there, and torch's bytecode is not made again.
    """
    venv.create(folder, with_pip=True)
    (site,) = (folder / "lib").glob("python*/site-packages")
    (site / "parent.pth").write_text(f"{sysconfig.get_path('purelib')}\n")


def make_builder(folder: Path) -> None:
    """An environment with hatchling, so that packages can be built without an environment for each of them."""
    make_environment(folder)
    call(folder / "bin/python", "-m", "pip", "install", "-q", "hatchling", "editables", cwd=folder)


def build_gear(folder: Path) -> None:
    """Builds the wheel of gear as a user does: in an environment of its own, from what `pyproject.toml` declares."""
    call(sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", folder, ROOT, cwd=folder)


def fill_mypy_cache(folder: Path) -> None:
    """Lets mypy read gear and the packages that gear imports, with the options of a plugin package."""
    (folder / "uses.py").write_text(USES_OF_GEAR)
    (folder / "mypy.ini").write_text("[mypy]\nstrict = True\n")
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    config = ("--config-file", folder / "mypy.ini", "--cache-dir", folder)
    call(sys.executable, "-m", "mypy", *config, folder / "uses.py", cwd=folder, env=env)


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


class ClockedLines:
    """The plain lines of a display without a terminal, by a clock that moves ten seconds with every report.

    Attributes:
        callbacks: callbacks for a verb.
        seen: the line that the log would have after each report.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, verb: str, unit: str = "sample") -> None:
        self.seen: list[str] = []
        self._now_s = 0.0
        monkeypatch.setattr(display, "EVERY_S", 1000.0)
        monkeypatch.setattr(display, "time", SimpleNamespace(monotonic=lambda: self._now_s))
        self._lines = display._Lines(verb)
        self.callbacks = Callbacks.of(
            on_progress=lambda done, total: self._report("progress", unit, done, total),
            on_part=lambda title, done, total: self._report(f"{display.PART}{title}", "", done, total),
        )

    def _report(self, channel: str, unit: str, done: int, total: int) -> None:
        self._now_s += 10.0
        self._lines.update(channel, unit, done, total)
        self.seen.append(self._lines._line())

    def counted(self, title: str) -> list[str]:
        """The lines of the part `title` that say how many items of it are done."""
        return [line for line in self.seen if f"{title}, " in line]
