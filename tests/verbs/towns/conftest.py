"""The tiny town and its map, read once a session, and edited copies of it."""

from __future__ import annotations

import dataclasses
import shutil
from pathlib import Path

import pytest

from gear.testing.tiny_town import DATA, TINY_SCENES, TINY_TOWN
from gear.values.frames import UInt8Image
from gear.verbs.towns import ground_layer, town_map
from gear.verbs.towns.facts import Town, read_town


@pytest.fixture(scope="session")
def tiny() -> Town:
    return read_town(TINY_TOWN, TINY_SCENES)


@pytest.fixture(scope="session")
def tiny_map(tiny: Town) -> UInt8Image:
    return town_map.draw_map(tiny, ground_layer.TownGeometry.of(TINY_TOWN))


def only(town: Town, *names: str) -> Town:
    assert town.scenes is not None
    scenes = {name: town.scenes.scenes[name] for name in names}
    return dataclasses.replace(town, scenes=dataclasses.replace(town.scenes, scenes=scenes))


def edited_town(folder: Path, old: str, new: str) -> Path:
    shutil.copytree(DATA / "mjcf", folder / "mjcf")
    path = folder / "mjcf" / "towns" / "tiny.xml"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


def pixel(picture: UInt8Image, x_m: float, y_m: float) -> tuple[int, ...]:
    """Of the tiny town's map; its bounds are 160 m x 120 m about the origin."""
    scale = town_map.LONG_SIDE_PX / 160
    x, y = town_map.MARGIN_PX + (x_m + 80) * scale, town_map.MARGIN_PX + (60 - y_m) * scale
    return tuple(int(v) for v in picture[round(y), round(x)])
