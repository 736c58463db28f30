"""The base of gear's segmentation networks, which assign one of Cityscapes' 19 evaluated classes to every pixel."""

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
"""Prefix of the output names of the heads that only training uses: `auxiliary_0`, `auxiliary_1` and so on."""

STRIDE_PX = 8
"""Stride of the output maps in pixels; the sides of the network's input are multiples of this number."""

LABEL_ID_OF_TRAIN_ID = tuple(
    label.id for label in sorted(LABELS, key=lambda label: label.train_id) if label.train_id != IGNORED_TRAIN_ID
)
LABEL_IDS = np.array(LABEL_ID_OF_TRAIN_ID, dtype=np.uint8)
CLASSES = len(LABEL_IDS)

Losses = Callable[[Mapping[str, Tensor], Sequence[Any]], Mapping[str, Tensor]]
"""Type of a function from outputs and the batch's samples to scalar losses by name."""


class SemsegNetwork(Network):
    """A torch module for semantic segmentation (the graph) as a gear network.

    Pictures are resized by `input_scale` and then to the nearest multiple of 8 on each side (bilinear, with
    anti-aliasing when reducing). Nothing is cropped or padded, and logits are interpolated back to the picture's size.
    With `input_scale` 1, pictures whose sides are multiples of 8 are not resized.

    Attributes:
        graph: returns a list of maps (B, classes, h, w), the main head's first. Its `align_corners` states how the
            maps are interpolated, and its `taps()` returns modules by name.
        input_scale: factor by which pictures are resized before the network.
    """

    has_quick_copy = True

    def __init__(
        self, graph: nn.Module, options: SegmentationOptions, losses: Losses, *, input_scale: float = 1.0
    ) -> None:
        """Makes a gear network from the torch module of a segmentation network.

        Args:
            graph: torch module, as described for the class.
            options: options that the user gave.
            losses: function that computes the training losses by name, from the result of `run_for_losses` and the
                samples.
            input_scale: factor by which pictures are resized, used if the options state none; plugins pass that of the
                weights.
        """
        super().__init__(graph, options, views=(VIEW,))
        self.input_scale = input_scale if options.input_scale is None else options.input_scale
        self.normalise = Normalise().to(self.device).eval()
        self._losses = losses

    def taps(self) -> Mapping[str, nn.Module]:
        """The modules, by name, whose outputs are feature maps; the graph's own `taps()` provides them."""
        taps: Mapping[str, nn.Module] = self.graph.taps()  # type: ignore[operator]
        return taps

    def run(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the output `logits` (B, 19, H, W) at the picture's size; channels are in the order of Cityscapes
        train ids.

        Args:
            pictures: (B, 3, H, W) picture `left`, float in 0..1, on the network's device.
        """
        picture = pictures[VIEW]
        return {LOGITS: self._resized(self._maps(picture, auxiliary=False)[0], picture.shape[2:])}

    def run_for_predictions(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the input of `predictions`: on a CPU `maps`, the graph's smaller logit maps, from which
        predicting is faster; on a GPU `logits` at the picture's size.

        Args:
            pictures: (B, 3, H, W) picture `left`, float in 0..1, on the network's device.
        """
        if self.device.type != "cpu":
            return self.run(pictures)
        return {MAPS: self._maps(pictures[VIEW], auxiliary=False)[0]}

    def run_for_losses(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the input of `losses`: `logits`, and the logits `auxiliary_0` and so on of the auxiliary heads,
        with the same shape.

        In training mode logits are computed only at the pixels of `gear.networks.segmentation.losses.sampled_logits`.

        Args:
            pictures: (B, 3, H, W) picture `left`, float in 0..1, on the network's device.
        """
        size_px, align = pictures[VIEW].shape[2:], bool(self.graph.align_corners)
        maps = self._maps(pictures[VIEW], auxiliary=True)
        if self.graph.training:
            main, *others = (sampled_logits(m.float(), size_px, align_corners=align) for m in maps)
        else:
            main, *others = (self._resized(m, size_px) for m in maps)
        return {LOGITS: main} | {f"{AUXILIARY}_{index}": other for index, other in enumerate(others)}

    def losses(self, outputs: Mapping[str, Tensor], targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """The scalar losses by name, from the loss function with which the network was built.

        Args:
            outputs: result of `run_for_losses` for a batch of B samples, by name.
            targets: the B samples with their ground truth.
        """
        return self._losses(outputs, targets)

    def predictions(self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...]) -> Sequence[Any]:
        """The predicted (H, W) uint8 Cityscapes label ids of each picture.

        Args:
            outputs: result of `run_for_predictions` for a batch of B pictures, by name.
            size_px: height and width of the pictures.
        """
        if LOGITS in outputs:
            return [LABEL_IDS[best_class(logits)] for logits in outputs[LOGITS]]
        align = bool(self.graph.align_corners)
        return [LABEL_IDS[best_class_at(maps, size_px, align_corners=align)] for maps in outputs[MAPS]]

    def _maps(self, pictures: Tensor, *, auxiliary: bool) -> list[Tensor]:
        """The logits of all heads, smaller than the picture, in channels-first memory format."""
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
    """Returns height and width of the network's input: the picture's sides times a factor, rounded to multiples of
    `STRIDE_PX`, at least `STRIDE_PX`.

    Args:
        size_px: height and width of the picture.
        scale: the factor.
    """
    return tuple(max(1, round(side * scale / STRIDE_PX)) * STRIDE_PX for side in size_px)
