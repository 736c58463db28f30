"""The arguments of a check."""

from __future__ import annotations

from typing import Any

import pytest

from gear.values.errors import GearError
from gear.verbs.leaderboard.request import CheckRequest


@pytest.mark.parametrize(
    "arguments", [{"samples": 0}, {"fresh": -1}, {"seed": -1}, {"most_pictures": 0}, {"commitment": "x"}]
)
def test_odd_arguments_are_refused(arguments: Any) -> None:
    with pytest.raises(GearError):
        CheckRequest(record="a.json", work="work", **arguments)
