"""SAC, Segment and Complete (Liu et al., CVPR 2022): a U-Net segments patches, and masks are completed.

It follows the authors' code (patch_detector.py, train_coco.py); the segmenter is trained by the calibration.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from gear.contracts.defenses import FitReport
from gear.contracts.models import Model
from gear.plugins.defenses.masking.mask_and_fill import Located, MaskAndFill
from gear.plugins.defenses.masking.mask_iou import MaskIou, overlap_problems
from gear.plugins.defenses.masking.sac_options import SacConfig
from gear.plugins.defenses.masking.segmenter import SegmenterNetwork, train
from gear.plugins.defenses.masking.shape_completion import completed
from gear.plugins.defenses.masking.visible_patches import visible_patches
from gear.values.errors import GearError
from gear.values.frames import UInt8Image

Views = Mapping[str, UInt8Image]

COVERED_FROM = 0.5
"""Probability above which a pixel belongs to the mask."""

HELD_OUT = 4
"""One in this number of calibration pictures is not trained on; the report measures the mask on it."""

LEAST_PX = 16
"""Smallest side of the segmenter's input, which it halves four times."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SacState:
    """The state of SAC after calibration.

    Attributes:
        network: the trained segmenter.
        sizes: heights and widths of the rectangles to which masks are completed, in pixels of the reduced picture.
        report: numbers on the calibration, for the user.
    """

    network: SegmenterNetwork
    sizes: tuple[tuple[int, int], ...]
    report: FitReport

    def fit_report(self) -> FitReport:
        """Returns numbers on the calibration: the IoU of the masks with the true ones on the pictures of the training
        (`mask_iou`) and on those that were held out (`mask_iou_held_out`).
        """
        return self.report


class Sac(MaskAndFill):
    """The defense SAC: segments patches, completes the mask to rectangles, and covers it in black.

    Completion is conservative: it is the union of all rectangles that are close to the mask, so that it covers the
    patch and a margin around it.

    Args:
        settings: options of the defense.
    """

    def __init__(self, settings: SacConfig) -> None:
        self._settings = settings

    def fit(
        self, clean: Sequence[Views], patched: Sequence[Views], model: Model | None, rng: np.random.Generator
    ) -> SacState:
        """Trains the segmenter on three quarters of the calibration pictures, and measures it on all.

        Args:
            clean: pictures without a patch, (H, W, 3) uint8 by camera name, one mapping per sample.
            patched: pictures of the same scenes with a patch, in the same order.
            model: not used.
            rng: random generator of the training.

        Raises:
            GearError: there are no pictures, clean and patched pictures show different scenes, or no patch is visible.
        """
        pairs = visible_patches(clean, patched, self._settings.max_pictures, "sac")
        truths = [self._reduced_mask(area) for _, _, area in pairs]
        is_held_out = [i % HELD_OUT == HELD_OUT - 1 for i in range(len(pairs))]
        seen = [i for i, truth in enumerate(truths) if not is_held_out[i] and bool(truth.any())]
        if not seen:
            raise GearError("patches are too small in the reduced calibration pictures: raise width_px of sac")
        network = train(
            [self._reduced(_tensor(pairs[i][0]))[0] for i in seen],
            [self._reduced(_tensor(pairs[i][1]))[0] for i in seen],
            [truths[i] for i in seen],
            filters=self._settings.filters,
            steps=self._settings.steps,
            rng=rng,
        )
        state = SacState(network=network, sizes=_sizes([truths[i] for i in seen]), report=FitReport(values={}))
        own, held_out = MaskIou(), MaskIou()
        for i, (_, picture, area) in enumerate(pairs):
            (held_out if is_held_out[i] else own).update(self.locate(picture, state), area)
        values = {"pictures": float(len(seen)), "mask_iou": own.value}
        if len(pairs) >= HELD_OUT:
            values["mask_iou_held_out"] = held_out.value
        return replace(state, report=FitReport(values=values, problems=overlap_problems("sac", own.value)))

    def locate(self, picture: UInt8Image, state: SacState) -> Located:
        """Returns the (H, W) bool mask of the segmenter; each region is completed to a rectangle of a known patch size
        if the option `completes_shape` is set.

        Args:
            picture: (H, W, 3) uint8 sRGB.
            state: result of the calibration.
        """
        with torch.no_grad():
            small = self._probabilities(_tensor(picture), state)[0].numpy() > COVERED_FROM
        mask = completed(small, state.sizes) if self._settings.completes_shape and small.any() else small
        size = picture.shape[1::-1]
        return np.asarray(cv2.resize(mask.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST_EXACT)) > 0

    def locate_tensor(self, pictures: Tensor, state: SacState) -> Tensor:
        """Returns (B, H, W) probabilities of the segmenter, before completion.

        Args:
            pictures: (B, 3, H, W) in 0..1.
            state: result of the calibration.
        """
        small = self._probabilities(pictures, state)
        return functional.interpolate(small[:, None], size=pictures.shape[2:], mode="nearest-exact")[:, 0]

    def fill(self, picture: UInt8Image, located: Located) -> UInt8Image:
        """Returns the picture with the located pixels in black.

        Args:
            picture: (H, W, 3) uint8 sRGB.
            located: (H, W) bool mask of the pixels to replace.
        """
        return np.where(located[..., None], np.uint8(0), picture)

    def forward(self, views: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Always fails, because SAC needs the calibrated state; `forward_fitted` takes it.

        Args:
            views: not used.

        Raises:
            ValueError: always.
        """
        raise ValueError("SAC is calibrated: it has `forward_fitted`")

    def _probabilities(self, pictures: Tensor, state: SacState) -> Tensor:
        network = state.network.to(pictures.device)
        return torch.sigmoid(network(self._reduced(pictures)))

    def _reduced(self, pictures: Tensor) -> Tensor:
        """The (B, 3, h, w) pictures at the segmenter's resolution."""
        size = self._size(pictures.shape[2], pictures.shape[3])
        return functional.interpolate(pictures, size=size, mode="bilinear", align_corners=False, antialias=True)

    def _reduced_mask(self, area: Located) -> Tensor:
        height, width = self._size(*area.shape)
        small = cv2.resize(area.astype(np.float32), (width, height), interpolation=cv2.INTER_AREA)
        return torch.from_numpy((small > COVERED_FROM).astype(np.float32))

    def _size(self, height: int, width: int) -> tuple[int, int]:
        scale = min(1.0, self._settings.width_px / width)
        return max(LEAST_PX, round(height * scale)), max(LEAST_PX, round(width * scale))


def _tensor(picture: UInt8Image) -> Tensor:
    """The (1, 3, H, W) picture in 0..1."""
    return torch.from_numpy(picture.copy()).permute(2, 0, 1)[None].float() / 255


def _sizes(truths: Sequence[Tensor]) -> tuple[tuple[int, int], ...]:
    """Heights and widths of the completing rectangles: the largest patch, and three quarters, half and a quarter of it.

    The authors' squares of 100, 75, 50 and 25 pixels have the same proportions to their patches of 100 pixels.
    """
    boxes = [one.nonzero() for one in truths]
    spans = [(pixels.amax(dim=0) - pixels.amin(dim=0) + 1).tolist() for pixels in boxes]
    height, width = max(spans, key=lambda span: span[0] * span[1])
    shares = (1.0, 0.75, 0.5, 0.25)
    return tuple(dict.fromkeys((max(1, round(height * one)), max(1, round(width * one))) for one in shares))
