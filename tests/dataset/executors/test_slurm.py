"""The engine `slurm` with submitit's own executors, which need no cluster."""

from __future__ import annotations

import subprocess
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest

from gear.contracts.executors import Executor, Outcome
from gear.dataset.executors import slurm, threads
from gear.dataset.executors.engines import open_engine
from gear.testing.executor_contract import ExecutorContract
from gear.values.errors import DatasetError, GearError
from tests.dataset.executors.test_processes import die_at, tell_threads

pytest.importorskip("submitit")
from submitit.core.utils import FailedJobError, UncompletedJobError

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


def test_jobs_share_the_cores(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in threads.THREADS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(threads, "cores", lambda: 8)
    engine = open_engine("slurm", workers=2, backend="classic", address="debug")
    engine.run(partial(tell_threads, str(tmp_path)), [0], lambda outcome: None)
    assert (tmp_path / "0").read_text() == "4,4,4,4"


class Jobs:
    """submitit's executor, whose jobs all end with one error."""

    def __init__(self, error: Exception) -> None:
        self.error, self.cancelled, self.asked = error, 0, 0
        self.job_id, self.paths = 7, SimpleNamespace(stderr="logs/7.err")

    def done(self) -> bool:
        self.asked += 1
        return self.asked % 2 == 1  # one job after another

    def result(self) -> None:
        raise self.error

    def cancel(self) -> None:
        self.cancelled += 1


def ran(error: Exception, monkeypatch: pytest.MonkeyPatch) -> tuple[Jobs, list[Outcome]]:
    jobs, reported = Jobs(error), list[Outcome]()
    monkeypatch.setattr(slurm.OnSlurm, "_submitted", lambda self, work, parts: [jobs] * len(parts))
    slurm.OnSlurm(workers=100).run(partial(die_at, (), 3), range(30), reported.append)
    return jobs, reported


def test_a_job_that_raises_ends_the_run_with_its_last_line(monkeypatch: pytest.MonkeyPatch) -> None:
    rule = "----------------------"
    text = f"Job (task=0) failed during processing with trace:\n{rule}\nTraceback (most recent call last):\n  here\n"
    text += f"ModuleNotFoundError: No module named 'gear'\n\n{rule}\nYou can check full logs with 'job.stderr(0)'"
    with pytest.raises(GearError) as caught:
        ran(FailedJobError(text), monkeypatch)
    assert str(caught.value) == "job 7 failed (ModuleNotFoundError: No module named 'gear'); its log is logs/7.err"


def test_after_lost_jobs_in_a_row_the_others_are_cancelled(monkeypatch: pytest.MonkeyPatch) -> None:
    jobs, reported = ran(UncompletedJobError("no output\nof job 7"), monkeypatch)
    assert 0 < jobs.cancelled == 30 - len(reported)
    assert {(one.kind, one.error, one.trace) for one in reported} == {
        ("failed", "job 7 was lost (no output)", "no output\nof job 7")
    }


def test_logs_are_written_through_no_link_and_are_private(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slurm, "LOGS", str(tmp_path / "logs"))
    folders = {slurm._private_folder(), slurm._private_folder()}
    assert {path.parent for path in folders} == {tmp_path / "logs"} and len(folders) == 2
    assert {path.stat().st_mode & 0o777 for path in folders} == {0o700}
    (tmp_path / "link").symlink_to(tmp_path)
    monkeypatch.setattr(slurm, "LOGS", str(tmp_path / "link"))
    with pytest.raises(DatasetError, match="link: is a link"):
        slurm._private_folder()


def test_a_machine_without_slurm_is_one_line(tmp_path: Path) -> None:
    if subprocess.run(["which", "srun"], capture_output=True, check=False).returncode == 0:
        pytest.skip("SLURM is installed here")
    with pytest.raises(GearError, match=r"--engine slurm: .*--address local runs the jobs on this machine"):
        open_engine("slurm", workers=1, backend="classic").run(partial(die_at, (), 3), [0], lambda outcome: None)
