"""Options of the detectors. The module does not import torch, so plugin specs load quickly."""

from __future__ import annotations

from dataclasses import dataclass

from gear.networks.options import LARGEST_SCALE, NetworkOptions
from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorOptions(NetworkOptions):
    """Options that every detector has. They include the options of `NetworkOptions`.

    Attributes:
        score_threshold: smallest score, 0..1, of a detection that is reported.
    """

    score_threshold: float = 0.05

    def __post_init__(self) -> None:
        if not 0 <= self.score_threshold <= 1:
            raise FieldError("score_threshold", f"must be 0 to 1, got {self.score_threshold:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class OfficialDetectorOptions(DetectorOptions):
    """Options of the detectors with published weights. They include the options of `DetectorOptions`.

    Attributes:
        min_size_px: pictures are resized so that their shorter side has this many pixels.
        max_size_px: upper limit of the longer side; it overrules `min_size_px`.
    """

    min_size_px: int = 800
    max_size_px: int = 1333

    def __post_init__(self) -> None:
        DetectorOptions.__post_init__(self)
        for name in ("min_size_px", "max_size_px"):
            if getattr(self, name) < 1:
                raise FieldError(name, f"must be at least 1 px, got {getattr(self, name)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceDetectorOptions(DetectorOptions):
    """Options of the detectors that were trained on gear's own data. They include the options of
    `DetectorOptions`.

    Attributes:
        input_scale: factor by which pictures are resized before the network. null takes the factor with which the
            weights were trained, or 0.5 if they state none.
    """

    input_scale: float | None = None

    def __post_init__(self) -> None:
        DetectorOptions.__post_init__(self)
        if self.input_scale is not None and not 0 < self.input_scale <= LARGEST_SCALE:
            raise FieldError("input_scale", f"must be above 0 and at most {LARGEST_SCALE:g}, got {self.input_scale:g}")
