"""Names are looked up before anything is rendered, and told where they stand."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.config.load import load_collection
from gear.testing.tiny_town import TINY_TOWN
from gear.values.errors import ConfigError, UnknownNameError
from gear.verbs.collect.names import look_up
from gear.verbs.towns.facts import read_town

ASSETS = """town: tiny
scenes:
  corner:
    boards:
      - {position_m: [55, -8.5, 0], facing_deg: 175}
      - {position_m: [5, -8.5, 0], facing_deg: 175, asset: bilboard}
    ego: {ahead_m: [9, 40], lateral_m: [-9, 9]}
"""
TRUCK = "town: tiny\nscenes:\n  behind:\n    truck: {asset: truck_bix}\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            ASSETS,
            r"my.yml:6:60: scenes.corner.boards\[1\].asset: no surface named 'bilboard'; did you mean billboard\?",
        ),
        (TRUCK, r"my.yml:4:20: scenes.behind.truck.asset: no vehicle named 'truck_bix'; did you mean truck_box\?"),
        (ASSETS.replace("tiny", "tony"), r"my.yml:1:7: town: its boards stand in tony, not in tiny"),
    ],
)
def test_what_a_scene_library_names_is_told_with_its_place(text: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "my.yml"
    file.write_text(text)
    flags = {"task": "depth", "town": str(TINY_TOWN), "scene": str(file)}
    with pytest.raises(ConfigError, match=message):
        look_up(load_collection(None, flags))
    with pytest.raises(ConfigError, match=message):
        read_town(TINY_TOWN, file)


def test_a_scene_library_is_found_by_commands_alike(tmp_path: Path) -> None:
    assert read_town("town10", "town10").scenes == read_town("town10").scenes
    with pytest.raises(UnknownNameError, match=r"no scene library named '.*gone.yml' \(that file does not exist\)"):
        look_up(load_collection(None, {"task": "depth"}, [f"scenes={tmp_path}/gone.yml"]))
