"""Times of collections; the collections themselves are replaced by a clock."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gear.values.errors import ConfigError, DatasetError, GearError
from gear.values.progress import Callbacks
from gear.verbs.bench import times
from gear.verbs.bench.request import BenchRequest
from gear.verbs.bench.times import measures_times, run_times, times_of

CONFIG = "times: {tasks: [semseg, depth], town: town10, scene: billboard02, samples: 4, seeds: 2}\n"


class Clock:
    """A clock that a collection advances; the first sample of each collection takes long."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.runs: list[str] = []

    def perf_counter(self) -> float:
        return self.now_s

    def collect(self, *, task: str, samples: int, on_progress: Callable[[int, int], None], **more: Any) -> None:
        self.runs.append(f"{task} {more['seed']}")
        assert more["force"] and more["settings"] == ()
        on_progress(0, samples)
        for done in range(1, samples + 1):
            self.now_s += 60.0 if done == 1 else {"semseg": 2.0, "depth": 1.0}[task] + 0.5 * more["seed"]
            on_progress(done, samples)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(times.time, "perf_counter", clock.perf_counter)
    return clock


def request(tmp_path: Path, text: str = CONFIG, **more: Any) -> BenchRequest:
    (tmp_path / "t.yml").write_text(text)
    return BenchRequest(config=tmp_path / "t.yml", out=tmp_path / "out", **more)


def test_mean_and_deviation_of_each_task(tmp_path: Path, clock: Clock) -> None:
    begun: list[str] = []
    report = run_times(
        request(tmp_path), Callbacks(), lambda step, number, steps: begun.append(f"{number}/{steps}"), clock.collect
    )
    assert clock.runs == ["semseg 0", "semseg 1", "depth 0", "depth 1"] and begun == ["1/4", "2/4", "3/4", "4/4"]
    semseg, depth = report.records()
    assert (semseg["samples"], semseg["mean_s"], depth["mean_s"]) == (6, 2.25, 1.25), "without the first samples"
    assert semseg["std_s"] == pytest.approx(0.2739, abs=1e-3)
    with (tmp_path / "out/times.csv").open() as file:
        assert [line["mean_s"] for line in csv.DictReader(file)] == ["2.25", "1.25"]
    assert b"/CIDFontType2" in (tmp_path / "out/figures/times.pdf").read_bytes()


def test_finished_collections_are_kept(tmp_path: Path, clock: Clock) -> None:
    run_times(request(tmp_path), Callbacks(), run=clock.collect)
    again = run_times(request(tmp_path), Callbacks(), run=clock.collect)
    assert len(clock.runs) == 4 and again.seconds["depth"] == (1.0, 1.0, 1.0, 1.5, 1.5, 1.5)
    with pytest.raises(GearError, match="is the time of another collection"):
        run_times(request(tmp_path, settings=("times.samples=5",)), Callbacks(), run=clock.collect)


@pytest.mark.parametrize("seconds", [None, [], "2.5", ["2.5"], [None], [True], [-1.0], [1e300], {"a": 1}])
def test_a_stored_file_without_seconds_is_one_line(tmp_path: Path, clock: Clock, seconds: Any) -> None:
    run_times(request(tmp_path), Callbacks(), run=clock.collect)
    path = tmp_path / "out/times/depth-seed1.json"
    stored = json.loads(path.read_text())
    path.write_text(json.dumps(stored | {"seconds": seconds}))
    with pytest.raises(DatasetError, match=r"depth-seed1\.json: holds no list of seconds; remove it"):
        run_times(request(tmp_path), Callbacks(), run=clock.collect)
    path.write_text(json.dumps({"arguments": stored["arguments"]}))
    with pytest.raises(DatasetError, match="holds no list of seconds"):
        run_times(request(tmp_path), Callbacks(), run=clock.collect)


def test_the_shipped_config(tmp_path: Path) -> None:
    shipped = BenchRequest(config="times", out=tmp_path)
    assert measures_times(shipped) and not measures_times(BenchRequest(config="quick", out=tmp_path))
    assert (times_of(shipped).samples, times_of(shipped).seeds) == (50, 10)


@pytest.mark.parametrize("change", [("samples: 4", "samples: 1"), ("seeds: 2", "seeds: 0"), ("semseg, depth", "")])
def test_odd_configs_are_refused(tmp_path: Path, change: tuple[str, str]) -> None:
    with pytest.raises(ConfigError, match=r"t\.yml:1:\d+: times"):
        times_of(request(tmp_path, CONFIG.replace(*change)))
