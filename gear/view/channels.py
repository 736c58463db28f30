"""Channels: the kinds of pictures of a sample, from its cameras and from the task's previews."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from gear.contracts.tasks import Sample, Task
from gear.dataset.output_checks import check_previews
from gear.values.frames import UInt8Image


@dataclass(frozen=True, slots=True, order=True)
class Channel:
    """A kind of picture that samples have.

    Attributes:
        kind: `image` for a camera's picture, `preview` for a picture that the task draws.
        name: name of the camera or the preview.
    """

    kind: Literal["image", "preview"]
    name: str


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """One picture of one sample.

    Attributes:
        pixels: (H, W, 3) uint8 RGB.
        camera: name of the view whose pixels it is aligned with, or None.
    """

    pixels: UInt8Image
    camera: str | None


class PreviewError(Exception):
    """A task's preview failed or returned something else than pictures."""


def images(sample: Sample) -> dict[Channel, Shown]:
    """The pictures of all cameras."""
    return {Channel("image", name): Shown(pixels, name) for name, pixels in sample.images.items()}


def previews(task: Task[Any, Any], sample: Sample) -> dict[Channel, Shown]:
    """The previews of the task.

    Raises:
        PreviewError: the task failed; the pictures can still be shown.
    """
    try:
        pictures = check_previews(task.preview(sample))
    except Exception as error:  # a third party's code
        raise PreviewError(f"preview failed: {type(error).__name__}: {error}") from error
    return {Channel("preview", name): Shown(p, aligned_with(name, p, sample)) for name, p in pictures.items()}


def aligned_with(name: str, pixels: UInt8Image, sample: Sample) -> str | None:
    """The camera whose picture a preview covers pixel by pixel.

    It is the camera of the same size with the preview's name, or the first camera of the same size.
    """
    same: Mapping[str, UInt8Image] = {k: v for k, v in sample.images.items() if v.shape == pixels.shape}
    return next((camera for camera in same if camera == name), None) or next(
        (camera for camera in same if camera in name), next(iter(same), None)
    )
