"""Networks that give every pixel one of the 19 classes that Cityscapes evaluates."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from torch import Tensor, nn
from torch.nn import functional

from gear.formats.cityscapes import IGNORED_TRAIN_ID, LABELS
from gear.networks.network import Network, Normalise
from gear.networks.options import SegmentationOptions
from gear.networks.segmentation.label_maps import best_class, best_class_at
from gear.networks.segmentation.losses import sampled_logits

VIEW = "left"
LOGITS = "logits"
MAPS = "maps"
AUXILIARY = "auxiliary"
"""Outputs of further heads, which only losses see, are `auxiliary_0`, `auxiliary_1`, ..."""

STRIDE_PX = 8
"""Networks give their maps at 1/8 of what they look at, so its sides are multiples of this."""

LABEL_ID_OF_TRAIN_ID = tuple(
    label.id for label in sorted(LABELS, key=lambda label: label.train_id) if label.train_id != IGNORED_TRAIN_ID
)
LABEL_IDS = np.array(LABEL_ID_OF_TRAIN_ID, dtype=np.uint8)
CLASSES = len(LABEL_IDS)

Losses = Callable[[Mapping[str, Tensor], Sequence[Any]], Mapping[str, Tensor]]
"""Named numbers from outputs and the batch's samples."""


class SemsegNetwork(Network):
    """A graph that labels pixels.

    Its pictures are scaled by `input_scale` and to the nearest multiple of 8 on each side (bilinear, with anti-aliasing
    where that makes them smaller), nothing is cut off or added, and its logits are interpolated back to the picture's
    size. A picture whose sides are multiples of 8 is looked at as it is unless `input_scale` says otherwise.

    Attributes:
        graph: gives a list of (B, classes, h, w) maps, the main head's first; says in `align_corners` how they are to
            be interpolated, and in `taps()` what its named feature maps are.
        input_scale: share of the picture's size.
    """

    has_quick_copy = True

    def __init__(
        self, graph: nn.Module, options: SegmentationOptions, losses: Losses, *, input_scale: float = 1.0
    ) -> None:
        """Wraps a graph.

        Args:
            graph: as above.
            options: as given by the user.
            losses: of the network in training.
            input_scale: used where the options leave it open.
        """
        super().__init__(graph, options, views=(VIEW,))
        self.input_scale = input_scale if options.input_scale is None else options.input_scale
        self.normalise = Normalise().to(self.device).eval()
        self._losses = losses

    def taps(self) -> Mapping[str, nn.Module]:
        """The graph's own."""
        taps: Mapping[str, nn.Module] = self.graph.taps()  # type: ignore[operator]
        return taps

    def run(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """`logits`: (B, 19, H, W), by train id."""
        picture = pictures[VIEW]
        return {LOGITS: self._resized(self._maps(picture, auxiliary=False)[0], picture.shape[2:])}

    def run_for_answers(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """On a CPU `maps`: the logits as the graph gives them, which are quicker to answer from."""
        if self.device.type != "cpu":
            return self.run(pictures)
        return {MAPS: self._maps(pictures[VIEW], auxiliary=False)[0]}

    def run_for_losses(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """The same, and `auxiliary_0` and so on of the same shape; while the graph is being trained, at the pixels of
        `gear.networks.segmentation.losses.sampled_logits` alone."""
        size_px, align = pictures[VIEW].shape[2:], bool(self.graph.align_corners)
        maps = self._maps(pictures[VIEW], auxiliary=True)
        if self.graph.training:
            main, *others = (sampled_logits(m.float(), size_px, align_corners=align) for m in maps)
        else:
            main, *others = (self._resized(m, size_px) for m in maps)
        return {LOGITS: main} | {f"{AUXILIARY}_{index}": other for index, other in enumerate(others)}

    def losses(self, outputs: Mapping[str, Tensor], targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """As the network's recipe has them."""
        return self._losses(outputs, targets)

    def answers(self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...]) -> Sequence[Any]:
        """(H, W) uint8 label ids of each picture."""
        if LOGITS in outputs:
            return [LABEL_IDS[best_class(logits)] for logits in outputs[LOGITS]]
        align = bool(self.graph.align_corners)
        return [LABEL_IDS[best_class_at(maps, size_px, align_corners=align)] for maps in outputs[MAPS]]

    def _maps(self, pictures: Tensor, *, auxiliary: bool) -> list[Tensor]:
        """The heads' logits, smaller than the picture; class by class in memory, whichever way the graph has them."""
        size_px = pictures.shape[2:]
        inner_px = inner_size(size_px, self.input_scale)
        if inner_px != tuple(size_px):
            pictures = functional.interpolate(
                pictures, size=inner_px, mode="bilinear", align_corners=False, antialias=True
            )
        return [maps.contiguous() for maps in self.graph(self.normalise(pictures), auxiliary=auxiliary)]

    def _resized(self, maps: Tensor, size_px: Sequence[int]) -> Tensor:
        align = bool(self.graph.align_corners)
        return functional.interpolate(maps.float(), size=tuple(size_px), mode="bilinear", align_corners=align)


def inner_size(size_px: Sequence[int], scale: float) -> tuple[int, ...]:
    """Height and width that a network runs at: scaled, to the nearest multiple of its stride, at least one of it."""
    return tuple(max(1, round(side * scale / STRIDE_PX)) * STRIDE_PX for side in size_px)
