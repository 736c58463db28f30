"""The base class of gear's 2D detectors: it resizes pictures, and converts ground truth and predictions.

Outputs are in pixels of the picture, whatever the size of the network's input. Losses are in pixels of the graph's
input, as in torchvision: in this unit all anchors that contain an object completely have exactly equal overlaps, and
all of them are trained on the object. In other units rounding would make the overlaps unequal.
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
"""The sides of the graph's input are padded to multiples of this number of pixels, as in torchvision."""

ANCHORS, PICTURE = "anchors", "picture_px"
"""Names of two further inputs of the losses: the anchors, (B, N, 4) in pixels of the graph's input, and the height
and width of the pictures, (B, 2).
"""

MOSTLY = 0.5
"""Share of its area, 0..1, from which a background box inside ignored objects is left out of training."""

Size = tuple[int, int]
"""Height and width in pixels."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sizing:
    """How a picture is converted to the input of the graph (the torch module): its size and its normalisation.

    Attributes:
        inner_px: function from height and width of the picture to height and width of the graph's input, without
            padding.
        smooth: whether pictures are reduced with anti-aliasing; torchvision's detectors do without.
        mean, std: mean and standard deviation of the three channels of pictures in 0..1.
    """

    inner_px: Callable[[Size], Size]
    smooth: bool = False
    mean: tuple[float, float, float] = IMAGENET_MEAN
    std: tuple[float, float, float] = IMAGENET_STD


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Targets:
    """Ground truth of one picture for the losses, in pixels of the graph's input.

    Attributes:
        boxes: (N, 4) float32 left, top, right, bottom.
        labels: (N,) int64 class numbers of the network.
        ignored: (M, 4) boxes of regions that count neither as objects nor as background.
    """

    boxes: Tensor
    labels: Tensor
    ignored: Tensor

    def as_torchvision(self) -> dict[str, Tensor]:
        """The same ground truth as the dictionary that the losses of torchvision expect: `boxes` and `labels`."""
        return {"boxes": self.boxes, "labels": self.labels}


class Detector(Network):
    """Base class of gear's 2D detectors; predictions have COCO's categories.

    Attributes:
        sizing: how a picture is converted to the graph's input.
        categories: COCO's category id of each class of the graph; None for classes that COCO does not have.
        normalise: the layer that normalises pictures.
    """

    options: DetectorOptions
    has_quick_copy = True
    generator: ClassVar[str] = "anchor_generator"
    """Name of the attribute under which the graph holds its anchor generator."""

    def __init__(
        self, graph: nn.Module, options: DetectorOptions, *, sizing: Sizing, categories: Sequence[int | None]
    ) -> None:
        """Makes a gear network from the torch module of a detector.

        Args:
            graph: detection model of torchvision, or another one whose subclass replaces the methods that read it.
            options: options that the user gave.
            sizing: how a picture is converted to the graph's input.
            categories: COCO's category id of each class of the graph; None for classes that COCO does not have.
        """
        super().__init__(graph, options, views=(VIEW,))
        self.sizing = sizing
        self.categories = tuple(categories)
        self.normalise = Normalise(sizing.mean, sizing.std).to(self.device).eval()

    def taps(self) -> Mapping[str, nn.Module]:
        """The modules whose outputs are feature maps: the ends of the backbone's stages, `layer1` (1/4 of the
        graph's input) to `layer4` (1/32).
        """
        body = self.graph.get_submodule("backbone.body")
        return {name: body.get_submodule(name) for name in ("layer1", "layer2", "layer3", "layer4")}

    def preprocess(self, pictures: Tensor) -> Tensor:
        """Returns the (B, 3, h, w) input of the graph: the pictures resized, normalised, and padded with zeros at
        the bottom and the right.

        Args:
            pictures: (B, 3, H, W) RGB in 0..1.
        """
        size = size_of(pictures)
        inner, (height, width) = self.sizing.inner_px(size), self.input_px(size)
        pixels = self.normalise(pictures)
        if inner != size:
            pixels = functional.interpolate(
                pixels, size=inner, mode="bilinear", align_corners=False, antialias=self.sizing.smooth
            )
        return functional.pad(pixels, (0, width - inner[1], 0, height - inner[0]))

    def input_px(self, picture_px: Size) -> Size:
        """Returns height and width of the graph's input, including the padding.

        Args:
            picture_px: height and width of the picture.
        """
        height, width = self.sizing.inner_px(picture_px)
        return height + -height % DIVISOR_PX, width + -width % DIVISOR_PX

    def anchors(self, picture_px: Size, grids: Sequence[Size]) -> Tensor:
        """The (N, 4) anchors of all feature maps: left, top, right, bottom in pixels of the graph's input.

        Args:
            picture_px: height and width of the picture.
            grids: height and width of each feature map.
        """
        from torchvision.models.detection.image_list import ImageList

        shape = self.input_px(picture_px)
        network_input = torch.empty((1, 0, *shape), device=self.device)
        maps = [torch.empty((1, 0, *grid), device=self.device) for grid in grids]
        found: Tensor = self.graph.get_submodule(self.generator)(ImageList(network_input, [shape]), maps)[0]
        return found

    def shrinkage(self, picture_px: Size) -> Tensor:
        """Returns the (4,) factors that convert boxes (left, top, right, bottom) in the picture to boxes in the
        graph's input.

        Args:
            picture_px: height and width of the picture.
        """
        height, width = self.sizing.inner_px(picture_px)
        inner = torch.tensor([width, height] * 2, dtype=torch.float32, device=self.device)
        return inner / torch.tensor([picture_px[1], picture_px[0]] * 2, dtype=torch.float32, device=self.device)

    def targets(self, sample: Any, picture_px: Size) -> Targets:
        """Returns the ground truth of a sample for the losses, in pixels of the graph's input.

        Objects of classes that the network does not have are ignored. Boxes without area are ignored as well, because
        the logarithms of their sides cannot be learnt.

        Args:
            sample: sample with `objects`, boxes in edge pixels of its picture.
            picture_px: height and width of the picture.
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

    def detections(self, outputs: Mapping[str, Tensor]) -> tuple[Detection, ...]:
        """The detections of one picture with COCO's categories; detections of classes without a COCO category are
        left out.

        Args:
            outputs: torchvision's raw output for the picture: `boxes`, `scores` and `labels`.
        """
        columns = (outputs["boxes"].tolist(), outputs["labels"].tolist(), outputs["scores"].tolist())
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
"""COCO category id for each class number of the published detectors (the same number); None for the background,
class 0, and for the gaps in COCO's ids.
"""


def size_of(pictures: Tensor) -> Size:
    """Returns height and width of pictures.

    Args:
        pictures: (..., H, W).
    """
    return int(pictures.shape[-2]), int(pictures.shape[-1])


def picture_size(outputs: Mapping[str, Tensor]) -> Size:
    """Returns height and width of a batch's pictures, in pixels.

    Args:
        outputs: result of `run_for_losses`, which has an entry `picture_px`.
    """
    height, width = outputs[PICTURE][0].tolist()
    return int(height), int(width)


def fitted(min_size_px: int, max_size_px: int) -> Callable[[Size], Size]:
    """Makes torchvision's rule for the input size: the shorter side becomes `min_size_px`, unless the longer side
    would then exceed `max_size_px`.

    Args:
        min_size_px: length of the shorter side.
        max_size_px: upper limit of the longer side.

    Returns:
        Function from (height, width) of the picture to (height, width) of the network's input.
    """

    def inner_px(size: Size) -> Size:
        scale = min(min_size_px / min(size), max_size_px / max(size))
        return int(size[0] * scale), int(size[1] * scale)

    return inner_px


def scaled(scale: float) -> Callable[[Size], Size]:
    """Makes a rule for the input size: height and width of the picture are multiplied by a factor and rounded.

    Args:
        scale: the factor.

    Returns:
        Function from (height, width) of the picture to (height, width) of the network's input.
    """
    return lambda size: (max(1, round(size[0] * scale)), max(1, round(size[1] * scale)))


def share_inside(boxes: Tensor, ignored: Tensor) -> Tensor:
    """The (N,) largest share of each box's area, 0..1, that lies inside a single ignored box; 0 where there are no
    ignored boxes.

    Args:
        boxes: (N, 4) left, top, right, bottom.
        ignored: (M, 4) ignored boxes, in the same format.
    """
    if not len(ignored):
        return boxes.new_zeros(len(boxes))
    low = torch.maximum(boxes[:, None, :2], ignored[None, :, :2])
    high = torch.minimum(boxes[:, None, 2:], ignored[None, :, 2:])
    shared = (high - low).clamp(min=0).prod(dim=2)
    areas = (boxes[:, 2:] - boxes[:, :2]).prod(dim=1)
    return (shared / areas[:, None].clamp(min=1e-9)).amax(dim=1)
