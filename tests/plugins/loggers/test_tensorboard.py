"""The logger TensorBoard: TensorBoard's own reader finds what was logged."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from gear.contracts.loggers import LoggedRun
from gear.plugins.loggers import event_file
from gear.plugins.loggers import tensorboard as plugin
from gear.plugins.loggers.tensorboard import TensorBoardConfig, build, spec
from gear.testing.logger_contract import PICTURE, SCALAR, LoggerContract
from gear.values.errors import FieldError, GearError
from tests.plugins.loggers.reading import read_log

pytest.importorskip("tensorboard")


class TestTensorBoard(LoggerContract):
    spec = spec

    def test_everything_is_read_back(self, tmp_path: Path) -> None:
        log = self.opened(tmp_path)
        self.logged(log, 1, 3)
        log.close()
        found = read_log(tmp_path)
        assert found.scalars == {SCALAR: [(1, 0.1), (2, 0.2), (3, 0.3)]}
        assert [step for step, _ in found.pictures[PICTURE]] == [1, 2, 3]
        assert all((rgb == step).all() and rgb.shape == (12, 24, 3) for step, rgb in found.pictures[PICTURE])
        assert found.texts == {"config": "# settings\n\n`seed: 0`"}

    def test_a_resumed_log_has_every_step_once(self, tmp_path: Path) -> None:
        first = self.opened(tmp_path)
        self.logged(first, 1, 5)
        first.flush()
        second = self.opened(tmp_path, done=3)
        self.logged(second, 4, 6)
        second.close()
        first.close()
        found = read_log(tmp_path)
        assert [step for step, _ in found.scalars[SCALAR]] == [1, 2, 3, 4, 5, 6]
        assert [step for step, _ in found.pictures[PICTURE]] == [1, 2, 3, 4, 5, 6]

    def test_a_new_run_begins_a_new_log(self, tmp_path: Path) -> None:
        (tmp_path / "notes.txt").write_text("mine")
        for last in (5, 2):
            log = self.opened(tmp_path)
            self.logged(log, 1, last)
            log.close()
        assert [step for step, _ in read_log(tmp_path).scalars[SCALAR]] == [1, 2]
        assert (tmp_path / "notes.txt").read_text() == "mine"

    def test_files_are_in_the_order_of_the_runs_when_the_clock_goes_back(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        times = iter([2_000_000_000.0, 1_000_000_000.0, 1_000_000_001.0])
        names = []
        for done, now in enumerate(times):
            monkeypatch.setattr(event_file.time, "time", lambda now=now: now)
            log = self.opened(tmp_path, done=done)
            log.close()
            names.append({path.name for path in tmp_path.iterdir()})
        assert sorted(names[2]) == [sorted(names[0])[0], *sorted(names[1] - names[0]), *sorted(names[2] - names[1])]

    def test_names_have_no_host(self, tmp_path: Path) -> None:
        """Logs are shared, and the name of a machine is nobody's business."""
        self.opened(tmp_path).close()
        assert all(os.uname().nodename not in path.name for path in tmp_path.iterdir())

    def test_entries_are_on_the_disk_after_flush_s(self, tmp_path: Path) -> None:
        run = LoggedRun(verb="train", title="t", folder=tmp_path)
        log = build(TensorBoardConfig(flush_s=0)).open(run)
        log.scalar(SCALAR, 1.0, 1)
        assert read_log(tmp_path).scalars == {SCALAR: [(1, 1.0)]}
        log.close()

    def test_a_full_disk_is_an_error_of_the_call(self, tmp_path: Path) -> None:
        """The limit on a file's size stands for a full disk; a subprocess has it alone."""
        done = subprocess.run(
            [sys.executable, "-c", FULL, str(tmp_path)], capture_output=True, text=True, check=False,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096)),
        )  # fmt: skip
        assert done.returncode == 0 and done.stdout == "OSError\n" and done.stderr == ""


FULL = """
import signal, sys
from pathlib import Path
import numpy as np
from gear.contracts.loggers import LoggedRun
from gear.plugins.loggers import event_file
from gear.plugins.loggers.tensorboard import TensorBoardConfig, build
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
log = build(TensorBoardConfig(flush_s=0)).open(LoggedRun(verb="train", title="t", folder=Path(sys.argv[1])))
try:
    log.picture("noise", np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8), 1)
except OSError:
    print("OSError")
try:
    log.close()
except OSError:
    pass
"""


def test_without_the_package_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plugin, "find_spec", lambda name: None)
    with pytest.raises(GearError, match=r"^tensorboard is not installed; pip install 'mujoco-gear\[tensorboard\]'$"):
        build(TensorBoardConfig())


@pytest.mark.parametrize("flush_s", [-1.0, float("nan"), float("inf")])
def test_times_that_are_none(flush_s: float) -> None:
    with pytest.raises(FieldError, match="flush_s"):
        TensorBoardConfig(flush_s=flush_s)
