"""Converts metrics to JSON values."""

from __future__ import annotations

import math
from collections.abc import Mapping

from gear.values.serial import Json


def known_json(metrics: Mapping[str, float]) -> Json:
    """Converts metrics by name to JSON; NaN and infinite values become null, because JSON cannot represent them."""
    return {name: float(value) if math.isfinite(value) else None for name, value in metrics.items()}
