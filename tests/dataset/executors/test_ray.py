"""The engine `ray` with a cluster of several nodes on this machine, of which some are killed."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from gear.contracts.executors import Executor, Outcome, Report
from gear.dataset.executors import threads
from gear.dataset.executors.jobs import JobNotes, carry_out_jobs, run_jobs
from gear.dataset.executors.ray import OnRay
from gear.testing.executor_contract import ExecutorContract
from gear.values.errors import GearError
from tests.dataset.executors.test_processes import tell_threads

ray = pytest.importorskip("ray")
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]


def make_slowly(folder: str, indices: Iterator[int], report: Report) -> None:
    for index in indices:
        time.sleep(0.3)
        (Path(folder) / str(index)).write_text("made")
        report(Outcome(index=index))


def jobs_of(folder: str, indices: Iterator[int], report: Report) -> None:
    def call(index: int) -> int:
        with (Path(folder) / str(index)).open("a") as file:
            file.write("tried")
        if index == 2:
            raise ValueError("broken")
        return 10 * index

    carry_out_jobs(call, indices, report)


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    from ray.cluster_utils import Cluster

    made = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    ray.init(address=made.address, log_to_driver=False, logging_level="ERROR")
    yield made
    ray.shutdown()
    made.shutdown()


@pytest.mark.usefixtures("cluster")
class TestRay(ExecutorContract):
    @pytest.fixture
    def executor(self) -> Executor:
        return OnRay(workers=2)


def test_nodes_that_are_killed_cost_no_item(cluster: Any, tmp_path: Path) -> None:
    nodes = [cluster.add_node(num_cpus=1) for _ in range(2)]
    reported: list[Outcome] = []

    def kill() -> None:
        while len(list(tmp_path.iterdir())) < 3:
            time.sleep(0.05)
        for node in nodes:
            cluster.remove_node(node, allow_graceful=False)

    killer = threading.Thread(target=kill)
    killer.start()
    OnRay(workers=3).run(partial(make_slowly, str(tmp_path)), range(24), reported.append)
    killer.join()
    assert {outcome.index for outcome in reported if outcome.kind == "made"} == set(range(24))
    assert len(list(tmp_path.iterdir())) == 24


@pytest.mark.usefixtures("cluster")
def test_parts_share_the_cores(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in threads.THREADS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(threads, "cores", lambda: 8)
    OnRay(workers=2).run(partial(tell_threads, str(tmp_path)), [0], lambda outcome: None)
    assert (tmp_path / "0").read_text() == "4,4,4,4"


@pytest.mark.usefixtures("cluster")
def test_jobs_bring_their_results_and_an_unexpected_error_costs_no_other(tmp_path: Path) -> None:
    found: dict[int, object] = {}
    failed = run_jobs(
        OnRay(workers=2),
        partial(jobs_of, str(tmp_path)),
        range(4),
        lambda outcome: found.update({outcome.index: outcome.value}),
        notes=JobNotes(root=tmp_path, names=["a", "b", "c", "d"]),
    )
    assert found == {0: 0, 1: 10, 2: None, 3: 30}
    assert list(failed) == [2] and failed[2].error == "ValueError: broken"
    assert (tmp_path / "2").read_text() == "tried" * 3
    assert (tmp_path / "failures/2.json").is_file()


def test_an_address_without_a_cluster_is_one_line() -> None:
    ray.shutdown()
    with pytest.raises(GearError, match=r"--address 127\.0\.0\.1:1: no Ray cluster can be joined there") as caught:
        OnRay(workers=1, address="127.0.0.1:1").run(partial(make_slowly, ""), [0], lambda outcome: None)
    assert "\n" not in str(caught.value)
