"""`gear bench`: the whole way in a tiny town, with tiny networks."""

from __future__ import annotations

import csv
import json
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import gear
from gear.cli.main import main
from gear.values.errors import GearError, ReplaceableError
from gear.verbs.bench.carry_out import VERBS
from gear.verbs.bench.plan import Step
from gear.verbs.bench.report import BenchReport
from tests.plugins.loggers.reading import read_log
from tests.verbs.bench.conftest import FEW, callbacks

pytestmark = pytest.mark.usefixtures("plugins")

KINDS = ["none", "random", "patch"]


class Looks:
    """Remembers what it is told."""

    def __init__(self) -> None:
        self.steps: list[str] = []
        self.lessons = self.done = 0

    def on_step(self, step: Step, number: int, steps: int) -> None:
        self.steps.append(f"{number}/{steps} {step.verb}")

    def on_progress(self, done: int, total: int) -> None:
        self.done += 1

    def on_fit_progress(self, done: int, total: int) -> None:
        self.lessons += 1

    def on_warning(self, line: str) -> None:
        raise AssertionError(line)


def test_the_whole_way_and_again(tmp_path: Path, written: Callable[..., Path]) -> None:
    config, out, looks = written(), tmp_path / "out", Looks()
    report = gear.bench(config, out=out, log_to="tensorboard", **callbacks(looks))
    assert looks.steps[0] == "1/45 collect" and looks.steps[-1] == "45/45 evaluate"
    assert looks.lessons and looks.done
    (task,) = report.tasks
    assert [(one.model, one.defense) for one in task.results] == [
        (model, defense) for model in ("small", "second") for defense in (None, "blur", "fpda")
    ]
    small, blurred, unusual = task.results[:3]
    assert [pool.name for pool in small.evaluation.pools] == [*KINDS, "patch of second"]
    assert [pool.name for pool in blurred.evaluation.pools] == [*KINDS, "adaptive patch"]
    assert [pool.name for pool in unusual.evaluation.pools] == [*KINDS, "adaptive patch"]
    assert all(pool.samples == 4 for one in task.results for pool in one.evaluation.pools)
    _check_metrics(report)
    _check_files(out, report)
    logs = list((out / "patches").rglob("log/events.*"))
    assert len(logs) == len(list((out / "patches").rglob("attack.json"))) > 0
    assert len(read_log(out / "log").pictures) == sum(len(one.evaluation.rows) for one in task.results)

    before = {path: path.stat().st_mtime_ns for path in out.rglob("*.png")}
    texts = [(out / name).read_bytes() for name in ("bench.json", "table.txt", "report.html", "figures/semseg.pdf")]
    again = gear.bench(config, out=out)
    assert all(row.made == 0 for one in again.tasks[0].results for row in one.evaluation.rows)
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*.png")} == before
    assert [(out / n).read_bytes() for n in ("bench.json", "table.txt", "report.html", "figures/semseg.pdf")] == texts


def _check_metrics(report: BenchReport) -> None:
    """A pool is its scenes' samples as one data set, and its difference that of the metrics."""
    (task,) = report.tasks
    for one in task.results:
        for pool in one.evaluation.pools:
            rows = [row for row in one.evaluation.rows if row.name in pool.rows]
            assert len(rows) == 2 and sum(row.samples for row in rows) == pool.samples
            value, against = task.value(pool), one.against(pool)
            assert value is not None
            alone = [at.value.value for at in one.scenes if at.patch == pool.name]
            assert [row.metrics["task"]["miou"].value for row in rows] == alone
            if pool.name == "none":
                assert against is None
                continue
            assert against is not None and against.against == ("none" if pool.name == "random" else "random")
            control, change = task.value(one.pool(against.against)), task.effect(against)
            assert control is not None and change is not None
            assert change.value == pytest.approx(value.value - control.value)
            found = task.outside_patch(against)
            assert found is not None and found[0] == "outside_patch.miou" and found[1].pairs == 4
            assert (against.auroc is not None) == (one.defense == "fpda")


def _check_files(out: Path, report: BenchReport) -> None:
    assert sorted(path.name for path in out.iterdir()) == [
        "bench.csv", "bench.json", "bench.yml", "data", "evaluations", "figures", "log", "metrics.csv", "metrics.json",
        "patches", "report.html", "table.txt", "tables",
    ]  # fmt: skip
    written: Any = json.loads((out / "bench.json").read_text())
    assert written == json.loads(json.dumps(report.as_json()))
    cell = written["tasks"]["semseg"]["results"][1]
    assert (out / cell["evaluation"] / "results.json").is_file()
    assert cell["patches"]["adaptive patch"]["against"] == "random"
    with (out / "bench.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == sum(3 * len(one.evaluation.pools) for one in report.tasks[0].results)
    assert {line["scene"] for line in lines} == {"all", "tiny-board", "tiny-double"}
    assert (out / "table.txt").read_text().startswith("semseg: miou (higher is better)\n")
    page = (out / "report.html").read_text()
    against = "against the network without a defense and without a patch"
    assert all(against in shown for shown in (page, (out / "table.txt").read_text()))
    assert "other pictures of a scene in each weather" in page, "a patch is made on those of all weathers together"
    patched = 2 * 3  # against two networks, alone and behind each of two defenses
    predicted = 2 * 2 * (5 + 2 + 2 + 1 + 1)  # two networks, two pictures: alone, behind blur and fpda (twice)
    scenes = (1 + patched * (1 + 1)) + (1 + patched * (1 + 2))  # of one and two surfaces
    assert page.count("<figure>") == scenes + predicted + 1, "and one legend"
    assert "http" not in page.replace("http-equiv", "")


def test_a_config_that_grows_keeps_what_is_there(written: Callable[..., Path], made: Callable[..., Path]) -> None:
    out = made(FEW)
    more = gear.bench(written(*FEW[1:]), out=out)
    made = {one.model: sum(row.made for row in one.evaluation.rows) for one in more.tasks[0].results}
    assert made == {"small": 0, "second": 6}


def test_the_command(tmp_path: Path, written: Callable[..., Path], capsys: pytest.CaptureFixture[str]) -> None:
    config, out = str(written(*FEW)), str(tmp_path / "a place")
    assert main(["bench", config, "--out", out, "--list"]) == 0
    listed = capsys.readouterr().out.splitlines()
    assert not Path(out).exists()
    for line in listed:  # what is listed, the commands take
        words = shlex.split(line)
        assert words[0] == "gear" and main(words[1:]) == 0, line
    capsys.readouterr()
    assert main(["bench", config, "--out", out, "--json"]) == 0
    told = capsys.readouterr()
    assert json.loads(told.out)["format"] == "gear-bench" and told.out.endswith("}\n")
    begun = {line.partition("]")[0] for line in told.err.splitlines() if line.startswith("gear bench: [")}
    assert len(begun) == len(listed), "without a terminal there is a line for each step"
    report = gear.bench(config, out=out)
    assert all(row.made == 0 for one in report.tasks[0].results for row in one.evaluation.rows)
    assert main(["bench", config, "--out", out, "--list", "--json"]) == 0
    steps = json.loads(capsys.readouterr().out)
    assert [step["verb"] for step in steps] == [line.split()[1] for line in listed]


def test_the_command_collects_in_processes_of_their_own(
    tmp_path: Path, written: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A day of collections in one process would fill the memory."""
    told: list[bool] = []

    def collected(**arguments: Any) -> None:
        told.append(arguments["in_subprocess"])
        raise GearError("far enough")

    monkeypatch.setitem(VERBS, "collect", collected)
    assert main(["bench", str(written(*FEW)), "--out", str(tmp_path / "out")]) == 2
    with pytest.raises(GearError, match="far enough"):
        gear.bench(written(*FEW), out=tmp_path / "out")
    assert told == [True, False]


def test_a_step_that_fails_says_which(tmp_path: Path, written: Callable[..., Path]) -> None:
    out = tmp_path / "out"
    config = written(*FEW, ("attack: 2", "attack: 1"))
    other = out / "data/semseg/tiny-board/ClearNoon/attack/gear/train/plan.json"
    other.parent.mkdir(parents=True)
    other.write_text("{}")
    with pytest.raises(GearError, match=r"collect semseg in tiny-board ClearNoon to attack.*plan\.json") as caught:
        gear.bench(config, out=out)
    assert str(caught.value).endswith("; use another --out, or remove it") and "--force" not in str(caught.value)
    assert not (out / "bench.json").exists()


def test_existing_files_are_an_error_without_advice_to_use_force(
    tmp_path: Path, written: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    def in_the_way(**arguments: Any) -> None:
        raise ReplaceableError(arguments["out"], "split 'train' was made with another configuration (seed: 1 there)")

    monkeypatch.setitem(VERBS, "collect", in_the_way)
    with pytest.raises(
        GearError, match=r"attack: .*/attack: split .*\(seed: 1 there\); use another --out, or remove it$"
    ):
        gear.bench(written(*FEW), out=tmp_path / "out")
