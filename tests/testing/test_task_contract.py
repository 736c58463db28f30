"""The task contract refuses what gear refuses."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from gear.plugins.tasks.depth import depth
from gear.testing.task_contract import TaskContract


@pytest.mark.parametrize(
    ("facts", "message"),
    [({"protocol": 0}, "speaks protocol 0"), ({"metric": 3}, "metric must be a str"), ({"summary": " "}, "summary")],
)
def test_the_contract_catches_a_spec_that_gear_refuses(facts: dict[str, Any], message: str) -> None:
    spec = dataclasses.replace(depth, **facts)
    with pytest.raises(AssertionError, match=message):
        type("Liar", (TaskContract,), {"spec": spec})().test_spec_says_what_it_is()
    type("Honest", (TaskContract,), {"spec": depth})().test_spec_says_what_it_is()
