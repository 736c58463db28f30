"""Metrics as JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping

from gear.values.serial import Json


def known_json(metrics: Mapping[str, float]) -> Json:
    """Metrics by name; values that are not finite become null, because JSON has no number for them."""
    return {name: float(value) if math.isfinite(value) else None for name, value in metrics.items()}
