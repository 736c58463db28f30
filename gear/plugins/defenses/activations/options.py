"""Options that several defenses with a detection score share."""

from __future__ import annotations

from dataclasses import dataclass

from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class AlarmConfig:
    """The option that sets how often a defense raises a false alarm; an alarm is a score above 0.5.

    Attributes:
        false_alarms: share of clean calibration pictures whose score may exceed 0.5.
    """

    false_alarms: float = 0.05

    def __post_init__(self) -> None:
        if not 0 < self.false_alarms < 1:
            raise FieldError("false_alarms", f"must be between 0 and 1, got {self.false_alarms:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorConfig(AlarmConfig):
    """Options of a defense that computes its score from one feature map. They include the options of
    `AlarmConfig`.

    Attributes:
        layer: name of the model's feature map that is read; empty for the deepest one.
    """

    layer: str = ""
