"""The state of a checkpoint that fits a network."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch

from gear.networks.checkpoint_states import entries_of
from gear.plugins.build import find
from gear.values.errors import GearError, PluginError
from gear.verbs.weights.choose import choose_state

WANTED = {"a.weight": torch.zeros(2, 3), "b.bias": torch.zeros(4)}
PATH = Path("net.pth")


def state(value: float, prefix: str = "") -> dict[str, torch.Tensor]:
    return {prefix + key: torch.full_like(tensor, value) for key, tensor in WANTED.items()}


def model() -> Any:
    found = find("model", "ddrnet23_slim")
    return replace(found, spec=replace(found.spec, convert=None))  # type: ignore[arg-type]


def chosen(checkpoint: Any, entry: str = "") -> Any:
    return choose_state(model(), WANTED, entries_of(checkpoint, PATH), PATH, entry)


def test_prefixes_are_removed_and_other_states_are_named() -> None:
    found = chosen({"model": state(1, "module."), "ema": state(2)})
    assert found.name == "model.module"
    assert found.state["b.bias"].tolist() == [1.0] * 4
    assert found.others == ("ema",)


def test_an_entry_can_be_named() -> None:
    found = chosen({"model": state(1), "ema": state(2)}, "ema")
    assert (found.name, found.others) == ("ema", ())
    assert found.state["b.bias"].tolist() == [2.0] * 4
    with pytest.raises(GearError, match=r"net\.pth: has no entry 'teacher'; it holds model"):
        chosen({"model": state(1), "ema": state(2)}, "teacher")


def test_equal_states_count_once() -> None:
    assert chosen({"model": state(1), "ema": state(1)}).others == ()


def test_the_message_explains_what_does_not_fit() -> None:
    with pytest.raises(GearError, match="not weights of ddrnet23_slim") as caught:
        chosen({"a.weight": torch.zeros(2, 3)})
    assert "b.bias" in str(caught.value)
    with pytest.raises(GearError, match=r"its keys are like 'x\.y', those of ddrnet23_slim like 'a\.weight'"):
        chosen({"x.y": torch.zeros(1)})


@pytest.mark.parametrize("name", ["nanodet_coco", "ddrnet23_slim"])
def test_keys_that_cannot_be_translated_are_one_line(name: str) -> None:
    states = entries_of({"a.bn.running_var": torch.ones(4)}, PATH)
    with pytest.raises(GearError, match=f"not weights of {name}") as caught:
        choose_state(find("model", name), WANTED, states, PATH)
    assert not isinstance(caught.value, PluginError) and "\n" not in str(caught.value)


def test_a_failing_function_of_another_package_is_blamed() -> None:
    def convert(state: Any) -> Any:
        raise KeyError("theirs")

    found = model()
    found = replace(found, spec=replace(found.spec, convert=convert), owner=replace(found.owner, package="theirs"))
    with pytest.raises(PluginError, match="failed at convert: KeyError"):
        choose_state(found, WANTED, entries_of({"a": torch.ones(1)}, PATH), PATH)
