"""Options of the detectors. No torch here: specs are cheap."""

from __future__ import annotations

from dataclasses import dataclass

from gear.networks.options import LARGEST_SCALE, NetworkOptions
from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorOptions(NetworkOptions):
    """What every detector can be told.

    Attributes:
        least_score: detections that are less sure are dropped.
    """

    least_score: float = 0.05

    def __post_init__(self) -> None:
        if not 0 <= self.least_score <= 1:
            raise FieldError("least_score", f"must be 0 to 1, got {self.least_score:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class OfficialDetectorOptions(DetectorOptions):
    """Options of the published detectors.

    Attributes:
        min_size_px: pictures are resized until their shorter side has this many pixels ...
        max_size_px: ... unless the longer one would have more than this many.
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
    """Options of the detectors that gear trains.

    Attributes:
        input_scale: the network runs at this share of the picture's width and height. null takes what the weights were
            trained for, or 0.5 where they do not say.
    """

    input_scale: float | None = None

    def __post_init__(self) -> None:
        DetectorOptions.__post_init__(self)
        if self.input_scale is not None and not 0 < self.input_scale <= LARGEST_SCALE:
            raise FieldError("input_scale", f"must be above 0 and at most {LARGEST_SCALE:g}, got {self.input_scale:g}")
