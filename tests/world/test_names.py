from __future__ import annotations

from pathlib import Path

import pytest

from gear.testing.tiny_town import CLEAR, TINY_TOWN, tiny_scenes
from gear.values.errors import TownError
from gear.world.world import World


@pytest.mark.parametrize("name", ["board_0", "car_saloon_0"])
def test_a_town_with_a_reserved_name_is_an_error(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "towns"
    folder.mkdir()
    text = TINY_TOWN.read_text().replace("<worldbody>", f'<worldbody><body name="{name}"/>', 1)
    (folder / "tiny.xml").write_text(text)
    for kind in ("vehicles", "pedestrians", "surfaces"):
        (tmp_path / kind).symlink_to(TINY_TOWN.parents[1] / kind)
    with pytest.raises(TownError, match=f"has a body named '{name}'"):
        World.build(town=folder / "tiny.xml", scene_name="board", scene=tiny_scenes().scenes["board"], weather=CLEAR)
