"""The arguments of attacks on drives."""

from __future__ import annotations

from typing import Any

import pytest

from gear.values.errors import GearError
from gear.verbs.attack.drives.request import DriveAttackRequest


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"queries": 1}, "queries must be at least 2"),
        ({"steps": 0}, "steps must be at least 1"),
        ({"redrive": 0}, "redrive must be at least 1"),
        ({"frames": -1}, "frames must be at least 1"),
        ({"held_out": -1}, "0 to 10000"),
        ({"seed": -1}, "seed"),
    ],
)
def test_numbers_out_of_range(changes: dict[str, Any], problem: str) -> None:
    with pytest.raises(GearError, match=problem):
        DriveAttackRequest(drive="quick", out="x", **changes)
