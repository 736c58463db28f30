"""Predictions of a benchmark as pictures: without a patch, with the patch, and behind each defense."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gear.contracts.tasks import NO_PATCH, Sample
from gear.dataset.checks.output_checks import check_previews
from gear.dataset.reading import Dataset
from gear.plugins.datasets import open_dataset
from gear.plugins.prediction_pictures import picture_legends, prediction_pictures
from gear.plugins.stored_evaluations import StoredResults, open_evaluation
from gear.plugins.text import one_line
from gear.reporting.html_table import safe
from gear.reporting.legend import draw_legend
from gear.values.errors import DatasetError
from gear.values.frames import UInt8Image
from gear.verbs.bench.gains import is_failed
from gear.verbs.bench.paper.tables import row_of
from gear.verbs.bench.pictures.figure import figure
from gear.verbs.bench.pictures.most_changed import Chosen, most_changed
from gear.verbs.bench.plan import ADAPTIVE, PATCH
from gear.verbs.bench.report import Result, TaskResult

ROWS, WIDTH_PX = 2, 340
"""Number of pictures of each network, and the width of each picture in pixels."""

Opened = Callable[[Path], tuple[StoredResults, ...]]
"""A function that returns the stored results in the folder of an evaluation."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Shown:
    """One sample with a stored prediction.

    Attributes:
        dataset, sample: the dataset and the sample in it.
        drawn: pictures of the prediction by name.
        defended: pictures that the defense returned, by camera.
    """

    dataset: Dataset[Any]
    sample: Sample
    drawn: dict[str, UInt8Image]
    defended: dict[str, UInt8Image]


def predictions(task: TaskResult, scenes: Sequence[str]) -> Iterator[str]:
    """Yields HTML that shows for each network the pictures in which its patch does most harm, with the predictions
    without a patch, with the patch, and behind each defense.

    Nothing is yielded for tasks that store or draw no predictions. If the code of another package fails, the reason is
    shown instead of the pictures.

    Args:
        task: results of the task.
        scenes: names of the scenes in the order of the datasets of a pool.
    """
    legends: list[str] = []
    for one in task.results:
        if one.defense is not None:
            continue
        failed = is_failed(task, one, one.pool(PATCH)) if any(p.name == PATCH for p in one.evaluation.pools) else False
        title = f"Predictions of {one.model}, where its patch does most harm{' (failed attack)' * failed}"
        opened = functools.cache(open_evaluation)  # the results of all samples, which all figures of a network need
        try:
            lines = [line for each in most_changed(task, one, ROWS) for line in _line(task, one, each, scenes, opened)]
            legends = legends or _legends(one)
        except Exception as error:  # a third party's task, or an evaluation that was changed
            yield f'<h3>{safe(title)}</h3><p class="dim">no pictures: {safe(one_line(error))}</p>'
            continue
        if lines:
            yield f"<h3>{safe(title)}</h3>{''.join(lines)}"
    yield from legends


def _line(task: TaskResult, alone: Result, chosen: Chosen, scenes: Sequence[str], opened: Opened) -> Iterator[str]:
    """Yields the figures of one sample as one line of HTML."""
    clean, patched = (_shown(alone, kind, chosen, opened) for kind in (NO_PATCH, PATCH))
    if clean is None or patched is None or not clean.drawn:
        return
    name = next(iter(clean.drawn))
    camera = name if name in clean.sample.images else next(iter(clean.sample.images))
    cells = [("without a patch", clean.sample.images[camera]), ("predicted without a patch", clean.drawn[name])]
    truths = check_previews(clean.dataset.task.preview(clean.sample))
    cells += [("ground truth", truths[name])] if name in truths else []
    cells += [("with the patch", patched.sample.images[camera]), ("predicted with the patch", patched.drawn[name])]
    for one in task.results:
        if one.model != alone.model or one.defense is None:
            continue
        for kind, of in ((PATCH, "the patch"), (ADAPTIVE, "the adaptive patch")):
            behind = _shown(one, kind, chosen, opened)
            if behind is None or name not in behind.drawn:
                continue
            if one.changes_pictures and camera in behind.defended:
                cells.append((f"{of} after {one.defense}", behind.defended[camera]))
            cells.append((f"predicted with {of} behind {one.defense}", behind.drawn[name]))
    value = f", {chosen.metric} {chosen.clean:.3f} to {chosen.patched:.3f}" if chosen.metric else ""
    figures = "".join(figure(pixels, caption, WIDTH_PX) for caption, pixels in cells)
    yield f"<p>{safe(f'{scenes[chosen.place]}, picture {chosen.index}{value}')}</p><div class=row>{figures}</div>"


def _shown(one: Result, kind: str, chosen: Chosen, opened: Opened) -> Shown | None:
    """Reads a sample and its stored prediction; None if there is no such kind of patch or no prediction."""
    row = row_of(one, kind, chosen.place)
    if row is None:
        return None
    dataset = open_dataset(row.dataset)
    sample = dataset[chosen.index]
    stored = next(part for part in opened(one.evaluation.out) if part.name == row.name)
    try:
        prediction = stored.prediction(dataset, sample)
    except DatasetError:
        return None
    drawn = prediction_pictures(dataset.task, sample, prediction)
    return Shown(dataset=dataset, sample=sample, drawn=dict(drawn), defended=stored.defended(chosen.index))


def _legends(one: Result) -> list[str]:
    """The legends of the drawn predictions of a task, as HTML."""
    rows = one.evaluation.rows
    legends = picture_legends(open_dataset(rows[0].dataset).task) if rows else {}
    return [
        f'<div class="row">{figure(draw_legend(legend, 2 * WIDTH_PX), f"colours of {name}", 2 * WIDTH_PX)}</div>'
        for name, legend in legends.items()
    ]
