"""Augments a training sample: mirrors, crops, resizes and recolours the pictures together with the ground truth."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gear.augment.geometry import draw_window, whole_window
from gear.augment.pictures import Colours, recolour
from gear.augment.registry import geometry_of
from gear.contracts.tasks import Sample, SampleT
from gear.values.errors import FieldError, GearError


@dataclass(frozen=True, slots=True, kw_only=True)
class Augmentation:
    """Probabilities and strengths of the changes to training samples.

    Attributes:
        flip: probability that a sample is mirrored.
        colour: probability that its colours are changed.
        colours: strengths of the colour changes.
        cut_depth: probability that depth is pasted into a picture (monocular depth only).
    """

    flip: float = 0.5
    colour: float = 0.8
    colours: Colours = field(default_factory=Colours)
    cut_depth: float = 0.0

    def __post_init__(self) -> None:
        for name in ("flip", "colour", "cut_depth"):
            if not 0 <= getattr(self, name) <= 1:
                raise FieldError(name, f"is a share of the samples, 0 to 1, got {getattr(self, name):g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Framing:
    """The part of a picture that training uses, and its size.

    Attributes:
        crop_px: height and width of the network's input; None for the size of the whole picture.
        scales: smallest and largest factor by which a picture is resized before it is cropped.
    """

    crop_px: tuple[int, int] | None = None
    scales: tuple[float, float] = (1.0, 1.0)


def shrunk(sample: SampleT, share: float) -> SampleT:
    """Returns the sample as from a camera with the same view and fewer pixels: pictures and ground truth are
    resized.

    Args:
        sample: the sample; it is not changed.
        share: factor, above 0 and at most 1, by which width and height are multiplied. For 1 the sample itself is
            returned.

    Raises:
        GearError: the sample is of a class without registered functions (`gear.augment.registry.register`).
    """
    if share == 1:
        return sample
    geometry = geometry_of(sample)
    if geometry is None:
        raise GearError(f"{_immovable(sample)}; train with picture_scale=1")
    height, width = next(iter(sample.images.values())).shape[:2]
    small: SampleT = (geometry.shrink or geometry.cut)(sample, whole_window((height, width), share))
    return small


def augment(sample: SampleT, how: Augmentation, framing: Framing, rng: np.random.Generator) -> SampleT:
    """Returns a randomly changed copy of a sample: mirrored, cropped, resized and recoloured.

    The ground truth is changed together with the pixels. The logarithm of the scale factor is drawn uniformly.
    Mirrored, cropped or resized samples have no `surfaces`, and their `record` still describes the rendered scene.

    Args:
        sample: the sample; it is not changed.
        how: probabilities and strengths of the changes.
        framing: size of crops and range of scale factors.
        rng: generator of all random draws.

    Raises:
        GearError: crops or scales are requested for a sample of a class without registered functions.
    """
    moved: Any = _moved(sample, how, framing, rng)
    geometry = geometry_of(sample)
    if geometry is not None and geometry.cut_depth is not None and rng.random() < how.cut_depth:
        moved = geometry.cut_depth(moved, rng)
    if rng.random() < how.colour:
        moved = dataclasses.replace(moved, images=recolour(moved.images, how.colours, rng))
    return moved  # type: ignore[no-any-return]


def _moved(sample: Sample, how: Augmentation, framing: Framing, rng: np.random.Generator) -> Sample:
    geometry = geometry_of(sample)
    is_framed = framing.crop_px is not None or framing.scales != (1.0, 1.0)
    if geometry is None:
        if is_framed:
            raise GearError(f"{_immovable(sample)}; train with crop_px=null and scales=[1, 1]")
        return sample
    if rng.random() < how.flip:
        sample = geometry.flip(sample)
    if is_framed:
        size = next(iter(sample.images.values())).shape
        low, high = np.log(framing.scales)
        scale = float(np.exp(rng.uniform(low, high)))
        size_px = (int(size[0]), int(size[1]))
        window = draw_window(size_px, framing.crop_px or size_px, scale, rng, is_centred=geometry.is_centred)
        sample = geometry.cut(sample, window)
    return sample


def _immovable(sample: Sample) -> str:
    return (
        f"{type(sample).__name__} cannot be cropped or resized: its package registers no geometry "
        "(gear.augment.registry.register)"
    )
