from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gear.verbs.drive.chart import chart, from_start


def log(speed_mps: float, crash: dict[str, Any] | None = None) -> list[Any]:
    frames = [
        {"ego": [speed_mps * n / 10, 0.0, 0.0, 0.0], "speed_mps": speed_mps, "time_s": n / 10,
         "actors": [[2, 20.0, n / 10, 0.0, 1.0]]}
        for n in range(20)
    ]  # fmt: skip
    return [{"scripted_id": 2}, *frames, {"crash": crash}]


def test_equal_logs_give_equal_charts_with_one_way_per_twin() -> None:
    logs = {"none": log(8.0), "random": log(8.0), "patch": log(10.0, {"kind": "person"})}
    drawn = chart(logs)
    assert drawn == chart(logs) and drawn.startswith(b"<?xml")
    assert drawn.count(b"#b3402a") > drawn.count(b"#2f7d4f") > 0, "the crashed twin has a cross as well"
    assert drawn != chart({**logs, "patch": log(8.0)})


def test_the_frame_of_the_start() -> None:
    points = from_start([10.0, 5.0, 0.0, math.pi / 2], [[10.0, 8.0], [9.0, 5.0]])
    assert points == pytest.approx(np.array([[3.0, 0.0], [0.0, 1.0]]))
