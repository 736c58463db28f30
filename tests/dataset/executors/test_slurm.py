"""The engine `slurm` with submitit's own executors, which need no cluster."""

from __future__ import annotations

import subprocess
from functools import partial
from pathlib import Path

import pytest

from gear.contracts.executors import Executor, Outcome
from gear.dataset.executors import slurm
from gear.dataset.executors.engines import open_engine
from gear.testing.executor_contract import ExecutorContract
from gear.values.errors import GearError
from tests.dataset.executors.test_processes import die_at

pytest.importorskip("submitit")
pytestmark = [  # submitit's own executors leave their logs open
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.fixture(autouse=True)
def _quick(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slurm, "POLL_S", 0.05)
    monkeypatch.setattr(slurm, "LOGS", str(tmp_path_factory.mktemp("logs")))


class TestSlurm(ExecutorContract):
    @pytest.fixture
    def executor(self) -> Executor:
        return open_engine("slurm", workers=2, backend="classic", address="debug")


@pytest.mark.slow
def test_the_items_of_a_job_that_dies_are_reported_as_failed() -> None:
    reported: dict[int, Outcome] = {}
    engine = open_engine("slurm", workers=1, backend="classic", address="local")
    engine.run(partial(die_at, (1,), 3), range(3), lambda outcome: reported.update({outcome.index: outcome}))
    assert {index: outcome.kind for index, outcome in reported.items()} == {0: "made", 1: "failed", 2: "made"}
    assert "was lost" in reported[1].error


def test_a_machine_without_slurm_is_one_line(tmp_path: Path) -> None:
    if subprocess.run(["which", "srun"], capture_output=True, check=False).returncode == 0:
        pytest.skip("SLURM is installed here")
    with pytest.raises(GearError, match=r"--engine slurm: .*--address local runs the jobs on this machine"):
        open_engine("slurm", workers=1, backend="classic").run(partial(die_at, (), 3), [0], lambda outcome: None)
