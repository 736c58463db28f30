"""Figures of samples: which pictures they have, in which order, and their legend."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gear.config.nodes import parse_text
from gear.measuring import sample_figures
from gear.measuring.sample_figures import CELL_WIDTH_PX, ShownPictures, ShownSample, sample_figure
from gear.plugins.build import build_task
from gear.plugins.prediction_pictures import picture_legends
from gear.reporting.legend import draw_legend
from gear.reporting.picture_grid import CAPTION_PX
from gear.testing.synthetic import synthetic_frame
from gear.values.frames import UInt8Image

SIZE = "{width_px: 480, height_px: 240}"
CELL_HEIGHT_PX = 240 + CAPTION_PX


def task_and_sample(name: str, index: int = 0) -> tuple[Any, Any]:
    _, task = build_task(name, parse_text(SIZE, "options"))
    frame, record = synthetic_frame(task.rig(), index=index)
    return task, task.ground_truth(frame, record)


def shown(task: Any, sample: Any, caption: str, *networks: str, is_dark: bool = False) -> ShownPictures:
    images = {name: picture // (4 if is_dark else 1) for name, picture in sample.images.items()}
    prediction = task.as_prediction(sample)
    return ShownPictures(caption=caption, images=images, predictions=dict.fromkeys(networks or ("",), prediction))


def cell(figure: UInt8Image, line: int, column: int) -> UInt8Image:
    """The picture of a cell, without its caption."""
    top, left = line * CELL_HEIGHT_PX + CAPTION_PX, column * CELL_WIDTH_PX
    return figure[top : top + CELL_HEIGHT_PX - CAPTION_PX, left : left + CELL_WIDTH_PX]


@pytest.fixture
def captions(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The captions of all cells that a test draws."""
    drawn: list[str] = []
    draw = sample_figures.captioned

    def noting(picture: UInt8Image, caption: str, width_px: int) -> UInt8Image:
        drawn.append(caption)
        return draw(picture, caption, width_px)

    monkeypatch.setattr(sample_figures, "captioned", noting)
    return drawn


def test_a_line_has_picture_prediction_and_ground_truth(captions: list[str]) -> None:
    task, sample = task_and_sample("semseg")
    rows: list[ShownSample] = [(sample, [shown(task, sample, "clean"), shown(task, sample, "patched", is_dark=True)])]
    figure = sample_figure(task, rows)
    assert captions == [
        "sample 0, clean", "predicted labels, clean", "ground truth: labels",
        "sample 0, patched", "predicted labels, patched",
    ]  # fmt: skip
    (picture,) = sample.images.values()
    assert np.array_equal(cell(figure, 0, 0), picture)
    assert np.array_equal(cell(figure, 1, 0), picture // 4)
    drawn = task.prediction_preview(sample, task.as_prediction(sample))["labels"]
    assert np.array_equal(cell(figure, 0, 1), drawn)
    assert np.array_equal(cell(figure, 0, 2), task.preview(sample)["labels"])
    assert np.ptp(cell(figure, 1, 2)) == 0, "the ground truth is drawn once per sample"


def test_the_legend_of_what_is_predicted_is_at_the_bottom() -> None:
    for name, legend in (("semseg", "labels"), ("depth", "depth"), ("detect2d", "objects")):
        task, sample = task_and_sample(name)
        figure = sample_figure(task, [(sample, [shown(task, sample, "clean")])])
        strip = draw_legend(picture_legends(task)[legend], figure.shape[1])
        assert np.array_equal(figure[-len(strip) :], strip), name


def test_several_networks_have_a_cell_each(captions: list[str]) -> None:
    task, sample = task_and_sample("depth")
    figure = sample_figure(task, [(sample, [shown(task, sample, "clean", "a", "b")])])
    assert captions[1:3] == ["predicted depth by a, clean", "predicted depth by b, clean"]
    assert np.array_equal(cell(figure, 0, 1), cell(figure, 0, 2)) and figure.shape[1] == 4 * CELL_WIDTH_PX


def test_samples_follow_each_other(captions: list[str]) -> None:
    task, first = task_and_sample("semseg")
    _, second = task_and_sample("semseg", index=7)
    sample_figure(task, [(one, [shown(task, one, "clean")]) for one in (first, second)])
    assert [caption for caption in captions if caption.startswith("sample")] == ["sample 0, clean", "sample 7, clean"]


def test_a_task_that_draws_something_else_than_pictures_is_an_error() -> None:
    task, sample = task_and_sample("semseg")

    class Wrong:
        def __getattr__(self, name: str) -> Any:
            return getattr(task, name)

        def preview(self, _: Any) -> Any:
            return {"labels": np.zeros((2, 2))}

    with pytest.raises(TypeError):
        sample_figure(Wrong(), [(sample, [shown(task, sample, "clean")])])  # type: ignore[arg-type]
