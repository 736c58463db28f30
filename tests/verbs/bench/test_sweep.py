"""Sweeps: one benchmark for each value of a key, and a figure."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import gear
from gear.cli.main import main
from gear.config.load import find_config
from gear.values.errors import ConfigError, GearError
from gear.values.progress import Callbacks
from gear.verbs.bench.report import BenchReport
from gear.verbs.bench.request import BenchRequest
from gear.verbs.bench.run import prepared
from gear.verbs.bench.sweep import requests_of, run_sweep, sweep_of
from tests.verbs.bench.conftest import FEW
from tests.verbs.bench.synthetic import report


def swept(written: Callable[..., Path], text: str) -> Path:
    path = written(*FEW)
    path.write_text(path.read_text() + f"sweep: {text}\n")
    return path


@pytest.mark.usefixtures("plugins")
def test_one_benchmark_for_each_value_and_seed(tmp_path: Path, written: Callable[..., Path]) -> None:
    config = swept(written, '{key: samples.attack, values: ["2", "4"], seeds: 2, title: pictures}')
    ran: list[BenchRequest] = []

    def run(request: BenchRequest, *_: Any) -> BenchReport:
        ran.append(request)
        one = report()
        plan = prepared(request)
        assert plan.config.sweep is None
        (task,) = one.tasks
        scale = plan.config.samples.attack + plan.config.seed
        results = tuple(
            replace(each, evaluation=replace(each.evaluation, pools=tuple(
                replace(pool, metrics={"task": {"miou": replace(pool.metrics["task"]["miou"], value=float(scale))}})
                for pool in each.evaluation.pools
            )))
            for each in task.results
        )  # fmt: skip
        return replace(one, tasks=(replace(task, results=results),))

    out = tmp_path / "out"
    found = run_sweep(BenchRequest(config=config, out=out), Callbacks(), run=run)
    assert [Path(one.out).name for one in ran] == ["00-seed0", "00-seed1", "01-seed0", "01-seed1"]
    points = {(one.defense, one.patch, one.value): one for one in found.points}
    first = points["", "patch", "2"]
    assert first.metrics == (2.0, 3.0) and first.mean == 2.5 and first.std == pytest.approx(0.5**0.5)
    assert points["", "patch", "4"].mean == 4.5
    with (out / "sweep.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == len(found.points) and lines[0]["mean"] == "2.5"
    assert json.loads((out / "sweep.json").read_text())["values"] == ["2", "4"]
    pdf = (out / "figures/semseg.pdf").read_bytes()
    assert b"/Type3" not in pdf and b"/CIDFontType2" in pdf
    run_sweep(BenchRequest(config=config, out=out), Callbacks(), run=run)
    assert (out / "figures/semseg.pdf").read_bytes() == pdf


@pytest.mark.usefixtures("plugins")
def test_the_command_lists_the_steps_of_all(
    tmp_path: Path, written: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    config = swept(written, '{key: weathers, values: ["[ClearNoon]", "[ClearSunset]"]}')
    assert main(["bench", str(config), "--out", str(tmp_path / "out"), "--list"]) == 0
    listed = capsys.readouterr().out.splitlines()
    assert sum("weather=ClearNoon" in line for line in listed) == sum("weather=ClearSunset" in line for line in listed)
    assert any("runs/01-seed0" in line for line in listed)
    with pytest.raises(GearError, match=r"sweeps weathers; gear\.sweep runs it"):
        gear.bench(config, out=tmp_path / "out")


@pytest.mark.usefixtures("plugins")
@pytest.mark.parametrize(
    "text", ["{key: seed, values: ['1']}", "{key: samples.attack, values: []}", "{key: x, values: ['1'], seeds: 0}"]
)
def test_odd_sweeps_are_refused_with_their_line(written: Callable[..., Path], text: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"bench\.yml:\d+:\d+: sweep"):
        gear.sweep(swept(written, text), out=tmp_path / "out")


@pytest.mark.usefixtures("plugins")
def test_a_config_without_a_sweep_is_refused(written: Callable[..., Path], tmp_path: Path) -> None:
    with pytest.raises(GearError, match=r"has no key `sweep`"):
        gear.sweep(written(*FEW), out=tmp_path / "out")


@pytest.mark.parametrize("name", ["ablation-samples", "ablation-weather"])
def test_shipped_sweeps_can_be_read(name: str, tmp_path: Path) -> None:
    request = BenchRequest(config=name, out=tmp_path)
    chosen, seed = sweep_of(request)
    assert find_config("bench", name).is_file() and chosen is not None and len(chosen.values) == 5
    for _, one in requests_of(request, chosen, seed):
        assert list(prepared(one).steps())
