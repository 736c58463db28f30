"""Base of gear's 2D detectors: input size, ground truth, predictions.

Outputs are in pixels of the picture, for any size of the network's input. Losses are in pixels of the graph's input, as
in torchvision: there, all anchors that contain an object completely have exactly the same overlap and are trained on
it; in other units rounding would break these ties.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import torch
from torch import Tensor, nn
from torch.nn import functional

from gear.formats.coco import CATEGORY_NAMES, Detection
from gear.networks.detection.options import DetectorOptions
from gear.networks.network import IMAGENET_MEAN, IMAGENET_STD, Network, Normalise

VIEW = "left"
DIVISOR_PX = 32
"""Sides of the graph's input are padded to multiples of this, as in torchvision."""

ANCHORS, PICTURE = "anchors", "picture_px"
"""Further inputs of the losses: (B, N, 4) in the graph's pixels; (B, 2) height and width."""

MOSTLY = 0.5
"""Background is not trained on if this share of it lies in ignored objects."""

Size = tuple[int, int]
"""Height and width."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sizing:
    """The preprocessing of pictures to the graph's input.

    Attributes:
        inner_px: function from height and width of the picture to those of the graph's input.
        smooth: whether reducing averages; torchvision's detectors do not average.
        mean, std: of each channel, for normalisation.
    """

    inner_px: Callable[[Size], Size]
    smooth: bool = False
    mean: tuple[float, float, float] = IMAGENET_MEAN
    std: tuple[float, float, float] = IMAGENET_STD


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Targets:
    """Ground truth of one picture, in pixels of the graph's input.

    Attributes:
        boxes: (N, 4) float32 left, top, right, bottom.
        labels: (N,) int64 class numbers of the network.
        ignored: (M, 4) boxes of regions that count neither as objects nor as background.
    """

    boxes: Tensor
    labels: Tensor
    ignored: Tensor

    def as_torchvision(self) -> dict[str, Tensor]:
        """The dictionary that torchvision's losses take."""
        return {"boxes": self.boxes, "labels": self.labels}


class Detector(Network):
    """A torchvision graph with COCO detections as predictions."""

    options: DetectorOptions
    has_quick_copy = True
    generator: ClassVar[str] = "anchor_generator"
    """Name under which the graph keeps its anchor generator."""

    def __init__(
        self, graph: nn.Module, options: DetectorOptions, *, sizing: Sizing, categories: Sequence[int | None]
    ) -> None:
        """Wraps a graph.

        Args:
            graph: detection model of torchvision.
            options: as the user gave them.
            sizing: how the graph's input is made.
            categories: COCO's category id of each class of the graph; None for classes that COCO does not have.
        """
        super().__init__(graph, options, views=(VIEW,))
        self.sizing = sizing
        self.categories = tuple(categories)
        self.normalise = Normalise(sizing.mean, sizing.std).to(self.device).eval()

    def taps(self) -> Mapping[str, nn.Module]:
        """The backbone's stages, `layer1` (1/4 of the graph's input) to `layer4` (1/32)."""
        body = self.graph.get_submodule("backbone.body")
        return {name: body.get_submodule(name) for name in ("layer1", "layer2", "layer3", "layer4")}

    def seen(self, pictures: Tensor) -> Tensor:
        """(B, 3, h, w) input of the graph: normalised, resized, padded with zeros at the bottom and on the right."""
        size = size_of(pictures)
        inner, (height, width) = self.sizing.inner_px(size), self.seen_px(size)
        pixels = self.normalise(pictures)
        if inner != size:
            pixels = functional.interpolate(
                pixels, size=inner, mode="bilinear", align_corners=False, antialias=self.sizing.smooth
            )
        return functional.pad(pixels, (0, width - inner[1], 0, height - inner[0]))

    def seen_px(self, picture_px: Size) -> Size:
        """Height and width of the graph's input for a picture, padding included."""
        height, width = self.sizing.inner_px(picture_px)
        return height + -height % DIVISOR_PX, width + -width % DIVISOR_PX

    def anchors(self, picture_px: Size, grids: Sequence[Size]) -> Tensor:
        """(N, 4) anchors in the graph's pixels, for feature maps of these sizes."""
        from torchvision.models.detection.image_list import ImageList

        shape = self.seen_px(picture_px)
        seen = torch.empty((1, 0, *shape), device=self.device)
        maps = [torch.empty((1, 0, *grid), device=self.device) for grid in grids]
        found: Tensor = self.graph.get_submodule(self.generator)(ImageList(seen, [shape]), maps)[0]
        return found

    def shrinkage(self, picture_px: Size) -> Tensor:
        """(4,) factors from box coordinates in the picture to those in the graph's input."""
        height, width = self.sizing.inner_px(picture_px)
        inner = torch.tensor([width, height] * 2, dtype=torch.float32, device=self.device)
        return inner / torch.tensor([picture_px[1], picture_px[0]] * 2, dtype=torch.float32, device=self.device)

    def targets(self, sample: Any, picture_px: Size) -> Targets:
        """Ground truth of a sample. Objects of classes that the network lacks are ignored, as are boxes without an
        area, whose sides have no logarithm to learn.
        """
        shrinkage = self.shrinkage(picture_px)
        number = {category: index for index, category in enumerate(self.categories) if category is not None}
        wanted: list[Any] = []
        others: list[Any] = []
        for thing in sample.objects:
            left, top, right, bottom = thing.box_px
            is_wanted = not thing.is_ignored and thing.category_id in number and left < right and top < bottom
            (wanted if is_wanted else others).append(thing)
        labels = [number[thing.category_id] for thing in wanted]
        return Targets(
            boxes=self._boxes(wanted) * shrinkage,
            labels=torch.tensor(labels, dtype=torch.int64, device=self.device),
            ignored=self._boxes(others) * shrinkage,
        )

    def detections(self, found: Mapping[str, Tensor]) -> tuple[Detection, ...]:
        """The detections of one picture; classes that COCO has no category for are left out."""
        columns = (found["boxes"].tolist(), found["labels"].tolist(), found["scores"].tolist())
        return tuple(
            Detection(category_id=category, box_px=(left, top, right, bottom), score=score)
            for (left, top, right, bottom), label, score in zip(*columns, strict=True)
            if (category := self.categories[label]) is not None
        )

    def _boxes(self, things: Sequence[Any]) -> Tensor:
        boxes = [thing.box_px for thing in things]
        return torch.tensor(boxes, dtype=torch.float32, device=self.device).reshape(-1, 4)


OFFICIAL_CLASSES = 91
OFFICIAL_CATEGORIES = tuple(number if number in CATEGORY_NAMES else None for number in range(OFFICIAL_CLASSES))
"""Classes of the published detectors are COCO's category ids, with gaps; 0 is the background."""


def size_of(pictures: Tensor) -> Size:
    """Height and width of (..., H, W) pictures."""
    return int(pictures.shape[-2]), int(pictures.shape[-1])


def picture_size(outputs: Mapping[str, Tensor]) -> Size:
    """Height and width of a batch's pictures, from what `losses` is given."""
    height, width = outputs[PICTURE][0].tolist()
    return int(height), int(width)


def fitted(min_size_px: int, max_size_px: int) -> Callable[[Size], Size]:
    """torchvision's rule: the shorter side becomes `min_size_px`, unless the longer side would exceed `max_size_px`."""

    def inner_px(size: Size) -> Size:
        scale = min(min_size_px / min(size), max_size_px / max(size))
        return int(size[0] * scale), int(size[1] * scale)

    return inner_px


def scaled(scale: float) -> Callable[[Size], Size]:
    """Both sides times a factor, rounded."""
    return lambda size: (max(1, round(size[0] * scale)), max(1, round(size[1] * scale)))


def share_inside(boxes: Tensor, ignored: Tensor) -> Tensor:
    """(N,) largest share, 0..1, of each of (N, 4) boxes' areas that lies in one of (M, 4) ignored boxes; 0 where M is
    0.
    """
    if not len(ignored):
        return boxes.new_zeros(len(boxes))
    low = torch.maximum(boxes[:, None, :2], ignored[None, :, :2])
    high = torch.minimum(boxes[:, None, 2:], ignored[None, :, 2:])
    shared = (high - low).clamp(min=0).prod(dim=2)
    areas = (boxes[:, 2:] - boxes[:, :2]).prod(dim=1)
    return (shared / areas[:, None].clamp(min=1e-9)).amax(dim=1)
