"""Requests that are made from parsed flags."""

from __future__ import annotations

from argparse import Namespace

import pytest

from gear.cli.requests import guard_of, request_of
from gear.values.errors import GearError
from gear.verbs.evaluate.request import EvaluateRequest


def test_fields_take_the_flags_of_their_names_and_keep_defaults_for_others() -> None:
    args = Namespace(data=["a", "b"], model="net", seed=None, workers=3, verbose=True, split="val")
    request = request_of(EvaluateRequest, args, split="test")
    assert (request.data, request.model) == (("a", "b"), "net")
    assert (request.workers, request.seed, request.split) == (3, 0, "test")


def test_values_that_contradict_each_other_are_refused() -> None:
    with pytest.raises(GearError, match="batch and workers must be at least 1"):
        request_of(EvaluateRequest, Namespace(data=["a"], model="net", workers=0))


def test_a_guard_needs_a_defense() -> None:
    nothing = {"defense": None, "defense_settings": [], "calibration": None, "calibration_patched": None}
    assert guard_of(Namespace(**nothing)) is None
    guard = guard_of(Namespace(**{**nothing, "defense": "jpeg", "defense_settings": ["quality=3"]}))
    assert guard is not None
    assert (guard.defense, tuple(guard.settings)) == ("jpeg", ("quality=3",))
    with pytest.raises(GearError):
        guard_of(Namespace(**{**nothing, "defense_settings": ["quality=3"]}))
