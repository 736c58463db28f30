"""What the options of detectors have in common."""

from __future__ import annotations

from dataclasses import dataclass

from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class AlarmConfig:
    """When a score is an alarm.

    Attributes:
        false_alarms: share of clean calibration pictures that shall score above 0.5.
    """

    false_alarms: float = 0.05

    def __post_init__(self) -> None:
        if not 0 < self.false_alarms < 1:
            raise FieldError("false_alarms", f"must be between 0 and 1, got {self.false_alarms:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorConfig(AlarmConfig):
    """Where a detector looks.

    Attributes:
        layer: feature map of the model to look at; empty takes the deepest.
    """

    layer: str = ""
