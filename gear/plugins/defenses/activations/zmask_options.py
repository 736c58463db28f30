"""Options of the defense Z-Mask and their checks."""

from __future__ import annotations

from dataclasses import dataclass

from gear.plugins.defenses.activations.options import AlarmConfig
from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class ZMaskConfig(AlarmConfig):
    """Options of Z-Mask; the defaults are those of the authors' demonstration (BiSeNet, pictures of 2048 x 1024).
    They include the options of `AlarmConfig`.

    Attributes:
        shallow, deep: names of the model's feature maps. If empty, the calibration selects the maps that separate
            patches best, among those in the paper. For networks that the paper does not name, it selects among the
            first and the last map.
        rows: number of rows of the grid on which activations are compared.
        shallow_kernels, deep_kernels: rows of the pooling windows, large windows first; windows are twice as wide.
        max_clean_pictures: largest number of clean pictures from which statistics are computed.
        max_patched_pictures: largest number of pictures with patches on which the fusion block is calibrated.
        steps: number of training steps; the authors train for 250 passes over 100 pictures, 15 per step.
        only_on_alarm: whether pictures with a score of at most 0.5 are left unchanged.
    """

    shallow: tuple[str, ...] = ()
    deep: tuple[str, ...] = ()
    rows: int = 150
    shallow_kernels: tuple[int, ...] = (64, 32, 16, 8)
    deep_kernels: tuple[int, ...] = (64, 32)
    max_clean_pictures: int = 500
    max_patched_pictures: int = 50
    steps: int = 1750
    only_on_alarm: bool = False

    def __post_init__(self) -> None:
        AlarmConfig.__post_init__(self)
        for name in ("rows", "max_clean_pictures", "max_patched_pictures", "steps"):
            if getattr(self, name) < 1:
                raise FieldError(name, f"must be at least 1, got {getattr(self, name)}")
        for name in ("shallow_kernels", "deep_kernels"):
            kernels = getattr(self, name)
            if not kernels or min(kernels) < 1 or max(kernels) > self.rows:
                raise FieldError(name, f"must be one or more numbers from 1 to rows ({self.rows}), got {list(kernels)}")
