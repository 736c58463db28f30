"""What an image processor of Hugging Face's does to a picture, in torch, so that gradients pass it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from torch import Tensor
from torch.nn import functional

from gear.nn.network import IMAGENET_MEAN, IMAGENET_STD, Normalise
from gear.values.errors import GearError

Size = tuple[int, int]
"""Height and width."""

RESAMPLING = {0: "nearest", 2: "bilinear", 3: "bicubic"}
"""By Pillow's numbers."""

FILE = "preprocessor_config.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class Processor:
    """Resizing and normalisation.

    Attributes:
        mean, std: of each channel of a picture in 0..1.
        size: as the file has it: `height` and `width`, or `shortest_edge` and perhaps `longest_edge`; empty for none.
        mode: of interpolation.
        multiple_px: sides are multiples of this.
        keeps_ratio: whether `height` and `width` are a frame that the picture is fitted to by the lesser change.
        rounds_down: whether sides are cut down to the multiple rather than rounded.
    """

    mean: tuple[float, float, float] = IMAGENET_MEAN
    std: tuple[float, float, float] = IMAGENET_STD
    size: dict[str, int] | None = None
    mode: str = "bilinear"
    multiple_px: int = 1
    keeps_ratio: bool = False
    rounds_down: bool = False

    def target(self, picture_px: Size) -> Size:
        """Height and width that a picture is resized to."""
        height, width = float(picture_px[0]), float(picture_px[1])
        size = self.size or {}
        if "shortest_edge" in size:
            short, long = min(picture_px), max(picture_px)
            edge, most = size["shortest_edge"], size.get("longest_edge")
            if most and long / short * edge > most:
                edge = round(most * short / long)
            height, width = (edge if side == short else int(edge * side / short) for side in picture_px)
        elif self.keeps_ratio and size:
            scales = (size["height"] / height, size["width"] / width)
            scale = min(scales, key=lambda each: abs(1 - each))
            height, width = height * scale, width * scale
        elif size:
            height, width = size["height"], size["width"]
        return self._multiple(height), self._multiple(width)

    def apply(self, pictures: Tensor, *, resizes: bool = True) -> Tensor:
        """(B, 3, H, W) in 0..1, resized with anti-aliasing and normalised."""
        picture_px = (int(pictures.shape[2]), int(pictures.shape[3]))
        target = self.target(picture_px) if resizes else (self._multiple(picture_px[0]), self._multiple(picture_px[1]))
        if target != picture_px:
            if self.mode == "nearest":
                pictures = functional.interpolate(pictures, target, mode="nearest")
            else:
                pictures = functional.interpolate(pictures, target, mode=self.mode, antialias=True).clamp(0, 1)
        normalise: Tensor = Normalise(self.mean, self.std).to(pictures.device)(pictures)
        return normalise

    def _multiple(self, side_px: float) -> int:
        steps = side_px / self.multiple_px
        return max(1, int(steps) if self.rounds_down else round(steps)) * self.multiple_px


def read_processor(folder: Path) -> Processor:
    """The image processor of a folder; without one, ImageNet's normalisation and no resizing.

    Raises:
        GearError: it is not JSON, or asks for what gear does not do.
    """
    path = folder / FILE
    if not path.is_file():
        return Processor()
    try:
        facts: dict[str, Any] = json.loads(path.read_text())
    except json.JSONDecodeError as error:
        raise GearError(f"{path}:{error.lineno}: not JSON: {error.msg}") from error
    if not isinstance(facts, dict):
        raise GearError(f"{path}: a mapping is wanted, got {facts!r}")
    try:
        return _processor(facts, path)
    except (TypeError, ValueError) as error:
        raise GearError(f"{path}: a value is not of the kind that it should be ({error})") from error


def _processor(facts: dict[str, Any], path: Path) -> Processor:
    resizes, resample = facts.get("do_resize", True), facts.get("resample", 2)
    if resizes and resample not in RESAMPLING:
        raise GearError(f"{path}: resample {resample} is not supported; nearest (0), bilinear (2) and bicubic (3) are")
    divisor = facts.get("size_divisor")
    normalises = facts.get("do_normalize", divisor is None)
    return Processor(
        mean=tuple(facts.get("image_mean") or IMAGENET_MEAN) if normalises else (0.0, 0.0, 0.0),
        std=tuple(facts.get("image_std") or IMAGENET_STD) if normalises else (1.0, 1.0, 1.0),
        size=_size(facts.get("size"), path) if resizes and divisor is None else None,
        mode=RESAMPLING.get(resample, "bilinear"),
        multiple_px=int(divisor or facts.get("ensure_multiple_of") or 1),
        keeps_ratio=bool(facts.get("keep_aspect_ratio", False)),
        rounds_down=divisor is not None,
    )


def _size(size: Any, path: Path) -> dict[str, int] | None:
    if size is None or isinstance(size, dict):
        known = {"height", "width"}, {"shortest_edge"}
        if size and not any(names <= size.keys() for names in known):
            raise GearError(f"{path}: size {size} is not supported; height and width, or shortest_edge are")
        return {name: int(value) for name, value in size.items() if value is not None} if size else None
    return {"height": int(size), "width": int(size)}
