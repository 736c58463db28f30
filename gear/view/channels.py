"""Channels: the kinds of pictures of a sample. They are the pictures of its cameras, the previews that its task draws,
predictions of evaluations, and the pictures that a defense returned.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

from gear.contracts.tasks import Sample, Task
from gear.dataset.checks.output_checks import check_previews
from gear.dataset.reading import Dataset
from gear.plugins.prediction_pictures import prediction_pictures
from gear.plugins.stored_evaluations import StoredResults
from gear.values.errors import GearError
from gear.values.frames import UInt8Image

Kind = Literal["image", "preview", "prediction", "defended"]

KINDS: tuple[Kind, ...] = get_args(Kind)
"""Kinds of channels in the order in which the page lists them."""


@dataclass(frozen=True, slots=True, order=True)
class Channel:
    """One kind of picture that the samples of a dataset have.

    Attributes:
        kind: `image` for a camera's picture, `preview` for a picture that the task draws of the ground truth,
            `prediction` for a picture of a prediction, `defended` for a picture that a defense returned.
        name: name of the camera or of the preview.
        dataset: label of the dataset, if the page compares several; otherwise empty.
        evaluation: label of the evaluation that the picture belongs to; empty for the dataset's own pictures.
    """

    kind: Kind
    name: str
    dataset: str = ""
    evaluation: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """One picture that a page shows of a sample, such as a camera picture or a depth map in colours.

    Attributes:
        pixels: (H, W, 3) uint8 RGB.
        camera: name of the camera whose pixels coincide with these pixels; None if there is no such camera.
    """

    pixels: UInt8Image
    camera: str | None


class PreviewError(Exception):
    """The preview function of a task failed, or returned something other than pictures."""


def images(sample: Sample, dataset: str = "") -> dict[Channel, Shown]:
    """Returns the pictures of all cameras of a sample, by channel; `dataset` is the label of the sample's dataset."""
    return {Channel("image", name, dataset): Shown(pixels, name) for name, pixels in sample.images.items()}


def previews(task: Task[Any, Any], sample: Sample, dataset: str = "") -> dict[Channel, Shown]:
    """Returns the previews that the task draws for a sample, by channel; `dataset` is the label of its dataset.

    Raises:
        PreviewError: the task's preview function failed; the camera pictures are not affected.
    """
    try:
        pictures = check_previews(task.preview(sample))
    except Exception as error:  # a third party's code
        raise PreviewError(f"preview failed: {type(error).__name__}: {error}") from error
    return {Channel("preview", name, dataset): Shown(p, aligned_with(name, p, sample)) for name, p in pictures.items()}


def predictions(dataset: Dataset[Any], part: StoredResults, sample: Sample, label: str) -> dict[Channel, Shown]:
    """Returns the pictures of a stored prediction and the pictures that the defense returned, by channel.

    Args:
        dataset: the evaluated dataset.
        part: the dataset's part of the evaluation.
        sample: the sample whose prediction is drawn.
        label: label of the dataset.

    Raises:
        PreviewError: the prediction cannot be read, or the task's function that draws it failed.
    """
    try:
        drawn = prediction_pictures(dataset.task, sample, part.prediction(dataset, sample))
        defended = part.defended(sample.record.index)
    except GearError as error:
        raise PreviewError(str(error)) from error
    except Exception as error:  # a third party's code
        raise PreviewError(f"the prediction cannot be drawn: {type(error).__name__}: {error}") from error
    found = {
        Channel("prediction", name, label, part.label): Shown(pixels, aligned_with(name, pixels, sample))
        for name, pixels in drawn.items()
    }
    return found | {Channel("defended", name, label, part.label): Shown(p, name) for name, p in defended.items()}


def aligned_with(name: str, pixels: UInt8Image, sample: Sample) -> str | None:
    """Returns the name of the camera whose pixels coincide with those of a preview; None if no camera has the preview's
    size.

    Among the cameras of the preview's size it is the one with the same name, then one whose name is part of the
    preview's name, then the first.

    Args:
        name: name of the preview.
        pixels: (H, W, 3) uint8 preview.
        sample: the sample that the preview shows.
    """
    same: Mapping[str, UInt8Image] = {k: v for k, v in sample.images.items() if v.shape == pixels.shape}
    return next((camera for camera in same if camera == name), None) or next(
        (camera for camera in same if camera in name), next(iter(same), None)
    )
