from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import torch

from gear.networks.checkpoint_states import candidates_of, entries_of
from gear.values.errors import GearError

STATE = {"a.weight": torch.ones(2), "a.bias": torch.ones(1), "b.weight": torch.zeros(2)}
FILE = Path("a.pth")


def behind(prefix: str) -> dict[str, Any]:
    return {prefix + key: value for key, value in STATE.items()}


@pytest.mark.parametrize(
    ("content", "entries"),
    [
        (STATE, [""]),
        ({"ema": STATE, "model": STATE, "optimizer": {"state": STATE}}, ["model", "ema", "optimizer.state"]),
        ({"checkpoint": {"net": STATE}, "sigma": torch.ones(1)}, ["checkpoint.net", ""]),
        ({"generator": STATE, "state_dict": STATE}, ["state_dict", "generator"]),
        ({"model_ema": STATE, "teacher": STATE, "weights": STATE}, ["weights", "model_ema", "teacher"]),
        ({"schema": STATE, "temp": STATE}, ["schema", "temp"]),
    ],
)
def test_entries_come_in_the_order_of_their_likeliness(content: Any, entries: list[str]) -> None:
    assert [one.entry for one in entries_of(content, FILE)] == entries


@pytest.mark.parametrize("prefix", ["module.", "_orig_mod.", "net.module.", "_orig_mod.module.net."])
def test_a_prefix_of_all_keys_is_among_those_that_are_tried(prefix: str) -> None:
    candidates = list(candidates_of(entries_of({"state_dict": behind(prefix)}, FILE)))
    assert candidates[0].prefix == ""
    (found,) = [one for one in candidates if one.prefix == prefix]
    assert found.state == STATE and not found.left_out
    assert found.name == f"state_dict.{prefix}"[:-1]


def test_two_networks_in_one_state_dict_are_both_tried_the_averaged_one_last() -> None:
    content = behind("ema.") | behind("student.") | {"criterion.weight": torch.ones(1)}
    prefixes = [one.prefix for one in candidates_of(entries_of(content, FILE)) if one.state.keys() == STATE.keys()]
    assert prefixes == ["student.", "ema."]


def test_what_is_nested_too_deep_holds_no_network() -> None:
    deep: Any = STATE
    for _ in range(6):
        deep = {"model": deep}
    with pytest.raises(GearError, match=r"a\.pth: holds no network's tensors \(but model\)"):
        entries_of(deep, FILE)
