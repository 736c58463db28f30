"""Fixtures of the page's tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gear.dataset.reading import Dataset
from gear.plugins.build import find
from gear.plugins.datasets import open_dataset
from gear.values.serial import to_json

from .view_datasets import OPTIONS, store_samples

Write = Callable[..., Path]


@pytest.fixture
def write_dataset(tmp_path: Path) -> Write:
    """`write_dataset("semseg", 3)` gives the root of a finished split."""

    def write(name: str, count: int = 3, **settings: Any) -> Path:
        spec = find("task", name).spec
        config = spec.config(**OPTIONS[name])
        root = tmp_path / name
        store_samples(root, name, spec.build(config), to_json(config), count, **settings)
        return root

    return write


@pytest.fixture
def opened(write_dataset: Write) -> Callable[..., Dataset[Any]]:
    """The same, opened."""
    return lambda name, count=3, **settings: open_dataset(write_dataset(name, count, **settings))
