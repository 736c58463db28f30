"""Networks that give every pixel one of the 19 classes that Cityscapes evaluates."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from gear.formats.cityscapes import IGNORED_TRAIN_ID, LABELS
from gear.losses.semantic import sampled_logits
from gear.nn.network import Network, Normalise
from gear.nn.options import SegmentationOptions

VIEW = "left"
LOGITS = "logits"
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
        return {LOGITS: self._maps(pictures[VIEW], auxiliary=False)[0]}

    def run_for_losses(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """The same, and `auxiliary_0` and so on of the same shape; while the graph is being trained, at the pixels of
        `gear.losses.semantic.sampled_logits` alone."""
        main, *others = self._maps(pictures[VIEW], auxiliary=True, sampled=self.graph.training)
        return {LOGITS: main} | {f"{AUXILIARY}_{index}": other for index, other in enumerate(others)}

    def losses(self, outputs: Mapping[str, Tensor], targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """As the network's recipe has them."""
        return self._losses(outputs, targets)

    def answers(self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...]) -> Sequence[Any]:
        """(H, W) uint8 label ids of each picture."""
        return [LABEL_IDS[best_class(logits).cpu().numpy()] for logits in outputs[LOGITS]]

    def _maps(self, pictures: Tensor, *, auxiliary: bool, sampled: bool = False) -> list[Tensor]:
        """The heads' logits at the picture's size, or at some of its pixels."""
        size_px = pictures.shape[2:]
        inner_px = inner_size(size_px, self.input_scale)
        if inner_px != tuple(size_px):
            pictures = functional.interpolate(
                pictures, size=inner_px, mode="bilinear", align_corners=False, antialias=True
            )
        maps: list[Tensor] = self.graph(self.normalise(pictures), auxiliary=auxiliary)
        align = bool(self.graph.align_corners)
        if sampled:
            return [sampled_logits(m.float(), size_px, align_corners=align) for m in maps]
        return [functional.interpolate(m.float(), size=size_px, mode="bilinear", align_corners=align) for m in maps]


def best_class(logits: Tensor) -> Tensor:
    """(H, W) uint8: where (C, H, W) logits are largest, the first of equals.

    The same as `argmax(0)`, which reads memory across its order and takes five times as long on a CPU.
    """
    largest = logits[0].clone()
    best = torch.zeros(logits.shape[1:], dtype=torch.uint8, device=logits.device)
    for index in range(1, len(logits)):
        best.masked_fill_(logits[index] > largest, index)
        torch.maximum(largest, logits[index], out=largest)
    return best


def inner_size(size_px: Sequence[int], scale: float) -> tuple[int, ...]:
    """Height and width that a network runs at: scaled, to the nearest multiple of its stride, at least one of it."""
    return tuple(max(1, round(side * scale / STRIDE_PX)) * STRIDE_PX for side in size_px)
