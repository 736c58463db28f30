"""Channels: what a sample can be looked at as; its pictures and the task's previews of them."""

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
        kind: `image` for a camera's picture, `preview` for what the task draws.
        name: the camera's, or the preview's.
    """

    kind: Literal["image", "preview"]
    name: str


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """One picture of one sample.

    Attributes:
        pixels: (H, W, 3) uint8 RGB.
        camera: name of the view whose pixels these are aligned with, or None.
    """

    pixels: UInt8Image
    camera: str | None


class PreviewError(Exception):
    """A task's preview failed or gave something that is no picture; says what."""


def images(sample: Sample) -> dict[Channel, Shown]:
    """The pictures of every camera."""
    return {Channel("image", name): Shown(pixels, name) for name, pixels in sample.images.items()}


def previews(task: Task[Any, Any], sample: Sample) -> dict[Channel, Shown]:
    """The task's previews.

    Raises:
        PreviewError: the task failed, which is no reason not to show the rest.
    """
    try:
        pictures = check_previews(task.preview(sample))
    except Exception as error:  # a third party's code
        raise PreviewError(f"preview failed: {type(error).__name__}: {error}") from error
    return {Channel("preview", name): Shown(p, aligned_with(name, p, sample)) for name, p in pictures.items()}


def aligned_with(name: str, pixels: UInt8Image, sample: Sample) -> str | None:
    """The camera that a preview covers pixel by pixel.

    That is the one of the same size whose name the preview bears, else the first one of the same size.
    """
    same: Mapping[str, UInt8Image] = {k: v for k, v in sample.images.items() if v.shape == pixels.shape}
    return next((camera for camera in same if camera == name), None) or next(
        (camera for camera in same if camera in name), next(iter(same), None)
    )
