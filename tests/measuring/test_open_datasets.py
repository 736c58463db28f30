"""The datasets of an evaluation."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gear.measuring.open_datasets import opened, row_names
from gear.values.errors import GearError


def split(root: str, key: str) -> Any:
    info = SimpleNamespace(split="test", patch_label="none")
    return SimpleNamespace(root=root, plan=SimpleNamespace(info=info, content_key=key))


def test_names_follow_from_the_content() -> None:
    datasets = [split("a", "0123456789"), split("b", "abcdefghij")]
    assert row_names(datasets) == ["test-none-01234567", "test-none-abcdefgh"]
    assert row_names(datasets[::-1]) == row_names(datasets)[::-1]


def test_the_same_data_twice_are_refused() -> None:
    with pytest.raises(GearError, match="a and b are the same data; give each once"):
        row_names([split("a", "0123456789"), split("b", "0123456789")])


def test_at_least_one_dataset_is_needed() -> None:
    model: Any = None
    with pytest.raises(GearError, match="there is nothing to evaluate on"):
        opened([], None, model, [])
