"""Which splits the paths of a command mean."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from gear.readers.find_splits import open_all
from gear.values.errors import DatasetError, GearError
from tests.verbs.conftest import collect_small, collected, small

__all__ = ["collect_small", "collected", "small"]


def test_folders_of_datasets_and_splits_by_name(small: Callable[..., Path], tmp_path: Path) -> None:
    root = small("semseg")
    shutil.copytree(root, tmp_path / "data" / "one")
    split = open_all([root], "semseg", names=("val",), allow_test_data=True)[0].plan.info.split
    (found,) = open_all([tmp_path / "data"], "semseg", names=(), allow_test_data=True)
    assert found.root == tmp_path / "data" / "one"
    (found,) = open_all([f"{root}:{split}"], "semseg", names=(), allow_test_data=True)
    assert found.plan.info.split == split


def test_what_cannot_be_learnt_from_is_refused(small: Callable[..., Path], tmp_path: Path) -> None:
    root = small("semseg")
    shutil.copytree(root, tmp_path / "copy")
    with pytest.raises(GearError, match="hold the same samples"):
        open_all([root, tmp_path / "copy"], "semseg", names=(), allow_test_data=True)
    with pytest.raises(DatasetError, match="holds a semseg dataset, not depth"):
        open_all([root], "depth", names=(), allow_test_data=True)
    with pytest.raises(DatasetError, match="no such folder"):
        open_all([tmp_path / "gone"], "semseg", names=())
    (tmp_path / "empty").mkdir()
    with pytest.raises(DatasetError, match="holds no dataset"):
        open_all([tmp_path / "empty"], "semseg", names=())
