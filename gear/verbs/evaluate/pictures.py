"""Draws for each evaluated dataset a sheet of the samples in which a patch changed most: picture, ground truth,
prediction and defended picture, next to picture and prediction of the twin (the same sample without the patch).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from gear.contracts.legends import ColourNames
from gear.contracts.tasks import NO_PATCH, Sample
from gear.dataset.checks.output_checks import check_previews
from gear.dataset.files import inside, write_whole
from gear.measuring.reports import TASK
from gear.measuring.scoring import SampleResult
from gear.metrics.object_changes import Change, ObjectChange, changes
from gear.plugins.prediction_pictures import picture_legends, prediction_pictures
from gear.plugins.stored_evaluations import read_defended
from gear.plugins.tasks.common import draw_box
from gear.plugins.text import one_line
from gear.reporting.legend import draw_legend
from gear.reporting.picture_grid import captioned, side_by_side, stacked
from gear.values.frames import UInt8Image
from gear.values.progress import Warn
from gear.verbs.evaluate.compare import EvaluatedDataset

PICTURES = "pictures"
"""Folder of the sheets in the folder of the evaluation."""

CELL_WIDTH_PX, QUALITY = 560, 92
"""Width of a picture in a sheet in pixels, and JPEG quality of a sheet."""

MIN_CHANGE, DARKENING = 24, 4
"""Smallest difference of a colour between the pictures of two predictions, in levels of 255, which counts as a change,
and the divisor of the colours elsewhere.
"""

LABEL_LENGTH = 48
"""Largest number of characters of a patch's label in a caption: the label of a shipped patch has 47."""

CHANGE_COLOURS: dict[Change, tuple[int, int, int]] = {
    "hidden": (255, 60, 60), "misclassified": (255, 150, 20), "moved": (255, 225, 60), "invented": (60, 255, 170),
}  # fmt: skip
"""Colours of the boxes of changed objects, RGB."""


def write_sheets(
    root: Path,
    rows: Sequence[EvaluatedDataset],
    count: int,
    on_warning: Warn,
    done: Callable[[], None] = lambda: None,
) -> dict[str, str]:
    """Writes one sheet for each dataset into the folder of the evaluation.

    Args:
        root: folder of the evaluation.
        rows: the evaluated datasets.
        count: number of samples on a sheet; 0 writes no sheets.
        on_warning: called with one line if a sheet cannot be drawn, because the code of another package fails.
        done: called after every sheet.

    Returns:
        Path of each sheet relative to the folder, by the name of the dataset's row.
    """
    paths: dict[str, str] = {}
    for row in rows if count else ():
        try:
            sheet = draw_sheet(root, row, twin_of(row, rows), count)
        except Exception as error:  # a third party's task
            on_warning(f"{row.dataset.root}: no pictures ({one_line(error)})")
            done()
            continue
        relative = f"{PICTURES}/{row.name}.jpg"
        data = cv2.imencode(".jpg", sheet[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1].tobytes()
        write_whole(root, relative, data)
        paths[row.name] = relative
        done()
    return paths


def twin_of(row: EvaluatedDataset, rows: Sequence[EvaluatedDataset]) -> EvaluatedDataset | None:
    """Returns the dataset that shows the same samples without a patch; None if it was not evaluated, or is `row`."""
    key = row.dataset.plan.twin_key
    others = (one for one in rows if one.patch == NO_PATCH and one.dataset.plan.twin_key == key)
    return None if row.patch == NO_PATCH else next(others, None)


def draw_sheet(root: Path, row: EvaluatedDataset, twin: EvaluatedDataset | None, count: int) -> UInt8Image:
    """Draws the sheet of one dataset, with the legend of the predictions.

    A sample has one line of pictures, or two if there is a twin: the first shows the twin and the ground truth, the
    second shows the dataset itself, and the defended picture or, without a defense, where the patch changed the
    prediction.

    Args:
        root: folder of the evaluation.
        row: the dataset.
        twin: the same samples without a patch; None draws the first samples of the dataset alone.
        count: largest number of samples.

    Returns:
        (H, W, 3) uint8 RGB.
    """
    results = row.results if twin is None else most_changed(row.results, twin.results)
    lines = [side_by_side(cells) for result in results[:count] for cells in _cells(root, row, twin, result)]
    legends = picture_legends(row.dataset.task)
    names = [name for name in _predicted(row, row.dataset[0], row.results[0]) if name in legends]
    width = max(line.shape[1] for line in lines)
    lines += [draw_legend(legends[name], width) for name in names]
    if twin is not None and any(_changes(result, twin) for result in results[:count]):
        entries = tuple((f"{change} against the twin", colour) for change, colour in CHANGE_COLOURS.items())
        lines.append(draw_legend(ColourNames(entries=entries), width))
    return stacked(lines)


def most_changed(here: Sequence[SampleResult], there: Sequence[SampleResult]) -> list[SampleResult]:
    """Sorts the samples of a dataset by how much they differ from those of its twin, largest change first.

    For tasks with objects the change is the number of changed objects. Otherwise, and among equals, it is the absolute
    change of the task's first metric that is defined for single samples.

    Args:
        here: results of the dataset, in order of the samples.
        there: results of its twin, in the same order.

    Returns:
        The results of `here`, sorted.
    """
    pairs = list(zip(here, there, strict=False))
    return [result for result, _ in sorted(pairs, key=lambda pair: _change(*pair), reverse=True)]


def _change(result: SampleResult, twin: SampleResult) -> tuple[int, float, int]:
    counted = 0
    if result.outcomes is not None and twin.outcomes is not None:
        counted = len(changes(result.outcomes, twin.outcomes))
    known = [
        abs(value - twin.metrics[TASK].get(name, math.nan))
        for name, value in result.metrics[TASK].items()
        if math.isfinite(value - twin.metrics[TASK].get(name, math.nan))
    ]
    return counted, known[0] if known else 0.0, -result.index


def _changes(result: SampleResult, twin: EvaluatedDataset) -> tuple[ObjectChange, ...]:
    other = twin.results[result.index]
    return () if result.outcomes is None or other.outcomes is None else changes(result.outcomes, other.outcomes)


def _cells(
    root: Path, row: EvaluatedDataset, twin: EvaluatedDataset | None, result: SampleResult
) -> list[list[UInt8Image]]:
    """Returns the captioned pictures of one sample, line by line and from left to right."""
    sample, index = row.dataset[result.index], f"{result.index:06d}"
    drawn = _predicted(row, sample, result)
    other = sample if twin is None else twin.dataset[result.index]
    truths = check_previews(row.dataset.task.preview(other))  # the same in the twin, on the picture of its line
    name = next(iter(drawn), next(iter(truths), ""))
    camera = name if name in sample.images else next(iter(sample.images))
    truth = truths.get(name, next(iter(truths.values()), None))
    true = [] if truth is None else [(f"{index}  ground truth", truth)]
    defended = read_defended(inside(root, row.name), {"defended": dict(result.defended)})
    guarded = [(f"{index}  after the defense", shown) for key, shown in defended.items() if key == camera]
    picture = sample.images[camera].copy()
    for change in () if twin is None else _changes(result, twin):
        left, top, right, bottom = change.box_px
        text = f"{change.change} {change.label}"
        draw_box(picture, (left, top, right - 1, bottom - 1), CHANGE_COLOURS[change.change], text)
    lines = [_line(f"{index}  patch {row.patch[:LABEL_LENGTH]}", picture, drawn)]
    if twin is None:
        lines[0] += true + guarded
    else:
        seen = _predicted(twin, other, twin.results[result.index])
        changed = [(f"{index}  bright: prediction changed", shown) for shown in _changed(drawn, seen)]
        lines = [_line(f"{index}  without a patch", other.images[camera], seen) + true, lines[0] + (guarded or changed)]
    return [[captioned(shown, text, CELL_WIDTH_PX) for text, shown in line] for line in lines]


def _changed(drawn: Mapping[str, UInt8Image], seen: Mapping[str, UInt8Image]) -> list[UInt8Image]:
    """Returns the first picture of a prediction, dark where it equals that of the twin; nothing without predictions."""
    name = next((name for name in drawn if name in seen and drawn[name].shape == seen[name].shape), None)
    if name is None:
        return []
    is_equal = cv2.absdiff(drawn[name], seen[name]).max(axis=2) < MIN_CHANGE
    return [np.where(is_equal[..., None], drawn[name] // DARKENING, drawn[name])]


def _line(caption: str, picture: UInt8Image, drawn: Mapping[str, UInt8Image]) -> list[tuple[str, UInt8Image]]:
    """Returns a picture and its predictions with their captions."""
    return [(caption, picture), *((f"{caption}, predicted {name}", shown) for name, shown in drawn.items())]


def _predicted(row: EvaluatedDataset, sample: Sample, result: SampleResult) -> Mapping[str, UInt8Image]:
    """Returns the pictures of a sample's stored prediction; none for a task that stores no predictions."""
    prediction: Any = row.scorer.prediction(result, sample)
    return {} if prediction is None else prediction_pictures(row.dataset.task, sample, prediction)
