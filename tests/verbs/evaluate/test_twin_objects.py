"""Objects and false alarms of a dataset against its twin: counts, intervals, tests, and what an evaluation shows."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binomtest

import gear
from gear.formats.coco import Detection
from gear.measuring.patch_area import patch_masks
from gear.values.picture_objects import (
    DetectionOutcome,
    DetectionRole,
    ObjectOutcome,
    ObjectState,
    PatchDistance,
    PictureOutcomes,
)
from gear.verbs.evaluate.run import evaluate
from gear.verbs.evaluate.twin_objects import object_changes
from tests.verbs.conftest import Install, Small
from tests.verbs.evaluate.conftest import Oracle, model_spec

BUS, CAR = 6, 3
HERE, AWAY = PatchDistance(is_on_patch=True, pixels=0.0), PatchDistance(is_on_patch=False, pixels=9.0)


def thing(number: int, state: ObjectState, patch: PatchDistance = AWAY) -> ObjectOutcome:
    return ObjectOutcome(
        object_id=number, label="car", box_px=(0, 0, 9, 9), state=state, detected_as=None, score=None, patch=patch
    )


def background(patch: PatchDistance, role: DetectionRole = "background") -> DetectionOutcome:
    return DetectionOutcome(label="car", box_px=(50, 0, 70, 20), score=0.9, role=role, is_false_alarm=True, patch=patch)


def picture(things: Sequence[ObjectOutcome], *detections: DetectionOutcome) -> PictureOutcomes:
    return PictureOutcomes(objects=tuple(things), detections=detections)


def test_counts_rates_intervals_and_tests_by_hand() -> None:
    """Five pictures of four streets: a jackknife and all sign patterns, written out."""
    lost = [3, 0, 2, 1, 1]  # of four objects that the twin has found, the first one on the patch
    regained = [0, 1, 0, 0, 0]  # a fifth object that the twin has missed
    streets = ["a", "b", "c", "d", "d"]
    twin = [picture([*(thing(n, "found", AWAY if n else HERE) for n in range(4)), thing(4, "missed")])] * 5
    now = [
        picture([
            *(thing(n, "missed" if n < gone else "found", AWAY if n else HERE) for n in range(4)),
            thing(4, "found" if again else "missed"),
        ], *([background(HERE)] if gone > 1 else []))
        for gone, again in zip(lost, regained, strict=True)
    ]  # fmt: skip
    found = object_changes([7, 8, 9, 10, 11], now, twin, streets, seed=0)
    hidden = found.counts["hidden"]
    assert (found.found, hidden.count, hidden.reverse) == (20, 7, 1)
    assert (found.counts["hidden_on_patch"].count, found.counts["hidden_elsewhere"].count) == (4, 3)
    assert hidden.rate.value == 7 / 20 and found.counts["hidden_on_patch"].rate.value == 4 / 5
    groups = [[0], [1], [2], [3, 4]]
    left = np.array([(7 - sum(lost[i] for i in group)) / (20 - 4 * len(group)) for group in groups])
    assert hidden.rate.interval is not None
    low, high = hidden.rate.interval
    assert low == 0 and high > 7 / 20 + 2 * math.sqrt(3 / 4 * np.square(left - left.mean()).sum())
    net = [sum(lost[i] - regained[i] for i in group) for group in groups]
    flips = [abs(sum(s * n for s, n in zip(signs, net, strict=True))) for signs in product((1, -1), repeat=4)]
    assert hidden.paired.p == sum(one >= sum(net) for one in flips) / 16
    assert (hidden.paired.mean, hidden.paired.pairs) == (pytest.approx(6 / 5), 5)
    invented = found.counts["invented"]
    assert (invented.count, invented.reverse, invented.rate.value) == (2, 0, 2 / 5)
    assert found.counts["invented_elsewhere"].rate.value == 0
    assert [index for index, one in found.changes if one.change == "invented"] == [7, 9]


def test_objects_are_counted_by_their_distance_from_the_patch() -> None:
    """At 3, 5 and 50 m; of a fourth one nothing is known. The middle one is lost in both pictures, the last in one."""

    def at(metres: float | None) -> PatchDistance:
        return PatchDistance(is_on_patch=False, pixels=24.99, metres=metres)

    places = [at(3.0), at(5.0), at(50.0), at(None)]
    twin = [picture([thing(n, "found", place) for n, place in enumerate(places)])] * 2
    states: list[list[ObjectState]] = [
        ["found", "missed", "moved", "found"],
        ["found", "misclassified", "found", "found"],
    ]
    now = [picture([thing(n, s, p) for n, (s, p) in enumerate(zip(some, places, strict=True))]) for some in states]
    bins = object_changes([0, 1], now, twin, ["a", "b"], seed=0).by_distance
    assert [(one.low, one.high, one.found) for one in bins["metres"]] == [
        (0, 5, 2), (5, 10, 2), (10, 20, 0), (20, 40, 0), (40, math.inf, 2),
    ]  # fmt: skip
    assert bins["metres"][1].lost == {"hidden": 1, "misclassified": 1, "moved": 0}
    assert [one.rate.value for one in bins["metres"]] == pytest.approx([0, 1, math.nan, math.nan, 0.5], nan_ok=True)
    assert (bins["pixels"][0].found, bins["pixels"][0].rate.value) == (8, 3 / 8)
    assert bins["metres"][4].as_json()["high"] is None


def test_twins_that_are_equal_differ_in_nothing() -> None:
    some = [picture([thing(1, "found"), thing(2, "missed")], background(HERE)), picture([])]
    found = object_changes([0, 1], some, some, ["a", "b"], seed=0)
    assert found.found == 1 and found.changes == ()
    for name, one in found.counts.items():
        assert (one.count, one.reverse, one.paired.mean, one.paired.p) == (0, 0, 0, 1), name
    assert found.counts["invented"].rate.interval == (0, pytest.approx(3.688879 / 2)), "two streets say little"
    assert math.isnan(found.counts["hidden_on_patch"].rate.value)


@pytest.mark.parametrize("is_lost", [False, True])
def test_three_streets_without_a_difference_are_few(is_lost: bool) -> None:
    """Rates of 0 and 1 rest on the three streets that show an object, and not on the fourth one."""
    twin = [*[picture([thing(1, "found")])] * 4, picture([])]
    now = [picture([thing(1, "missed" if is_lost else "found")])] * 4
    found = object_changes([0, 1, 2, 3, 4], [*now, picture([])], twin, ["a", "b", "c", "c", "d"], seed=0)
    rate = found.counts["hidden"].rate
    exact = binomtest(3 * is_lost, 3).proportion_ci(method="exact")
    assert rate.value == is_lost and rate.interval == pytest.approx((exact.low, exact.high))


def test_what_a_patch_does_to_a_detector_is_shown(tmp_path: Path, small: Small, install: Install) -> None:
    """A network that the random patch leads astray: one object less, one as a bus, one moved, two made up."""
    roots = [small("detect2d", "none"), small("detect2d", "random")]
    patched = {Oracle.key(sample.images) for sample in gear.open_dataset(roots[1])}

    def astray(sample: Any, prediction: Any) -> Any:
        rows, columns = np.nonzero(patch_masks(sample)["left"])
        board = (float(columns.min()), float(rows.min()), float(columns.max() + 1), float(rows.max() + 1))
        made_up = (Detection(category_id=CAR, box_px=(100.0, 150.0, 140.0, 180.0), score=0.7),)
        if Oracle.key(sample.images) not in patched:
            return (*prediction, *made_up)
        if sample.record.index == 0:
            return (*made_up, Detection(category_id=CAR, box_px=board, score=0.8))
        one, other = prediction
        left, top, right, bottom = other.box_px
        far = replace(other, box_px=(left + 0.6 * (right - left), top, right + 0.6 * (right - left), bottom))
        return replace(one, category_id=BUS), far, Detection(category_id=BUS, box_px=made_up[0].box_px, score=0.7)

    install(model_spec(lambda _: Oracle(roots, astray), "detect2d"))
    report = evaluate(roots, model="odd", out=tmp_path / "out", reports=["outside_patch"])

    (difference,) = report.differences
    found = difference.objects
    assert found is not None and found.found == 3
    counts = {name: one.count for name, one in found.counts.items() if one.count}
    assert counts == {
        "hidden": 1, "hidden_elsewhere": 1, "misclassified": 1, "misclassified_elsewhere": 1, "moved": 1,
        "moved_elsewhere": 1, "invented": 2, "invented_on_patch": 1, "invented_elsewhere": 1,
    }  # fmt: skip
    assert all(
        one.reverse == (1 if name in {"invented", "invented_elsewhere"} else 0) for name, one in found.counts.items()
    )
    assert [(index, one.change) for index, one in found.changes] == [
        (0, "hidden"), (0, "invented"), (1, "misclassified"), (1, "moved"), (1, "invented"),
    ]  # fmt: skip
    assert all(0 < one.patch.pixels < 300 for _, one in found.changes if one.patch.pixels)
    none, random = report.rows
    alarms = {
        row.patch: [row.metrics["objects"][f"false_alarms_{place}"].value for place in ("on_patch", "elsewhere")]
        for row in (none, random)
    }
    assert alarms == {"none": [0, 1], "random": [0.5, 2]}, "a bus for a bicycle and a box aside are false alarms, too"
    assert random.metrics["objects"]["missed_share"].value == pytest.approx(1 / 3)
    single = [note["metrics"] for note in random.per_sample]
    assert [one["task"]["false_alarms"] - one["outside_patch"]["false_alarms"] for one in single] == [1, 0]

    assert sum(one.found for one in found.by_distance["metres"]) == 3
    written = json.loads((tmp_path / "out/results.json").read_text())["differences"][0]["objects"]
    assert written == found.as_json() and written["changes"][0]["sample"] == 0
    note = json.loads((tmp_path / "out" / random.name / "samples/000001.json").read_text())
    assert [one["state"] for one in note["objects"]["objects"]] == ["misclassified", "moved"]
    table = (tmp_path / "out/table.txt").read_text().splitlines()
    begin = next(i for i, line in enumerate(table) if line.startswith("objects found in the twin"))
    lines = [line.split() for line in table[begin + 3 :]]
    assert lines[0][-2:] == ["minus", "none"] and lines[1] == ["of", "3", "found", "count", "reverse", "rate", "p"]
    assert lines[2] == ["hidden", "1", "0", "0.333", "[0.000,", "1.000]*", "1"], "two streets are few"
    assert lines[5] == ["invented", "on", "patch", "1", "0", "0.500", "[0.000,", "6.853]*", "1"]
    assert max(len(line) for line in table[begin : begin + 10]) <= 100
    again = evaluate(roots, model="odd", out=tmp_path / "out", reports=["outside_patch"])
    assert again.as_json() == report.as_json() and sum(row.made for row in again.rows) == 0


def test_cars_in_space_are_compared_too(tmp_path: Path, small: Small, install: Install) -> None:
    """On the patched pictures every car stands two metres aside, though its box in the picture fits."""
    roots = [small("stereo3d", "none"), small("stereo3d", "random")]
    patched = {Oracle.key(sample.images) for sample in gear.open_dataset(roots[1])}

    def aside(sample: Any, prediction: Any) -> Any:
        x, y, z = prediction[0].location_m if prediction else (0, 0, 0)
        is_patched = Oracle.key(sample.images) in patched
        return tuple(replace(one, location_m=(x + 2.0, y, z)) if is_patched else one for one in prediction)

    install(model_spec(lambda _: Oracle(roots, aside), "stereo3d", views=("left", "right")))
    report = evaluate(roots, model="odd", out=tmp_path / "out", reports=["outside_patch"])
    (difference,) = report.differences
    assert difference.objects is not None
    counts = {name: one.count for name, one in difference.objects.counts.items() if one.count}
    assert difference.objects.found == counts["moved"] == counts["moved_elsewhere"] == 1 and len(counts) == 2
    assert report.row("random").metrics["objects"]["false_alarms_elsewhere"].value == 0
    assert difference.paired["outside_patch"]["found_share"].mean == 0


def test_tasks_without_objects_have_none(tmp_path: Path, small: Small, install: Install) -> None:
    roots = [small("depth", "none"), small("depth", "random")]
    install(model_spec(lambda _: Oracle(roots), "depth"))
    report = evaluate(roots, model="odd", out=tmp_path / "out")
    (difference,) = report.differences
    assert difference.objects is None and "objects" not in difference.as_json()
    assert "objects" not in (tmp_path / "out/table.txt").read_text()
