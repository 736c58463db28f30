"""The ground of a map shows what the town covers; what has no triangles or label is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gear.testing.tiny_town import TINY_SCENES
from gear.values.errors import TownError
from gear.values.frames import UInt8Image
from gear.verbs.towns import ground_layer, town_map
from gear.verbs.towns.facts import read_town

from .conftest import edited_town, pixel


def test_an_unlabelled_geom_stops_the_map(tmp_path: Path) -> None:
    path = edited_town(tmp_path, '<geom name="lamp_post" class="pole"', '<geom name="lamp_post" class="seen"')
    with pytest.raises(TownError, match="geom 'lamp_post' can be seen but has class 'seen'"):
        ground_layer.TownGeometry.of(path)


def test_a_height_field_stops_the_map(tmp_path: Path) -> None:
    field = '<hfield name="h" nrow="4" ncol="4" size="9 9 1 1"/><material name="steel"'
    path = edited_town(tmp_path, '<material name="steel"', field)
    hill = '<geom name="hill" class="terrain" type="hfield" hfield="h"/><geom name="lamp_post"'
    path.write_text(path.read_text(encoding="utf-8").replace('<geom name="lamp_post"', hill), encoding="utf-8")
    with pytest.raises(TownError, match=f"{path.name}: geom 'hill' is a hfield, which has no finite surface; make it"):
        town_map.draw_map(read_town(path), ground_layer.TownGeometry.of(path))


def test_what_closes_cracks_from_below_hides_nothing(tmp_path: Path, tiny_map: UInt8Image) -> None:
    """As wide as the town, it would be paved ground above the terrain; a square that is only low is none. Hills may
    reach further."""
    classes = '<default class="pole"/>'
    path = edited_town(tmp_path, classes, f'{classes}<default class="ground"/>')
    text, post = path.read_text(encoding="utf-8"), '<geom name="lamp_post"'
    under = '<geom name="under" class="ground" material="asphalt" size="90 70 0.1" pos="0 0 -9"/>'
    square = '<geom name="square" class="ground" material="asphalt" size="9 9 0.1" pos="-60 40 -0.5"/>'
    path.write_text(text.replace(post, under + post), encoding="utf-8")
    assert np.array_equal(town_map.draw_map(read_town(path, TINY_SCENES), ground_layer.TownGeometry.of(path)), tiny_map)
    path.write_text(text.replace(post, square + post), encoding="utf-8")
    paved = ground_layer.COVERS[1][2]
    assert pixel(town_map.draw_map(read_town(path), ground_layer.TownGeometry.of(path)), -60, 40) == paved
