from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import gear
from gear.dataset.locks import dataset_lock
from gear.testing.tiny_networks import tiny_depth, tiny_segmenter
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from tests.shared import shared_folder
from tests.verbs.conftest import other_segmenter, put_package

CONFIG = f"""
tasks:
  semseg:
    models:
      small: {{plugin: tiny_segmenter}}
      second: {{plugin: other_segmenter, set: {{width: 6}}}}
    defenses:
      blur: {{plugin: gaussian}}
      fpda: {{set: {{false_alarms: 0.2}}}}
places:
  {TINY_TOWN}: ["{TINY_SCENES}:board", "{TINY_SCENES}:double"]
calibration: {{town: {TINY_TOWN}, scene: "{TINY_SCENES}:truck"}}
samples: {{attack: 2, choose: 1, measure: 2, calibrate: 8}}
attack: {{steps: 2}}
transfer: true
adaptive: true
collect:
  renderer: classic
  quality: fast
  options: {{width_px: 256, height_px: 128}}
"""


FEW = (
    ("      second: {plugin: other_segmenter, set: {width: 6}}\n", ""),
    ("      fpda: {set: {false_alarms: 0.2}}\n", ""),
    (f', "{TINY_SCENES}:double"', ""),
    ("transfer: true", "transfer: false"),
    ("adaptive: true", "adaptive: false"),
)
"""Changes that leave one network, one scene and one defense."""

LEARNING = (*FEW[:1], ("      blur: {plugin: gaussian}\n", ""), *FEW[2:4])
"""Changes that leave one network, one scene and a defense that must learn."""


def callbacks(looks: Any) -> dict[str, Any]:
    """The methods of an observer, as keywords of `gear.bench`."""
    return {name: getattr(looks, name) for name in ("on_step", "on_progress", "on_fit_progress", "on_warning")}


@pytest.fixture
def plugins(monkeypatch: pytest.MonkeyPatch) -> None:
    put_package(monkeypatch, [tiny_segmenter, tiny_depth, other_segmenter])


@pytest.fixture
def written(tmp_path: Path) -> Callable[..., Path]:
    """A bench config with some of its text replaced."""

    return lambda *changes: write(tmp_path, changes)


@pytest.fixture
def made(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, plugins: None
) -> Callable[[tuple[tuple[str, str], ...]], Path]:
    """`tmp_path / "out"` with the finished bench of `FEW` or `LEARNING`, each of which is made once a run."""

    def copy(changes: tuple[tuple[str, str], ...]) -> Path:
        folder = shared_folder(tmp_path_factory, f"benches/{'few' if changes == FEW else 'learning'}")
        with dataset_lock(folder):
            if not (folder / "whole").exists():
                gear.bench(write(folder, changes), out=folder / "out")
                (folder / "whole").touch()
        return Path(shutil.copytree(folder / "out", tmp_path / "out"))

    return copy


def write(folder: Path, changes: tuple[tuple[str, str], ...]) -> Path:
    text = CONFIG
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "bench.yml").write_text(text)
    return folder / "bench.yml"
