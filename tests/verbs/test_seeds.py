"""A seed below 0 is refused by whoever takes one, as configs refuse it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import gear
from gear.values.errors import GearError
from tests.verbs.conftest import Small


@pytest.mark.parametrize(
    "ask",
    [
        lambda data, out: gear.attack(data, model="ddrnet23_slim", out=out, seed=-1),
        lambda data, out: gear.evaluate(data, model="ddrnet23_slim", out=out, seed=-1),
        lambda data, out: gear.defend(data, defense="jpeg", out=out, seed=-1),
    ],
)
def test_nothing_is_begun(small: Small, tmp_path: Path, ask: Callable[[Path, Path], Any]) -> None:
    with pytest.raises(GearError, match=r"^seed must not be negative, got -1$"):
        ask(small("semseg"), tmp_path / "out")
    assert not (tmp_path / "out").exists()
