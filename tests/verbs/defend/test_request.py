"""Requests of `gear defend`."""

from __future__ import annotations

import pytest

from gear.values.errors import GearError
from gear.verbs.defend.request import DefendRequest


def test_a_negative_seed_is_refused() -> None:
    assert DefendRequest(dataset="d", defense="jpeg", out="o").seed == 0
    with pytest.raises(GearError, match="seed"):
        DefendRequest(dataset="d", defense="jpeg", out="o", seed=-1)
