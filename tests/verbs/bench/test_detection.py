"""Detection rates of a bench: the threshold of a scene comes from the clean pictures of the others."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gear.verbs.bench.all_metrics import COLUMNS, metric_records
from gear.verbs.bench.detection import detection_rates
from gear.verbs.bench.report import BenchReport, Result
from gear.verbs.bench.table import columns
from tests.verbs.bench.synthetic import report, result

CLEAN = {0: [0.1, 0.2, 0.3, 0.4], 1: [0.5, 0.6, 0.7, 0.8]}
SCORES = {
    "none": CLEAN,
    "random": {0: [0.75, 0.85, 0.1, 0.1], 1: [0.3, 0.3, 0.3, 0.3]},
    "patch": {0: [0.75, 0.9, 0.95, 0.81], 1: [0.45, 0.35, 0.5, 0.6]},
}


def scored(scenes: tuple[str, str] = ("board_1", "truck"), scores: Any = SCORES) -> Result:
    """The results of the detector, with a score for each picture."""
    one = result("detector")
    rows = []
    for row in one.evaluation.rows:
        place, _, patch = row.name.partition("-")
        found = [{"index": n, "score": score} for n, score in enumerate(scores[patch][int(place)])]
        rows.append(replace(row, facts={"town": "town10", "scene": scenes[int(place)]}, per_sample=found))
    return replace(one, evaluation=replace(one.evaluation, rows=tuple(rows)))


def test_a_threshold_comes_from_the_other_scene() -> None:
    """Scene 0 is judged at 0.8, the largest clean score of scene 1, and scene 1 at 0.4."""
    one = scored()
    low, high = detection_rates(one, one.pool("patch"))
    assert (low.allowed, high.allowed) == (0.01, 0.05)
    assert low.found.value == (3 + 3) / 8, "0.9, 0.95, 0.81 above 0.8; 0.45, 0.5, 0.6 above 0.4"
    assert low.false_alarms.value == 4 / 8, "all clean pictures of scene 1 are above 0.4"
    assert low.found.interval is not None and 0.3 < low.found.interval[0] < 0.75 < low.found.interval[1] < 0.97
    (first, _), (second, _) = (detection_rates(one, one.pool("patch"), place) for place in (0, 1))
    assert first.found.value == 3 / 4 and first.false_alarms.value == 0.0
    assert second.found.value == 3 / 4 and second.false_alarms.value == 1.0


def test_patches_are_tested_against_random_ones() -> None:
    one = scored()
    patch, random = (detection_rates(one, one.pool(name))[0] for name in ("patch", "random"))
    assert random.p is None and random.found.value == 1 / 8
    # Five pictures have one more alarm with the patch, and three have as many.
    assert patch.p == pytest.approx(2 / 2**5)


def test_without_scores_or_other_scenes_there_are_no_rates() -> None:
    assert detection_rates(scored(), scored().pool("none")) == ()
    bare = result("detector")
    assert detection_rates(bare, bare.pool("patch")) == ()
    same = scored(("truck", "truck"))  # two weathers of one scene
    assert detection_rates(same, same.pool("patch")) == ()
    gap = {**SCORES, "patch": {0: [0.9, None, 0.9, 0.9], 1: SCORES["patch"][1]}}
    holes = scored(scores=gap)
    assert detection_rates(holes, holes.pool("patch")) == ()


def test_tables_and_files_have_the_rates() -> None:
    whole = report()
    (task,) = whole.tasks
    results = tuple(scored() if one.defense == "detector" else one for one in task.results)
    seen = BenchReport(out=Path("out"), facts=whole.facts, tasks=(replace(task, results=results),))
    head, *lines = columns(seen.tasks[0])
    at = head.index("TPR at 1 %")
    assert [line[at][:5] for line in lines if line[at]] == ["0.125", "0.750"]
    assert "TPR at 1 %" not in columns(task)[0], "a column without a number is left out"
    found = [one for one in metric_records(seen) if one["quantity"] in ("detection", "false alarms")]
    assert len(found) == 2 * 2 * 2 * 3, "two quantities at two rates for two kinds of patches, in two scenes and in all"
    assert all(set(one) <= set(COLUMNS) for one in found)
    (p,) = {one["p"] for one in found if "p" in one and one["scene"] == "all"}
    assert p == pytest.approx(2 / 2**5)
