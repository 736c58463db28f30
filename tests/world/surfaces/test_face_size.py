"""The size of a face, as its file has it."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.testing.tiny_town import TINY_TOWN
from gear.values.errors import TownError
from gear.world.assets.library import AssetLibrary
from gear.world.surfaces.face_size import asset_face_size_m


@pytest.mark.parametrize("town", [TINY_TOWN, "town10"])
def test_gears_billboards_are_as_large_as_in_the_paper(town: str | Path) -> None:
    path = AssetLibrary.for_town(town).path("surface", "billboard")
    assert asset_face_size_m(path) == pytest.approx((7.4, 3.7), abs=0.01)


def test_a_file_without_a_face_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "post.xml"
    path.write_text('<mujoco><worldbody><geom size="1"/></worldbody></mujoco>')
    with pytest.raises(TownError, match=r"has no geom of a class ending in `\.face`"):
        asset_face_size_m(path)
