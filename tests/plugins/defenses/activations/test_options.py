"""Options of detectors and of Z-Mask."""

from __future__ import annotations

from typing import Any

import pytest

from gear.plugins.defenses.activations.options import AlarmConfig, DetectorConfig
from gear.plugins.defenses.activations.zmask_options import ZMaskConfig
from gear.values.errors import FieldError


@pytest.mark.parametrize("share", [0.0, 1.0, -0.1, float("nan")])
@pytest.mark.parametrize("config", [AlarmConfig, DetectorConfig, ZMaskConfig])
def test_a_share_of_false_alarms_lies_between_0_and_1(config: Any, share: float) -> None:
    with pytest.raises(FieldError, match="false_alarms: must be between 0 and 1"):
        config(false_alarms=share)
    assert config(false_alarms=0.2).false_alarms == 0.2


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"rows": 0}, "rows: must be at least 1, got 0"),
        ({"steps": 0}, "steps: must be at least 1"),
        ({"max_clean_pictures": 0}, "max_clean_pictures: must be at least 1"),
        ({"max_patched_pictures": 0}, "max_patched_pictures: must be at least 1"),
        ({"shallow_kernels": ()}, "shallow_kernels: must be one or more numbers from 1 to rows"),
        ({"deep_kernels": (0, 2)}, "deep_kernels: must be"),
        ({"rows": 10}, r"shallow_kernels: must be one or more numbers from 1 to rows \(10\)"),
    ],
)
def test_impossible_options_of_zmask_are_refused(values: dict[str, Any], message: str) -> None:
    with pytest.raises(FieldError, match=message):
        ZMaskConfig(**values)
