"""Requests of `gear gap` that contradict themselves are refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from gear.measuring.gap.request import GapRequest
from gear.measuring.guard import Guard
from gear.values.errors import GearError


def test_a_twin_is_given_or_collected() -> None:
    given = GapRequest(dataset="d", twin="t")
    assert (given.twin_root, given.folder) == (Path("t"), None)
    collected = GapRequest(dataset="d", patch="p.png", out="o")
    assert (collected.twin_root, collected.folder) == (Path("o/twin"), Path("o"))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({}, "say one of: --twin DIR"),
        ({"twin": "t", "patch": "p"}, "say one of: --twin DIR"),
        ({"twin": "t", "samples": 0}, "samples must be at least 1, got 0"),
        ({"twin": "t", "town": "my.xml"}, "--town and --scenes say what to render"),
        ({"patch": "p"}, "say where to with --out DIR"),
        ({"twin": "t", "guard": Guard.of("jpeg", (), None, None)}, "name one with --model"),
        ({"twin": "t", "model_settings": ("a=1",)}, "name it with --model"),
        ({"twin": "t", "seed": -1}, "seed"),
    ],
)
def test_contradictions_are_one_line(values: dict[str, Any], message: str) -> None:
    with pytest.raises(GearError, match=message):
        GapRequest(dataset="d", **values)
