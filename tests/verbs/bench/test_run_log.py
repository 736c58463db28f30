"""`gear bench --log-to`: the results in the log, and the attacks that log in the folders of their patches."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gear.contracts.loggers import LoggedRun
from gear.formats.png import encode_rgb
from gear.measuring.run_log import RunLog, choose_logger
from gear.values.errors import GearError
from gear.values.progress import Callbacks
from gear.verbs.bench.plan import Step
from gear.verbs.bench.request import BenchRequest
from gear.verbs.bench.run_log import log_report, with_log
from gear.verbs.bench.times import run_times
from tests.plugins.loggers.reading import read_log
from tests.verbs.bench.synthetic import report

pytest.importorskip("tensorboard")


def test_attacks_are_logged_and_nothing_else_changes() -> None:
    steps = [Step(verb=verb, title=verb, arguments={"out": verb}) for verb in ("collect", "attack", "evaluate")]  # type: ignore[arg-type]
    assert with_log(steps, BenchRequest(config="quick", out="out")) == steps
    request = BenchRequest(config="quick", out="out", log_to="tensorboard", log_settings=("flush_s=1",))
    collected, attacked, evaluated = with_log(steps, request)
    assert (collected, evaluated) == (steps[0], steps[2])
    assert attacked.arguments == {"out": "attack", "log_to": "tensorboard", "log_settings": ("flush_s=1",)}
    assert steps[1].arguments == {"out": "attack"}


def logged(folder: Path) -> Any:
    warnings: list[str] = []
    run = LoggedRun(verb="bench", title="quick", folder=folder / "log")
    log_report(RunLog(choose_logger("tensorboard", ()), run, warnings.append), report())
    assert not warnings
    return read_log(folder / "log")


def test_every_metric_of_the_tables_is_in_the_log(tmp_path: Path) -> None:
    found = logged(tmp_path)
    values = {name: points[0][1] for name, points in found.scalars.items()}
    (task,) = report().tasks
    pools = [(one, pool) for one in task.results for pool in one.evaluation.pools]
    assert len(values) == len(pools)
    for one, pool in pools:
        network = " + ".join(filter(None, (one.model, one.defense)))
        expected = task.value(pool)
        assert expected is not None
        assert values[f"semseg miou (up is better)/{network}/{pool.name}"] == pytest.approx(expected.value, abs=1e-5)
    assert "semseg: miou (higher is better)" in found.texts["tables"]


def test_a_bench_that_measures_times_has_nothing_to_log(tmp_path: Path) -> None:
    with pytest.raises(GearError, match="times: measures times, and has nothing to log; leave --log-to out"):
        run_times(BenchRequest(config="times", out=tmp_path / "out", log_to="tensorboard"), Callbacks())
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("harm", ["huge", "link", "cut", "pipe"])
def test_a_sheet_of_a_stranger_costs_the_figures_and_nothing_else(tmp_path: Path, harm: str) -> None:
    """A picture of 60,000 x 60,000 pixels, a link that leads outside, a file that is cut off, a pipe without an end."""
    root = tmp_path / "evaluation"
    root.mkdir()
    sheet = root / "sheet.png"
    whole = encode_rgb(np.zeros((8, 8, 3), np.uint8))
    if harm == "link":
        (tmp_path / "private.png").write_bytes(whole)
        sheet.symlink_to("../private.png")
    elif harm == "pipe":
        os.mkfifo(sheet)
    else:
        sheet.write_bytes(whole[:20] if harm == "cut" else whole[:16] + b"\x00\x00\xea\x60" * 2 + whole[24:])
    made = report()
    one = made.tasks[0].results[0].evaluation
    evaluation = replace(one, out=root, rows=(replace(one.rows[0], pictures="sheet.png"), *one.rows[1:]))
    results = (replace(made.tasks[0].results[0], evaluation=evaluation), *made.tasks[0].results[1:])
    made = replace(made, tasks=(replace(made.tasks[0], results=results),))
    warnings: list[str] = []
    run = LoggedRun(verb="bench", title="quick", folder=tmp_path / "log")
    log_report(RunLog(choose_logger("tensorboard", ()), run, warnings.append), made)
    (warning,) = warnings
    assert "the log has no figures" in warning and "\n" not in warning
    assert "semseg: miou" in read_log(tmp_path / "log").texts["tables"]
