"""The sheets of what a patch changed most, and the page that shows them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import gear
from gear.measuring.scoring import SampleResult
from gear.reporting.picture_grid import CAPTION_PX, captioned, side_by_side, stacked
from gear.verbs.evaluate.page import PAGE
from gear.verbs.evaluate.pictures import CELL_WIDTH_PX, DARKENING, MIN_CHANGE, _changed, most_changed
from gear.verbs.evaluate.run import evaluate
from tests.verbs.conftest import Install, Small
from tests.verbs.evaluate.conftest import Oracle, model_spec


def result_of(index: int, **metrics: float) -> SampleResult:
    return SampleResult(
        index=index, metrics={"task": metrics}, parts={}, cost={}, score=None, mask=None, facts=None, sha256={}
    )


def test_samples_that_changed_most_come_first() -> None:
    here = [result_of(0, miou=0.5), result_of(1, miou=0.9), result_of(2, miou=float("nan")), result_of(3, miou=0.1)]
    there = [result_of(index, miou=0.5) for index in range(4)]
    assert [one.index for one in most_changed(here, there)] == [1, 3, 0, 2]


def test_every_row_has_a_sheet_and_links_to_it(tmp_path: Path, small: Small, install: Install) -> None:
    roots = [small("depth", "none"), small("depth", "random")]

    def fooled(sample: Any, prediction: Any) -> Any:
        is_second = sample.record.index == 1
        is_patched = not np.array_equal(
            sample.images["left"], gear.open_dataset(roots[0])[sample.record.index].images["left"]
        )
        return prediction + 30 * (is_second and is_patched)

    install(model_spec(lambda _: Oracle(roots, fooled), "depth"))
    report = evaluate(roots, model="odd", out=tmp_path / "out", pictures=1)
    none, random = report.row("none"), report.row("random")
    sheet = cv2.imread(str(tmp_path / "out" / str(random.pictures)))
    height = round(96 * CELL_WIDTH_PX / 320) + CAPTION_PX
    assert sheet.shape[1] == 3 * CELL_WIDTH_PX and 2 * height < sheet.shape[0] < 2.3 * height
    # The lower line is the second sample with its patch; the upper one the same without it.
    for line, root in enumerate(roots):
        wanted = captioned(gear.open_dataset(root)[1].images["left"], "", CELL_WIDTH_PX)[CAPTION_PX:, :, ::-1]
        shown = sheet[line * height + CAPTION_PX : (line + 1) * height, :CELL_WIDTH_PX]
        assert np.abs(shown.astype(int) - wanted).mean() < 6
    predicted = sheet[:, CELL_WIDTH_PX : 2 * CELL_WIDTH_PX].astype(int)
    assert np.abs(predicted[CAPTION_PX:height] - predicted[height + CAPTION_PX : 2 * height]).mean() > 20
    # Without a defense the third picture below is bright where the prediction changed.
    third = sheet[height + CAPTION_PX : 2 * height, 2 * CELL_WIDTH_PX :].astype(int)
    upper, lower = predicted[CAPTION_PX:height], predicted[height + CAPTION_PX : 2 * height]
    is_changed, is_equal = np.abs(upper - lower).min(axis=2) > 40, np.abs(upper - lower).max(axis=2) < 8
    assert is_changed.mean() > 0.2 and np.abs(third - lower)[is_changed].mean() < 12
    assert is_equal.mean() > 0.1 and np.abs(third - lower // DARKENING)[is_equal].mean() < 12
    page = (tmp_path / "out" / PAGE).read_text()
    for row in (none, random):
        assert f'href="#{row.name}"' in page and f'src="pictures/{row.name}.jpg"' in page
        assert (tmp_path / "out" / f"pictures/{row.name}.jpg").is_file()
    assert re.search(r"<td>\s*minus none</td>", page)
    again = evaluate(roots, model="odd", out=tmp_path / "none", pictures=0)
    assert again.row("random").pictures is None and not (tmp_path / "none/pictures").exists()
    assert "<img" not in (tmp_path / "none/report.html").read_text()


def test_unchanged_parts_of_a_prediction_are_dark() -> None:
    seen = np.full((4, 6, 3), 200, np.uint8)
    drawn = seen.copy()
    drawn[1, 2, 0] -= MIN_CHANGE
    drawn[3, 3] -= MIN_CHANGE - 1
    (shown,) = _changed({"left": drawn}, {"left": seen})
    assert (shown[1, 2] == drawn[1, 2]).all() and (shown[3, 3] == drawn[3, 3] // DARKENING).all()
    assert (shown[0] == 200 // DARKENING).all()
    assert not _changed({"left": drawn}, {"left": seen[:3]}) and not _changed({"left": drawn}, {})


def test_a_task_that_cannot_draw_costs_the_pictures_alone(
    tmp_path: Path, small: Small, install: Install, monkeypatch: pytest.MonkeyPatch
) -> None:
    roots = [small("depth", "none")]
    install(model_spec(lambda _: Oracle(roots), "depth"))
    monkeypatch.setattr("gear.plugins.tasks.depth.DepthTask.preview", lambda self, sample: 1 / 0)
    notes: list[str] = []
    report = evaluate(roots, model="odd", out=tmp_path / "out", on_warning=notes.append)
    assert report.rows[0].pictures is None
    assert len(notes) == 1 and "no pictures" in notes[0]


def test_pictures_of_different_sizes_stand_side_by_side() -> None:
    low, high = np.full((4, 6, 3), 200, np.uint8), np.full((9, 3, 3), 100, np.uint8)
    joined = side_by_side([low, high])
    assert joined.shape == (9, 9, 3)
    assert (joined[:4, :6] == 200).all() and (joined[:, 6:] == 100).all() and (joined[4:, :6] < 50).all()
    assert stacked([low, high]).shape == (13, 6, 3)
