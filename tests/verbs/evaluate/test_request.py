"""Requests of an evaluation."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.measuring.guard import Guard
from gear.values.errors import GearError
from gear.verbs.evaluate.request import EvaluateRequest


@pytest.mark.parametrize(
    ("values", "message"), [({"batch": 0}, "batch"), ({"workers": 0}, "workers"), ({"seed": -1}, "seed")]
)
def test_numbers_out_of_range_are_refused(values: dict[str, int], message: str) -> None:
    with pytest.raises(GearError, match=message):
        EvaluateRequest(data=("d",), model="net", **values)


def test_the_folder_names_task_model_and_defense() -> None:
    assert EvaluateRequest(data=("d",), model="pkg/net").folder("depth") == Path("evaluations/depth/pkg-net")
    guarded = EvaluateRequest(data=("d",), model="net", guard=Guard.of("jpeg", (), None, None))
    assert guarded.folder("depth") == Path("evaluations/depth/net+jpeg")
    assert EvaluateRequest(data=("d",), model="net", out="o").folder("depth") == Path("o")
