"""Jedi (Tarchoun et al., CVPR 2023): locates patches by their local entropy, and inpaints them.

It follows the authors' MATLAB code (jedi.m, autoencoder_train.m).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np
import numpy.typing as npt

from gear.contracts.defenses import FitReport
from gear.contracts.models import Model
from gear.plugins.defenses.masking import shape_autoencoder
from gear.plugins.defenses.masking.entropy import (
    grey_levels,
    soft_window_entropies,
    to_pixels,
    window_entropies,
    window_of_pixels,
    window_sides,
)
from gear.plugins.defenses.masking.jedi_options import JediConfig
from gear.plugins.defenses.masking.mask_and_fill import Located, MaskAndFill
from gear.plugins.defenses.masking.mask_iou import MaskIou, overlap_problems
from gear.plugins.defenses.masking.visible_patches import visible_patches
from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor

Views = Mapping[str, UInt8Image]
Floats = npt.NDArray[np.float32]

SOFTNESS_BITS = 0.1
"""Entropy above the threshold at which the soft mask is 0.73."""

LEAST_DEVIATION = 1e-3
"""Smallest standard deviation of entropies in bits; pictures of one colour would otherwise have none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EntropyStatistics:
    """Mean and standard deviation of the entropies of windows of one size, in bits.

    Attributes:
        patch_mean, patch_deviation: of windows that show a patch.
        clean_mean, clean_deviation: of windows of clean pictures.
    """

    patch_mean: float
    patch_deviation: float
    clean_mean: float
    clean_deviation: float

    def threshold(self, mean: float) -> float:
        """Returns the entropy in bits above which a window is taken for a patch (jedi.m).

        Args:
            mean: mean entropy of all windows of the picture.
        """
        contrast = 2 * (self.patch_mean - self.clean_mean) / self.patch_mean
        base = self.patch_mean + 1.5 * self.patch_deviation - contrast * self.patch_deviation
        return base + (mean - self.clean_mean) / self.clean_deviation * self.patch_deviation


PUBLISHED = (
    EntropyStatistics(patch_mean=5.32, patch_deviation=0.32, clean_mean=2.75, clean_deviation=1.16),
    EntropyStatistics(patch_mean=6.06, patch_deviation=0.34, clean_mean=3.19, clean_deviation=1.13),
    EntropyStatistics(patch_mean=6.47, patch_deviation=0.35, clean_mean=3.47, clean_deviation=1.07),
)
"""The authors' constants for the three window sizes, measured on photographs (Pascal VOC 2007) with patches."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class JediState:
    """The state of Jedi after calibration.

    Attributes:
        statistics: entropies of patches and of clean pictures for the three window sizes.
        autoencoder: completes masks; None without patched calibration pictures.
        report: numbers on the calibration, for the user.
    """

    statistics: tuple[EntropyStatistics, ...]
    autoencoder: shape_autoencoder.ShapeAutoencoder | None
    report: FitReport

    def fit_report(self) -> FitReport:
        """Returns numbers on the calibration: mean entropies of the smallest windows on patches and on clean pictures,
        and the IoU of the masks with the true ones on the calibration pictures: as they are used, and without the
        autoencoder for published and for measured statistics.
        """
        return self.report


UNCALIBRATED = JediState(statistics=PUBLISHED, autoencoder=None, report=FitReport(values={}))


class Jedi(MaskAndFill):
    """The defense Jedi: locates pixels in windows of high entropy, completes the mask, and inpaints it.

    A window is located if its entropy exceeds a threshold that rises with the picture's mean entropy. The mask is the
    union over three window sizes, without components below 0.5 % of the picture (jedi.m). An autoencoder that was
    trained on masks of patches completes it.

    Args:
        settings: options of the defense.
    """

    def __init__(self, settings: JediConfig) -> None:
        self._settings = settings

    def fit(
        self, clean: Sequence[Views], patched: Sequence[Views], model: Model | None, rng: np.random.Generator
    ) -> JediState:
        """Chooses the entropy statistics, and trains the autoencoder on the true masks.

        The authors' threshold lies above the mean entropy of their patches, so statistics of other patches may suit it
        less than the authors' own. The calibration therefore keeps those, published or measured here, whose masks
        overlap the patches more.

        Args:
            clean: pictures without a patch, (H, W, 3) uint8 by camera name, one mapping per sample.
            patched: pictures of the same scenes with a patch, in the same order.
            model: not used.
            rng: random generator of the autoencoder's training.

        Raises:
            GearError: there are no pictures, clean and patched pictures show different scenes, or no patch is visible.
        """
        pairs = visible_patches(clean, patched, self._settings.max_pictures, "jedi")
        entropies = [_entropies(picture) for _, picture, _ in pairs]
        areas = [area for _, _, area in pairs]
        measured = _statistics([clean for clean, _, _ in pairs], entropies, areas)
        published_iou, measured_iou = (self._iou(entropies, areas, one, None) for one in (PUBLISHED, measured))
        statistics = measured if measured_iou > published_iou else PUBLISHED
        trained = None
        if self._settings.autoencoder:
            trained = shape_autoencoder.train(
                areas,
                rows=self._settings.rows,
                hidden=self._settings.hidden,
                epochs=self._settings.epochs,
                draws=self._settings.draws,
                rng=rng,
            )
        iou = self._iou(entropies, areas, statistics, trained)
        values = {
            "pictures": float(len(pairs)),
            "patch_bits": measured[0].patch_mean,
            "clean_bits": measured[0].clean_mean,
            "mask_iou": iou,
            "mask_iou_published_statistics": published_iou,
            "mask_iou_measured_statistics": measured_iou,
        }
        return JediState(
            statistics=statistics,
            autoencoder=trained,
            report=FitReport(values=values, problems=_problems(measured, iou)),
        )

    def locate(self, picture: UInt8Image, state: JediState | None) -> Located:
        """Returns the (H, W) bool mask of the pixels in windows of high entropy, completed by the autoencoder.

        Args:
            picture: (H, W, 3) uint8 sRGB.
            state: result of the calibration; None uses the authors' constants and no autoencoder.
        """
        used = state or UNCALIBRATED
        raw = self._raw(_entropies(picture), picture.shape[:2], used.statistics)
        return raw if used.autoencoder is None else used.autoencoder.complete(raw)

    def locate_tensor(self, pictures: Tensor, state: JediState | None) -> Tensor:
        """Returns (B, H, W) soft masks in 0..1 before completion: the sigmoid of the entropy above the threshold.

        The entropies are the exact ones; their gradients are those of a soft histogram, because a histogram has none.
        The largest value of the three window sizes counts.

        Args:
            pictures: (B, 3, H, W) in 0..1.
            state: result of the calibration; None uses the authors' constants.
        """
        import torch

        from gear.networks.runtime import as_bytes

        height, width = pictures.shape[2:]
        levels = as_bytes(pictures)
        masks = []
        for side, one in zip(window_sides(height, width), (state or UNCALIBRATED).statistics, strict=True):
            exact = np.stack([window_entropies(grey_levels(picture), side) for picture in levels])
            soft = soft_window_entropies(pictures, side)
            entropies = torch.from_numpy(exact).to(pictures) + soft - soft.detach()
            mean = entropies.mean(dim=(1, 2))
            base = one.threshold(0.0)
            threshold = base + mean * (one.patch_deviation / one.clean_deviation)
            mask = torch.sigmoid((entropies - threshold[:, None, None]) / SOFTNESS_BITS)
            rows = torch.from_numpy(window_of_pixels(height, side, mask.shape[1])).to(mask.device)
            columns = torch.from_numpy(window_of_pixels(width, side, mask.shape[2])).to(mask.device)
            masks.append(mask[:, rows][:, :, columns])
        return torch.stack(masks).amax(dim=0)

    def fill(self, picture: UInt8Image, located: Located) -> UInt8Image:
        """Returns the picture with the located pixels inpainted by fast marching (Telea, 2004).

        The authors use coherence transport (Bornemann and Maerz, 2007), which OpenCV does not have; both continue the
        colours at the border of the mask inwards, in the order of the distance from it.

        Args:
            picture: (H, W, 3) uint8 sRGB.
            located: (H, W) bool mask of the pixels to replace.
        """
        if not located.any():
            return picture.copy()
        if located.all():
            return np.full_like(picture, 128)  # nothing to continue inwards; the authors first set the mask to grey
        mask = located.astype(np.uint8)
        filled = cv2.inpaint(np.ascontiguousarray(picture), mask, self._settings.radius_px, cv2.INPAINT_TELEA)
        return np.asarray(filled, np.uint8)

    def _iou(
        self,
        entropies: Sequence[Sequence[Floats]],
        areas: Sequence[Located],
        statistics: Sequence[EntropyStatistics],
        autoencoder: shape_autoencoder.ShapeAutoencoder | None,
    ) -> float:
        """The IoU of estimated and true masks over the calibration pictures, 0..1."""
        total = MaskIou()
        for picture, area in zip(entropies, areas, strict=True):
            raw = self._raw(picture, area.shape, statistics)
            total.update(raw if autoencoder is None else autoencoder.complete(raw), area)
        return total.value

    def _raw(
        self, entropies: Sequence[Floats], size: tuple[int, ...], statistics: Sequence[EntropyStatistics]
    ) -> Located:
        """The mask of windows of high entropy, without small components, for the entropies of three window sizes."""
        height, width = size
        mask = np.zeros((height, width), np.bool_)
        for side, values, one in zip(window_sides(height, width), entropies, statistics, strict=True):
            located = (values > one.threshold(float(values.mean()))).astype(np.float32)
            mask |= to_pixels(located, height, width, side) > 0
        count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
        kept = np.zeros(count, np.bool_)
        kept[1:] = stats[1:, cv2.CC_STAT_AREA] >= self._settings.least_share * mask.size
        return np.asarray(kept[labels], np.bool_)


def _entropies(picture: UInt8Image) -> list[Floats]:
    """The entropies of the windows of a picture, for the three window sizes."""
    grey = grey_levels(picture)
    return [window_entropies(grey, side) for side in window_sides(*grey.shape)]


def _statistics(
    clean: Sequence[UInt8Image], entropies: Sequence[Sequence[Floats]], areas: Sequence[Located]
) -> tuple[EntropyStatistics, ...]:
    """Entropies of the windows of patched pictures that lie mostly on a patch, and of all windows of clean pictures."""
    of_clean = [_entropies(picture) for picture in clean]
    found = []
    for number, side in enumerate(window_sides(*areas[0].shape)):
        off_patch = [one[number].reshape(-1) for one in of_clean]
        on_patch = [one[number][_window_shares(area, side) > 0.9] for one, area in zip(entropies, areas, strict=True)]
        patches, others = np.concatenate(on_patch), np.concatenate(off_patch)
        if not patches.size:  # patches are smaller than the windows
            found.append(PUBLISHED[number])
            continue
        found.append(
            EntropyStatistics(
                patch_mean=max(float(patches.mean()), LEAST_DEVIATION),
                patch_deviation=max(float(patches.std()), LEAST_DEVIATION),
                clean_mean=float(others.mean()),
                clean_deviation=max(float(others.std()), LEAST_DEVIATION),
            )
        )
    return tuple(found)


def _window_shares(area: Located, side: int) -> Floats:
    """The share of each window of `window_entropies` that an area covers, (rows, columns) float32."""
    extended = np.pad(area, side // 2, mode="symmetric").astype(np.float32)
    means = cv2.boxFilter(extended, -1, (side + 1, side + 1))
    return np.asarray(means[side // 2 : -(side // 2) : side // 2, side // 2 : -(side // 2) : side // 2], np.float32)


def _problems(statistics: Sequence[EntropyStatistics], iou: float) -> tuple[str, ...]:
    """Reasons not to trust the calibration, one line each."""
    lines = []
    if statistics[0].patch_mean < statistics[0].clean_mean + statistics[0].clean_deviation:
        lines.append(
            f"jedi: the calibration patches have {statistics[0].patch_mean:.2f} bits of local entropy and clean "
            f"pictures {statistics[0].clean_mean:.2f}, which is less than a standard deviation apart"
        )
    return (*lines, *overlap_problems("jedi", iou))
