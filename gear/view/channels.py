"""Channels: the kinds of pictures of a sample, which are the pictures of its cameras and the previews that its
task draws.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from gear.contracts.tasks import Sample, Task
from gear.dataset.output_checks import check_previews
from gear.values.frames import UInt8Image


@dataclass(frozen=True, slots=True, order=True)
class Channel:
    """One kind of picture that the samples of a dataset have.

    Attributes:
        kind: `image` for a camera's picture, `preview` for a picture that the task draws.
        name: name of the camera or of the preview.
    """

    kind: Literal["image", "preview"]
    name: str


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """One picture of one sample.

    Attributes:
        pixels: (H, W, 3) uint8 RGB.
        camera: name of the camera whose pixels coincide with these pixels; None if there is no such camera.
    """

    pixels: UInt8Image
    camera: str | None


class PreviewError(Exception):
    """The preview function of a task failed, or returned something other than pictures."""


def images(sample: Sample) -> dict[Channel, Shown]:
    """Returns the pictures of all cameras of a sample, by channel."""
    return {Channel("image", name): Shown(pixels, name) for name, pixels in sample.images.items()}


def previews(task: Task[Any, Any], sample: Sample) -> dict[Channel, Shown]:
    """Returns the previews that the task draws for a sample, by channel.

    Raises:
        PreviewError: the task's preview function failed; the camera pictures are not affected.
    """
    try:
        pictures = check_previews(task.preview(sample))
    except Exception as error:  # a third party's code
        raise PreviewError(f"preview failed: {type(error).__name__}: {error}") from error
    return {Channel("preview", name): Shown(p, aligned_with(name, p, sample)) for name, p in pictures.items()}


def aligned_with(name: str, pixels: UInt8Image, sample: Sample) -> str | None:
    """Returns the name of the camera whose pixels coincide with those of a preview; None if no camera has the
    preview's size.

    Among the cameras of the preview's size it is the one with the same name, then one whose name is part of the
    preview's name, then the first.
    """
    same: Mapping[str, UInt8Image] = {k: v for k, v in sample.images.items() if v.shape == pixels.shape}
    return next((camera for camera in same if camera == name), None) or next(
        (camera for camera in same if camera in name), next(iter(same), None)
    )
