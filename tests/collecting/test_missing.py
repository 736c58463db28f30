"""The missing samples of a split: failures are tried again and noted, and other runs are waited for."""

from __future__ import annotations

import dataclasses
import os
import platform
import re
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gear.collecting import missing as module
from gear.collecting.missing import collect_missing
from gear.contracts.executors import MOST_FAILURES, Outcome, Report
from gear.dataset.claims import Claims
from gear.dataset.executors.in_process import InThisProcess
from gear.dataset.executors.processes import Processes
from gear.dataset.sealed_json import load_sealed
from gear.dataset.sharding.shards import WHOLE
from gear.dataset.store import Store
from gear.plugins.build import build_task
from gear.testing.synthetic import synthetic_frame
from gear.values.errors import BackendError, DatasetError, GearError, SamplesFailedError, WorkerInterruptedError
from gear.values.progress import Callbacks
from tests.dataset.splits import fill, plan, tree
from tests.verbs.collect.test_run import command


def job_of(root: Path, samples: int) -> Any:
    (root.parent / "faults").mkdir(exist_ok=True)
    return SimpleNamespace(
        root=root, plan=plan(samples=samples, options={}), config=SimpleNamespace(renderer="classic")
    )


def write_synthetic(job: Any, indices: Iterator[int], report: Report) -> None:
    """As `make_samples`, without a world. A file `faults/<index>` says how many tries of a sample fail."""
    store = Store(job.root, job.plan)
    _, task = build_task("depth")
    in_row = 0
    with Claims(store.root, store.split) as claims:
        for index in claims.unclaimed(indices, report):
            fault = job.root.parent / "faults" / str(index)
            if fault.exists() and (left := int(fault.read_text())):
                fault.write_text(str(left - 1))
                if left > 1000:
                    os.kill(os.getpid(), signal.SIGKILL)
                claims.release(index)
                report(Outcome(index=index, kind="failed", error=f"fault {left}", trace="Traceback\nhere"))
                in_row += 1
                if in_row >= MOST_FAILURES:
                    return
                continue
            frame, record = synthetic_frame(task.rig(), index=index, seed=5)
            sample = task.ground_truth(frame, dataclasses.replace(record, split="test"))
            store.write(sample, task.encode(sample, job.plan.info))
            claims.release(index)
            report(Outcome(index=index))
            in_row = 0


@pytest.fixture(autouse=True)
def _no_world(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "make_samples", write_synthetic)
    monkeypatch.setattr(module, "POLL_S", 0.01)


@pytest.fixture
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fresh processes are this one, which saves their start."""
    monkeypatch.setattr(module, "Processes", lambda **_: InThisProcess())


def collect(job: Any, executor: Any = None, warned: list[str] | None = None) -> int:
    store = Store(job.root, job.plan)
    store.open({})
    callbacks = Callbacks.of(on_warning=[].append if warned is None else warned.append)
    return collect_missing(job, store, WHOLE, executor or InThisProcess(), callbacks)


def fault(job: Any, index: int, tries: int) -> None:
    (job.root.parent / "faults" / str(index)).write_text(str(tries))


@pytest.mark.slow
@pytest.mark.parametrize("tries", [1, 2])
def test_a_sample_that_fails_is_tried_twice_more_in_fresh_processes(tries: int, tmp_path: Path) -> None:
    job, warned = job_of(tmp_path / "out", 4), list[str]()
    fault(job, 1, tries)
    assert collect(job, warned=warned) == 4
    assert any(line.startswith("sample 1 failed (fault ") and "tried again" in line for line in warned)
    assert not (tmp_path / "out/gear/test/failed").exists()


def test_a_sample_that_cannot_be_made_is_noted_and_the_rest_is_made(tmp_path: Path, _quick: None) -> None:
    job = job_of(tmp_path / "out", 4)
    fault(job, 1, 4)
    with pytest.raises(SamplesFailedError) as caught:
        collect(job)
    said = str(caught.value)
    assert re.search(
        r"1 of 4 samples of split 'test' could not be made \(sample 1: fault 2\); .* gear/test/failed", said
    )
    assert "\n" not in said and "run the same command again" in said
    note = load_sealed(tmp_path / "out/gear/test/failed/000001.json")
    assert note == {"index": 1, "tries": 3, "error": "fault 2", "traceback": ["Traceback", "here"]}
    assert Store(job.root, job.plan).missing() == [1]
    assert collect(job) == 1, "the fourth try fails, and the fifth one does not"
    assert not (tmp_path / "out/gear/test/failed").exists()
    fill(tmp_path / "straight", plan(samples=4, options={}), is_closed=False)
    assert tree(tmp_path / "out") == tree(tmp_path / "straight"), "the same seed"


@pytest.mark.slow
def test_a_worker_that_is_killed_costs_no_sample(tmp_path: Path) -> None:
    job = job_of(tmp_path / "out", 4)
    fault(job, 1, 1001)
    fault(job, 2, 0)
    with pytest.raises(SamplesFailedError, match=r"1 of 4 .*fault 999"):
        collect(job, Processes(workers=2, backend="classic"))
    fault(job, 1, 0)
    assert collect(job) == 1


def test_when_all_fails_the_run_ends_and_says_what_was_not_tried(tmp_path: Path, _quick: None) -> None:
    job = job_of(tmp_path / "out", 20)
    for index in range(20):
        fault(job, index, 100)
    with pytest.raises(SamplesFailedError, match=r"5 of 20 .*; 15 more were not made after 5 failures in a row"):
        collect(job)
    notes = sorted((tmp_path / "out/gear/test/failed").iterdir())
    assert [path.stem for path in notes] == [f"{index:06d}" for index in range(5)]
    tried = sum(100 - int((tmp_path / "faults" / str(index)).read_text()) for index in range(20))
    assert tried == 2 * MOST_FAILURES, "five here, and five in fresh processes"


def test_an_error_that_belongs_to_no_sample_ends_the_run_and_records_failed_samples(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def breaks(job: Any, indices: Iterator[int], report: Report) -> None:
        report(Outcome(index=0, kind="failed", error="first"))
        raise GearError("no disk")

    monkeypatch.setattr(module, "make_samples", breaks)
    with pytest.raises(GearError, match="no disk"):
        collect(job_of(tmp_path / "out", 3))
    assert [path.stem for path in (tmp_path / "out/gear/test/failed").iterdir()] == ["000000"]


def test_samples_that_another_run_is_making_are_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SILENT_S", 0.05)
    job = job_of(tmp_path / "out", 3)
    Store(job.root, job.plan).open({})
    with Claims(job.root, "test") as other:
        assert other.take(1)
        made: list[int] = []
        warned: list[str] = []
        run = threading.Thread(target=lambda: made.append(collect(job, warned=warned)))
        run.start()
        while len(Store(job.root, job.plan).missing()) > 1:
            time.sleep(0.01)
        time.sleep(0.1)
        assert run.is_alive()
        fill(tmp_path / "other", plan(samples=3, options={}), [1], is_closed=False)
        for path in (tmp_path / "other").rglob("*01*"):
            target = job.root / path.relative_to(tmp_path / "other")
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
        other.release(1)
        run.join(timeout=30)
        assert made == [2]
        assert warned == [
            f"waiting for process {os.getpid()} on {platform.node()}, which is making sample 1; 1 sample left"
        ]


def test_a_sample_whose_run_was_stopped_is_made_here(tmp_path: Path) -> None:
    job = job_of(tmp_path / "out", 3)
    Store(job.root, job.plan).open({})
    other = Claims(job.root, "test")
    assert other.take(1)
    threading.Timer(0.5, other.release, [1]).start()
    assert collect(job) == 3


class Retry:
    """A fresh process that makes sample 0 through another run, and then ends as it is given."""

    def __init__(self, job: Any, error: Exception | None, *, is_made: bool) -> None:
        self.job, self.error, self.is_made, self.runs = job, error, is_made, 0

    def run(self, work: Any, indices: Sequence[int], report: Report) -> None:
        self.runs += 1
        if self.is_made:
            fill(self.job.root, self.job.plan, [0], is_closed=False)
            report(Outcome(index=0))
        if self.error is not None:
            raise self.error
        report(Outcome(index=0, kind="failed", error="again"))


def fails(job: Any, indices: Iterator[int], report: Report) -> None:
    for index in indices:
        report(Outcome(index=index, kind="failed", error="first"))


@pytest.mark.parametrize("is_made", [False, True])
@pytest.mark.parametrize("error", [DatasetError("out", "the disk is full"), WorkerInterruptedError("raster", "a", "b")])
def test_an_error_that_ends_a_run_ends_the_second_tries(
    error: GearError, is_made: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = job_of(tmp_path / "out", 1)
    retry = Retry(job, error, is_made=is_made)
    monkeypatch.setattr(module, "make_samples", fails)
    monkeypatch.setattr(module, "Processes", lambda **_: retry)
    with pytest.raises(type(error), match=str(error)):
        collect(job)
    assert retry.runs == 1


def test_a_worker_that_dies_after_its_sample_is_made_has_made_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = job_of(tmp_path / "out", 1)
    retry = Retry(job, BackendError("raster", "a worker died", "again"), is_made=True)
    monkeypatch.setattr(module, "make_samples", fails)
    monkeypatch.setattr(module, "Processes", lambda **_: retry)
    assert collect(job) == 1 and retry.runs == 1


def test_a_sample_that_another_run_makes_after_it_failed_here_is_no_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = job_of(tmp_path / "out", 1)

    class Other:
        def run(self, work: Any, indices: Sequence[int], report: Report) -> None:
            report(Outcome(index=0, kind="failed", error="again"))
            fill(job.root, job.plan, [0], is_closed=False)

    monkeypatch.setattr(module, "make_samples", fails)
    monkeypatch.setattr(module, "Processes", lambda **_: Other())
    assert collect(job) == 0
    assert not (tmp_path / "out/gear/test/failed").exists()


class Elsewhere:
    """An engine whose workers see another folder of the same name: all is made there, and nothing here."""

    def __init__(self) -> None:
        self.rounds = 0

    def run(self, work: Any, indices: Sequence[int], report: Report) -> None:
        self.rounds += 1
        for index in indices:
            report(Outcome(index=index, kind="made" if self.rounds == 1 else "elsewhere"))


def test_samples_that_never_appear_here_end_the_run(tmp_path: Path) -> None:
    engine = Elsewhere()
    with pytest.raises(DatasetError, match=r"do not appear there; .*--out that all of them share"):
        collect(job_of(tmp_path / "out", 3), engine)
    assert engine.rounds == module.MOST_IDLE


def test_a_root_that_is_deleted_during_the_run_ends_it(tmp_path: Path) -> None:
    class Deletes:
        def run(self, work: Any, indices: Sequence[int], report: Report) -> None:
            shutil.rmtree(tmp_path / "out")
            for index in indices:
                report(Outcome(index=index, kind="elsewhere"))

    with pytest.raises(DatasetError, match="out: is not there on this machine"):
        collect(job_of(tmp_path / "out", 3), Deletes())
    assert not (tmp_path / "out").exists()


def made_by(said: str) -> int:
    """The number of samples that a run has made, by its last line."""
    kept = re.search(r"\((\d+) were there already\)", said)
    total = re.search(r"(\d+) samples? in split", said)
    assert total
    return int(total[1]) - (int(kept[1]) if kept else 0)


@pytest.mark.slow
def test_two_runs_of_one_split_share_its_work(tmp_path: Path) -> None:
    samples = 60
    given = [*command(tmp_path / "out", "--samples", str(samples))]
    runs = [subprocess.Popen(given, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    said = [run.communicate()[0] for run in runs]
    assert [run.returncode for run in runs] == [0, 0]
    made = [made_by(one) for one in said]
    assert min(made) > 0 and samples <= sum(made) <= 1.05 * samples
    subprocess.run(command(tmp_path / "straight", "--samples", str(samples)), check=True, capture_output=True)
    assert tree(tmp_path / "out") == tree(tmp_path / "straight")
