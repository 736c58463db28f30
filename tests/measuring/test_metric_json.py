"""Metrics as JSON."""

from __future__ import annotations

import json
import math

import numpy as np

from gear.measuring.metric_json import known_json


def test_numbers_that_are_not_finite_become_null() -> None:
    found = known_json({"a": np.float32(0.5), "b": math.nan, "c": -math.inf, "d": 3})
    assert found == {"a": 0.5, "b": None, "c": None, "d": 3.0}
    assert json.loads(json.dumps(found, allow_nan=False)) == found
