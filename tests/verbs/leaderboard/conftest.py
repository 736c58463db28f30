"""A tiny benchmark with records, made once a run."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import gear
from gear.dataset.locks import dataset_lock
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from tests.shared import shared_folder
from tests.verbs.bench.conftest import FEW, plugins, write

__all__ = ["plugins"]

ADAPTIVE = FEW[:4]
"""One network, one scene and a blur, with adaptive patches."""

HERE = (
    f'places={{{TINY_TOWN}: ["{TINY_SCENES}:board"]}}',
    f'calibration={{town: {TINY_TOWN}, scene: "{TINY_SCENES}:truck"}}',
)
"""Where the files of the tiny town lie: a record names no folders."""


@pytest.fixture
def records(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, plugins: None) -> Path:
    """A copy of the folder of records of the tiny benchmark."""
    folder = shared_folder(tmp_path_factory, "benches/recorded")
    with dataset_lock(folder):
        if not (folder / "whole").exists():
            gear.bench(write(folder, ADAPTIVE), out=folder / "out", record=True)
            (folder / "whole").touch()
    return Path(shutil.copytree(folder / "out/records", tmp_path / "records"))
