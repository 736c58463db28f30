"""NutNet (Lin et al., "I Don't Know You, But I Can Catch You", CCS 2024): masks what an autoencoder cannot reconstruct.

It follows the authors' code for inference (patchFilter.py, blocks of 13 pixels); the calibration trains the
autoencoder. There are four deviations:

- The authors' training code is not published. `block_autoencoder.train` describes the training.
- The authors train on a large set of photographs, and a calibration has a few dozen pictures of the user's data.
- The authors choose the threshold of blocks for each detector; here the calibration chooses it.
- The authors' pictures are squares. Here pictures keep their shape, and the mask is enlarged to the full picture.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from gear.contracts.defenses import FitReport
from gear.contracts.models import Model
from gear.plugins.defenses.masking.block_autoencoder import BLOCK_PX, BlockAutoencoder, blocks_of, joined, train
from gear.plugins.defenses.masking.mask_and_fill import Located, MaskAndFill
from gear.plugins.defenses.masking.mask_iou import MaskIou, overlap_problems
from gear.plugins.defenses.masking.nutnet_options import NutNetConfig
from gear.plugins.defenses.masking.visible_patches import visible_patches
from gear.values.errors import GearError
from gear.values.frames import UInt8Image

Views = Mapping[str, UInt8Image]

AUTHORS_THRESHOLD = 0.125
"""Mean squared error of a block above which it is suspicious (the authors' value for YOLOv2 and YOLOv3)."""

CANDIDATES = np.geomspace(0.005, 0.5, 24)
"""Thresholds of blocks among which the calibration chooses, in addition to the authors' one."""

SOFTNESS = 0.25
"""Width of the soft thresholds of the gradient, as a share of the threshold."""

GREY = 128
"""Grey level of the replaced pixels: 0 in the autoencoder's range -1..1."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class NutNetState:
    """The state of NutNet after calibration.

    Attributes:
        network: the trained autoencoder.
        threshold: mean squared error of a block above which it is suspicious.
        report: numbers on the calibration, for the user.
    """

    network: BlockAutoencoder
    threshold: float
    report: FitReport

    def fit_report(self) -> FitReport:
        """Returns numbers on the calibration: the mean squared error of clean blocks (`clean_error`), the threshold of
        blocks, and the share of the clean pictures that is masked. With patched pictures, `patch_error` is the mean
        squared error of pixels on patches, and `mask_iou` the overlap of the masks with the patches.
        """
        return self.report


class NutNet(MaskAndFill):
    """The defense NutNet: pixels with large errors of reconstruction, in blocks with large errors, become grey.

    Args:
        settings: options of the defense.
    """

    def __init__(self, settings: NutNetConfig) -> None:
        self._settings = settings

    def fit(
        self, clean: Sequence[Views], patched: Sequence[Views], model: Model | None, rng: np.random.Generator
    ) -> NutNetState:
        """Trains the autoencoder on clean pictures, and chooses the threshold of blocks with the patched pictures.

        Args:
            clean: pictures without a patch, (H, W, 3) uint8 by camera name, one mapping per sample.
            patched: pictures of the same scenes with a patch, in the same order; empty for the authors' threshold.
            model: not used.
            rng: random generator of the training.

        Raises:
            GearError: there are no clean pictures, or clean and patched pictures show different scenes.
        """
        if not len(clean):
            raise GearError("nutnet learns from clean pictures: --calibration has no samples")
        most = self._settings.max_pictures
        numbers = np.unique(np.linspace(0, len(clean) - 1, min(most, len(clean))).round().astype(int))
        pictures = [self._reduced(_tensor(one))[0] for number in numbers for one in clean[int(number)].values()]
        network = train(pictures, steps=self._settings.steps, rng=rng)
        errors = [self._errors(picture[None], network) for picture in pictures]
        values = {"pictures": float(len(pictures)), "clean_error": float(np.mean([one[0].mean() for one in errors]))}
        threshold, problems = self._settings.coarse_threshold or AUTHORS_THRESHOLD, tuple[str, ...]()
        if len(patched):
            pairs = visible_patches(clean, patched, most, "nutnet")
            threshold, found = self._chosen(network, [(picture, area) for _, picture, area in pairs])
            values |= found
            problems = overlap_problems("nutnet", found["mask_iou"])
        values["threshold"] = threshold
        masked = [float(self._is_masked(coarse, fine, threshold).float().mean()) for coarse, fine in errors]
        values["masked_share_of_clean"] = float(np.mean(masked))
        return NutNetState(network=network, threshold=threshold, report=FitReport(values=values, problems=problems))

    def locate(self, picture: UInt8Image, state: NutNetState) -> Located:
        """Returns the (H, W) bool mask of the pixels with large errors in suspicious blocks.

        Args:
            picture: (H, W, 3) uint8 sRGB.
            state: result of the calibration.
        """
        with torch.no_grad():
            coarse, fine = self._errors(self._reduced(_tensor(picture)), state.network)
        return _enlarged(self._is_masked(coarse, fine, state.threshold), *picture.shape[:2])

    def locate_tensor(self, pictures: Tensor, state: NutNetState) -> Tensor:
        """Returns (B, H, W) products of two soft thresholds: that of the block's error and that of the pixel's error.

        Args:
            pictures: (B, 3, H, W) in 0..1.
            state: result of the calibration.
        """
        coarse, fine = self._errors(self._reduced(pictures), state.network.to(pictures.device))
        soft = _soft(coarse, state.threshold) * _soft(fine, self._settings.fine_threshold)
        return functional.interpolate(soft[:, None], size=pictures.shape[2:], mode="nearest-exact")[:, 0]

    def fill(self, picture: UInt8Image, located: Located) -> UInt8Image:
        """Returns the picture with the located pixels in grey.

        Args:
            picture: (H, W, 3) uint8 sRGB.
            located: (H, W) bool mask of the pixels to replace.
        """
        return np.where(located[..., None], np.uint8(GREY), picture)

    def forward(self, views: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Always fails, because NutNet needs the calibrated state; `forward_fitted` takes it.

        Args:
            views: not used.

        Raises:
            ValueError: always.
        """
        raise ValueError("NutNet is calibrated: it has `forward_fitted`")

    def _chosen(
        self, network: BlockAutoencoder, pairs: Sequence[tuple[UInt8Image, Located]]
    ) -> tuple[float, dict[str, float]]:
        """The threshold of blocks with the best mask on patched pictures, or that of the options; with numbers for the
        report.
        """
        fixed = self._settings.coarse_threshold
        candidates = [AUTHORS_THRESHOLD, *CANDIDATES.tolist()] if fixed is None else [fixed]
        overlaps, errors = [MaskIou() for _ in candidates], []
        for picture, area in pairs:
            with torch.no_grad():
                coarse, fine = self._errors(self._reduced(_tensor(picture)), network)
            for overlap, candidate in zip(overlaps, candidates, strict=True):
                overlap.update(_enlarged(self._is_masked(coarse, fine, candidate), *area.shape), area)
            errors.append(float(_full_size(coarse, *area.shape)[area].mean()))
        best = int(np.argmax([one.value for one in overlaps]))
        return float(candidates[best]), {"patch_error": float(np.mean(errors)), "mask_iou": overlaps[best].value}

    def _is_masked(self, coarse: Tensor, fine: Tensor, threshold: float) -> Tensor:
        return (coarse > threshold) & (fine > self._settings.fine_threshold)

    def _errors(self, pictures: Tensor, network: BlockAutoencoder) -> tuple[Tensor, Tensor]:
        """Two (B, h, w) maps: the mean squared error of each pixel's block, and the sum of the absolute errors of the
        pixel's channels.

        Args:
            pictures: (B, 3, h, w) in -1..1.
            network: the autoencoder.
        """
        batch, _, height, width = pictures.shape
        blocks = blocks_of(pictures)
        difference = network(blocks) - blocks
        coarse = difference.square().mean(dim=(1, 2, 3))[:, None, None].expand(-1, BLOCK_PX, BLOCK_PX)
        fine = difference.abs().sum(dim=1)
        return joined(coarse, batch, height, width), joined(fine, batch, height, width)

    def _reduced(self, pictures: Tensor) -> Tensor:
        """The (B, 3, h, w) pictures at the autoencoder's resolution, in -1..1.

        Args:
            pictures: (B, 3, H, W) in 0..1.
        """
        height, width = pictures.shape[2:]
        scale = min(1.0, self._settings.width_px / width)
        size = max(BLOCK_PX, round(height * scale)), max(BLOCK_PX, round(width * scale))
        return 2 * functional.interpolate(pictures, size=size, mode="bilinear", align_corners=False, antialias=True) - 1


def _tensor(picture: UInt8Image) -> Tensor:
    """The (1, 3, H, W) picture in 0..1."""
    return torch.from_numpy(picture.copy()).permute(2, 0, 1)[None].float() / 255


def _soft(error: Tensor, threshold: float) -> Tensor:
    return torch.sigmoid((error - threshold) / (SOFTNESS * threshold))


def _full_size(small: Tensor, height: int, width: int) -> np.ndarray:
    """The (height, width) values of a (1, h, w) map, nearest neighbour."""
    size = (height, width)
    found: np.ndarray = functional.interpolate(small[:, None].float(), size, mode="nearest-exact")[0, 0].numpy()
    return found


def _enlarged(small: Tensor, height: int, width: int) -> Located:
    return _full_size(small, height, width) > 0.5
