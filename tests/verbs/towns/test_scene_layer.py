"""Boards and limits on a map."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from gear.testing.tiny_town import TINY_TOWN
from gear.verbs.towns import ground_layer, scene_layer, town_map
from gear.verbs.towns.facts import Town
from gear.world.roads.regions import Region
from gear.world.scene_spec import BoardSpec

from .conftest import only, pixel


def test_the_map_shows_boards_and_limits(tiny: Town) -> None:
    geometry = ground_layer.TownGeometry.of(TINY_TOWN)
    with_board = town_map.draw_map(only(tiny, "board"), geometry)
    without = town_map.draw_map(only(tiny, "no_billboard"), geometry)
    colour = scene_layer.PALETTE[0]
    assert pixel(with_board, 55, -8.5) == colour
    inside, outside = (25.0, -10.0), (60.0, -10.0)
    assert pixel(with_board, *inside) != pixel(without, *inside)
    assert pixel(with_board, *outside) == pixel(without, *outside)
    wedge, behind = (45.0, -7.6), (60.0, -20.0)
    assert pixel(with_board, *wedge) != pixel(without, *wedge)
    assert pixel(with_board, *behind) == pixel(without, *behind)


@given(
    facing_deg=st.floats(-180, 180), ahead=st.floats(-50, 50), lateral=st.floats(-50, 50),
    length=st.floats(1, 100), width=st.floats(1, 100), u=st.floats(-0.5, 1.5), v=st.floats(-0.5, 1.5),
)  # fmt: skip
def test_outlines_hold_what_regions_hold(
    facing_deg: float, ahead: float, lateral: float, length: float, width: float, u: float, v: float
) -> None:
    board = BoardSpec(position_m=(7.0, -3.0, 0.0), facing_deg=facing_deg)
    ahead_m, lateral_m = (ahead, ahead + length), (lateral, lateral + width)
    corners = scene_layer.board_rectangle_m(board, ahead_m, lateral_m)
    place = corners[0] + u * (corners[1] - corners[0]) + v * (corners[3] - corners[0])
    if min(abs(u), abs(1 - u), abs(v), abs(1 - v)) > 1e-6:
        region = Region(board=board, ahead_m=ahead_m, lateral_m=lateral_m)
        assert region.holds(place)[0] == (0 < u < 1 and 0 < v < 1)
