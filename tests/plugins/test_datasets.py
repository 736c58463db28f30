"""Datasets opened by path: what is no dataset is named with what may have been meant."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

import gear
from gear.cli.main import main
from gear.values.errors import DatasetError
from tests.verbs.conftest import collect_small, collected, small

__all__ = ["collect_small", "collected", "small"]


def test_a_folder_of_datasets_names_those_inside(
    small: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("none", "random"):
        shutil.copytree(small("semseg"), tmp_path / "data" / name)
    with pytest.raises(DatasetError, match=r"is a folder of 2 datasets; give one of them: .*none, .*random"):
        gear.open_dataset(tmp_path / "data")
    assert main(["sheet", str(tmp_path / "data")]) == 2
    assert "give one of them" in capsys.readouterr().err
