"""Draws figures of samples: pictures with the predictions of networks, next to the ground truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from gear.contracts.tasks import Sample, Task
from gear.dataset.checks.output_checks import check_previews
from gear.plugins.prediction_pictures import picture_legends, prediction_pictures
from gear.reporting.legend import draw_legend
from gear.reporting.picture_grid import captioned, side_by_side, stacked
from gear.values.frames import UInt8Image

CELL_WIDTH_PX = 480


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ShownPictures:
    """The pictures of one sample in a figure, with the predictions of networks on them.

    Attributes:
        caption: description of the pictures, such as `with the patch`.
        images: (H, W, 3) uint8 RGB pictures by camera name.
        predictions: predictions in the task's format, by the network's name; "" is the name of an only network.
    """

    caption: str
    images: Mapping[str, UInt8Image]
    predictions: Mapping[str, Any]


ShownSample = tuple[Sample, Sequence[ShownPictures]]
"""A sample and its pictures, such as without and with patches; each has a line of the figure of its own."""


def sample_figure(task: Task[Any, Any], samples: Sequence[ShownSample]) -> UInt8Image:
    """Draws a figure with one line per picture: the picture, the predictions, and in the first line of each sample
    the ground truth. Legends are added at the bottom.

    Args:
        task: task of the samples, which draws ground truth and predictions.
        samples: the samples with their pictures, at least one.

    Returns:
        (H, W, 3) uint8 RGB.

    Raises:
        TypeError: the task returned something that is no picture.
        Exception: whatever the task's methods raise; the task may belong to another package.
    """
    lines: list[UInt8Image] = []
    names: list[str] = []
    for sample, shown in samples:
        for number, one in enumerate(shown):
            cells, drawn = _line(task, sample, one, with_truth=not number)
            lines.append(side_by_side(cells))
            names += [name for name in drawn if name not in names]
    legends = picture_legends(task)
    width = max(line.shape[1] for line in lines)
    return stacked([*lines, *(draw_legend(legends[name], width) for name in names if name in legends)])


def _line(
    task: Task[Any, Any], sample: Sample, shown: ShownPictures, *, with_truth: bool
) -> tuple[list[UInt8Image], list[str]]:
    """Draws one line of a figure; returns its pictures, and the names of the drawn predictions."""
    pictured = replace(sample, images=shown.images)
    predicted = {network: prediction_pictures(task, pictured, one) for network, one in shown.predictions.items()}
    names = list(dict.fromkeys(name for drawn in predicted.values() for name in drawn))
    camera = next((name for name in names if name in shown.images), next(iter(shown.images)))
    title = f"sample {sample.record.index}, {shown.caption}"
    cells = [(title, shown.images[camera])]
    for network, drawn in predicted.items():
        whose = f" by {network}" if network else ""
        cells += [(f"predicted {name}{whose}, {shown.caption}", picture) for name, picture in drawn.items()]
    if with_truth:
        truths = check_previews(task.preview(sample))
        same = [name for name in names if name in truths] or list(truths)[-1:]
        cells += [(f"ground truth: {name}", truths[name]) for name in same]
    return [captioned(picture, caption, CELL_WIDTH_PX) for caption, picture in cells], names
