from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.verbs.collect.run import CollectReport, collect

SMALL = {"semseg": "320x160", "detect2d": "320x192", "stereo3d": "320x96", "depth": "320x96"}


def size_settings(task: str) -> list[str]:
    width, height = SMALL.get(task, "320x96").split("x")
    return [f"options.width_px={width}", f"options.height_px={height}"]


@pytest.fixture
def collect_small() -> Callable[..., CollectReport]:
    """`gear.collect` of small pictures of the tiny town, with the classic renderer unless asked otherwise."""

    def run(task: str, out: Path, **changes: Any) -> CollectReport:
        settings = [f"scenes={TINY_SCENES}", *size_settings(task), *changes.pop("settings", [])]
        arguments: dict[str, Any] = {
            "town": TINY_TOWN, "scene": "board", "split": "debug", "samples": 2, "renderer": "classic",
            "quality": "fast",
        }  # fmt: skip
        return collect(task, out=out, settings=settings, **(arguments | changes))

    return run
