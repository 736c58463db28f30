"""Batches of one network side by side: the same answers, whoever works on them, and errors that stop the run."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import torch

from gear.measuring import guarded_model, scoring
from gear.measuring.parallel_batches import MOST, lanes, lanes_of
from gear.networks.network import Network
from gear.verbs.evaluate.run import evaluate
from tests.verbs.conftest import Collected

NAME, SETTINGS = "ddrnet23_slim_depth", ("weights=none", "seed=3")


@pytest.fixture(autouse=True)
def _threads() -> Iterator[None]:
    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)


@pytest.fixture
def pictures(collected: Collected) -> Path:
    return collected("depth", "none", samples=5)


@pytest.fixture
def sizes(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many samples went through a network together, each time."""
    predict, seen = Network.predict_many, list[int]()

    def watched(network: Any, samples: Any) -> Any:
        seen.append(len(samples))
        return predict(network, samples)

    monkeypatch.setattr(Network, "predict_many", watched)
    return seen


def files(out: Path) -> dict[str, bytes]:
    return {str(path.relative_to(out)): path.read_bytes() for path in sorted(out.rglob("predictions/**/*.png"))}


@pytest.mark.parametrize("batch", [1, 2])
def test_one_lane_and_three_give_the_same_bytes(
    tmp_path: Path, pictures: Path, monkeypatch: pytest.MonkeyPatch, batch: int
) -> None:
    made: dict[int, dict[str, bytes]] = {}
    predict, met = Network.predict_many, threading.Event()
    inside: list[int] = []

    def watched(network: Any, samples: Any) -> Any:
        assert torch.get_num_threads() == 1
        inside.append(1)
        if len(inside) > 1:
            met.set()
        assert count == 1 or met.wait(60), "nobody else worked beside the first"
        answers = predict(network, samples)
        inside.pop()
        return answers

    monkeypatch.setattr(Network, "predict_many", watched)
    for count in (1, 3):
        torch.set_num_threads(count)
        out = tmp_path / str(count)
        evaluate(pictures, model=NAME, model_settings=SETTINGS, out=out, batch=batch)
        made[count] = files(out)
        assert torch.get_num_threads() == count
        assert met.is_set() == (count > 1)
    assert len(made[1]) == 5 and made[1] == made[3]


def test_a_network_that_fails_stops_the_run_and_it_is_taken_up_again(
    tmp_path: Path, pictures: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    torch.set_num_threads(2)
    predict, shown = Network.predict_many, 0

    def failing(network: Any, samples: Any) -> Any:
        nonlocal shown
        shown += 1
        if shown == 3:
            raise RuntimeError("out of luck")
        return predict(network, samples)

    with monkeypatch.context() as patched:
        patched.setattr(Network, "predict_many", failing)
        with pytest.raises(RuntimeError, match="out of luck"):  # our own networks keep their traceback
            evaluate(pictures, model=NAME, model_settings=SETTINGS, out=tmp_path, batch=1)
    assert torch.get_num_threads() == 2
    (row,) = evaluate(pictures, model=NAME, model_settings=SETTINGS, out=tmp_path, batch=1).rows
    assert row.samples == 5 and 1 <= row.made < 5
    assert len(files(tmp_path)) == 5


def test_a_slow_disk_does_not_slow_the_network(tmp_path: Path, pictures: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the first sample's files wait for is that every lane has answered twice."""
    torch.set_num_threads(2)
    predict, write, answered = Network.predict_many, scoring.write_whole, threading.Semaphore(0)

    def watched(network: Any, samples: Any) -> Any:
        answers = predict(network, samples)
        answered.release()
        return answers

    def slow(*arguments: Any) -> None:
        with first:
            if not enough.is_set():
                assert all(answered.acquire(timeout=60) for _ in range(4)), "the network waits for the disk"
                enough.set()
        write(*arguments)

    first, enough = threading.Lock(), threading.Event()
    monkeypatch.setattr(Network, "predict_many", watched)
    monkeypatch.setattr(scoring, "write_whole", slow)
    (row,) = evaluate(pictures, model=NAME, model_settings=SETTINGS, out=tmp_path, batch=1).rows
    assert row.made == 5 and len(files(tmp_path)) == 5


def test_what_is_predicted_is_written_though_the_run_fails(
    tmp_path: Path, pictures: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    torch.set_num_threads(2)
    predict, write, failed = Network.predict_many, scoring.write_whole, threading.Event()
    shown = list[int]()

    def failing(network: Any, samples: Any) -> Any:
        shown.append(1)
        if len(shown) == 4:
            failed.set()
            raise RuntimeError("out of luck")
        return predict(network, samples)

    def late(*arguments: Any) -> None:
        assert failed.wait(60)
        write(*arguments)

    with monkeypatch.context() as patched:
        patched.setattr(Network, "predict_many", failing)
        patched.setattr(scoring, "write_whole", late)
        with pytest.raises(RuntimeError, match="out of luck"):
            evaluate(pictures, model=NAME, model_settings=SETTINGS, out=tmp_path, batch=1)
    assert len(files(tmp_path)) >= 3


@pytest.mark.parametrize("threads", [1, 2])
def test_batches_are_the_same_samples_after_an_interruption(
    tmp_path: Path, pictures: Path, sizes: list[int], threads: int
) -> None:
    """Networks round a batch otherwise than one sample: what is finished goes through again beside what is not."""
    torch.set_num_threads(threads)
    evaluate(pictures, model=NAME, model_settings=SETTINGS, out=tmp_path / "whole", batch=2)
    assert sorted(sizes) == [1, 2, 2]
    sizes.clear()
    out = tmp_path / "again"
    evaluate(pictures, model=NAME, model_settings=SETTINGS, out=out, batch=2)
    before = files(out)
    for note in out.rglob("samples/00000[03].json"):
        note.unlink()
    for name in before:
        if name.endswith(("0.png", "3.png")):
            (out / name).unlink()
    sizes.clear()
    (row,) = evaluate(pictures, model=NAME, model_settings=SETTINGS, out=out, batch=2).rows
    assert row.made == 2 and sizes == [2, 2]
    assert files(out) == before == files(tmp_path / "whole")


def test_what_is_left_runs_on_as_many_threads_as_the_whole(
    tmp_path: Path, pictures: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Networks round otherwise on several threads than on one."""
    torch.set_num_threads(2)
    evaluate(pictures, model=NAME, model_settings=SETTINGS, out=tmp_path, batch=1)
    next(tmp_path.rglob("samples/000003.json")).unlink()
    predict, seen = Network.predict_many, list[int]()

    def watched(network: Any, samples: Any) -> Any:
        seen.append(torch.get_num_threads())
        return predict(network, samples)

    monkeypatch.setattr(Network, "predict_many", watched)
    evaluate(pictures, model=NAME, model_settings=SETTINGS, out=tmp_path, batch=1)
    assert seen == [1]


def test_small_pictures_share_a_batch_by_default(
    tmp_path: Path, pictures: Path, monkeypatch: pytest.MonkeyPatch, sizes: list[int]
) -> None:
    torch.set_num_threads(1)
    evaluate(pictures, model=NAME, model_settings=SETTINGS, out=tmp_path / "usual")
    assert sizes == [guarded_model.MOST_TOGETHER, 1]
    monkeypatch.setattr(guarded_model, "SMALL_PX", 1)
    sizes.clear()
    evaluate(pictures, model=NAME, model_settings=SETTINGS, out=tmp_path / "large")
    assert sizes == [1] * 5
    sizes.clear()
    evaluate(pictures, model=NAME, model_settings=SETTINGS, out=tmp_path / "defended", defense="jpeg")
    assert sizes == [1] * 5


class Still(Network):
    def __init__(self) -> None:
        torch.nn.Module.__init__(self)
        self.device = torch.device("cpu")

    def run(self, pictures: Any) -> Any: ...
    def losses(self, outputs: Any, targets: Any) -> Any: ...
    def predictions(self, outputs: Any, size_px: Any) -> Any: ...


def test_only_a_network_on_a_cpu_has_lanes() -> None:
    network = Still()
    for threads, count in ((1, 1), (2, 2), (MOST + 3, MOST)):
        torch.set_num_threads(threads)
        assert lanes_of(network) == count
    network.device = torch.device("cuda")
    assert lanes_of(network) == 1
    assert lanes_of(object()) == 1


def test_one_batch_gets_every_thread_and_says_its_whole_time(
    tmp_path: Path, pictures: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    torch.set_num_threads(3)
    predict, now = Network.predict_many, 0.0

    def slow(network: Any, samples: Any) -> Any:
        nonlocal now
        assert torch.get_num_threads() == 3
        now += 1.0
        return predict(network, samples)

    monkeypatch.setattr(Network, "predict_many", slow)
    monkeypatch.setattr(guarded_model, "time", SimpleNamespace(perf_counter=lambda: now))
    report = evaluate(pictures, model=NAME, model_settings=SETTINGS, out=tmp_path, batch=5)
    assert report.rows[0].cost["model_s"] * 5 == pytest.approx(1.0)


@pytest.mark.parametrize("last", [2, 5])
def test_what_progress_raises_stops_the_run(tmp_path: Path, pictures: Path, last: int) -> None:
    def progress(finished: int, total: int) -> None:
        if finished == last:
            raise LookupError("the screen is gone")

    for threads in (1, 2):
        torch.set_num_threads(threads)
        with pytest.raises(LookupError, match="the screen is gone"):
            out = tmp_path / str(threads)
            evaluate(pictures, model=NAME, model_settings=SETTINGS, out=out, on_progress=progress)


def test_lanes_share_the_threads_and_print_nothing_on_stdout(capsys: pytest.CaptureFixture[str]) -> None:
    torch.set_num_threads(4)
    with lanes(2) as submit:
        assert submit(torch.get_num_threads).result() == 2
        submit(print, "aside").result()
    assert torch.get_num_threads() == 4
    assert capsys.readouterr() == ("", "aside\n")
    meet = threading.Barrier(3)

    def share() -> int:
        meet.wait(60)
        return torch.get_num_threads()

    with lanes(3) as submit:
        assert sorted(future.result() for future in [submit(share) for _ in range(3)]) == [1, 1, 2]
