from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from gear.testing.tiny_networks import tiny_depth, tiny_segmenter
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from tests.verbs.conftest import other_segmenter, put_package

CONFIG = f"""
tasks:
  semseg:
    models:
      small: {{plugin: tiny_segmenter}}
      second: {{plugin: other_segmenter, set: {{width: 6}}}}
    defenses:
      blur: {{plugin: gaussian}}
      fpda: {{}}
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
    ("      fpda: {}\n", ""),
    (f', "{TINY_SCENES}:double"', ""),
    ("transfer: true", "transfer: false"),
    ("adaptive: true", "adaptive: false"),
)
"""Changes that leave one network, one scene and one defense."""


@pytest.fixture
def plugins(monkeypatch: pytest.MonkeyPatch) -> None:
    put_package(monkeypatch, [tiny_segmenter, tiny_depth, other_segmenter])


@pytest.fixture
def written(tmp_path: Path) -> Callable[..., Path]:
    """A bench config with some of its text replaced."""

    def write(*changes: tuple[str, str]) -> Path:
        text = CONFIG
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "bench.yml").write_text(text)
        return tmp_path / "bench.yml"

    return write
