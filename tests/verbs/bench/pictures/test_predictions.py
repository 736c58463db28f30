"""Predictions in the report of a bench; tests/verbs/bench/test_page.py looks at those of a real one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from gear.verbs.bench.pictures.predictions import predictions
from tests.verbs.bench.pictures.test_most_changed import with_samples
from tests.verbs.bench.synthetic import SCENES, task


def test_a_folder_that_cannot_be_read_is_a_line_and_no_failure(tmp_path: Path) -> None:
    """The page is written at the end of a bench, so pictures that cannot be drawn must not lose the tables."""
    one = with_samples({"0-none": [0.9, 0.8], "0-patch": [0.1, 0.1]})
    rows = tuple(replace(row, dataset=tmp_path / "<gone>") for row in one.evaluation.rows)
    gone = replace(one, model="net<1>", evaluation=replace(one.evaluation, rows=rows, out=tmp_path))
    (text,) = predictions(replace(task(), results=(gone,)), SCENES)
    assert "Predictions of net&lt;1&gt;" in text and "no pictures: " in text and "<gone>" not in text
    assert "(failed attack)" not in text


def test_a_failed_attack_is_marked(tmp_path: Path) -> None:
    one = with_samples({"0-none": [0.9, 0.8], "0-patch": [0.1, 0.1]})
    failed = task(p=0.5)
    rows = tuple(replace(row, dataset=tmp_path / "gone") for row in one.evaluation.rows)
    pools = failed.results[0].evaluation.pools
    gone = replace(one, evaluation=replace(one.evaluation, rows=rows, pools=pools, out=tmp_path))
    (text,) = predictions(replace(failed, results=(gone,)), SCENES)
    assert "(failed attack)" in text
