"""Regions are limits in the frame of a board and around the ego car; places are drawn evenly from pieces of lines."""

from __future__ import annotations

import numpy as np
import pytest

from gear.world.roads.polyline import Polyline
from gear.world.roads.regions import LineTable, Region
from gear.world.scene_spec import BoardSpec

NORTH = BoardSpec(position_m=(10.0, 20.0, 0.0), facing_deg=90.0)


def test_limits_are_in_the_frame_of_the_board() -> None:
    region = Region(board=NORTH, ahead_m=(5.0, 10.0), lateral_m=(0.0, 3.0))
    places = [(9.0, 26.0), (11.0, 26.0), (9.0, 24.0), (9.0, 31.0), (6.0, 26.0)]
    assert region.holds(places).tolist() == [True, False, False, False, False]


def test_all_limits_hold_together() -> None:
    region = Region(board=NORTH, ahead_m=(0.0, 100.0), radius_m=(2.0, 5.0), centre_m=(10.0, 30.0))
    assert region.holds([(10.0, 33.0), (10.0, 31.0), (10.0, 36.0), (10.0, 19.0)]).tolist() == [
        True,
        False,
        False,
        False,
    ]
    assert Region().holds([(1e6, -1e6)]).all()


def line(length_m: float, y_m: float) -> Polyline:
    return Polyline.through(np.array([[0.0, y_m, 0.0], [length_m, y_m, 0.0]]))


def test_places_are_drawn_by_length_and_weight() -> None:
    table = LineTable.of(
        [("short", line(10.0, 0.0), 1.0), ("long", line(40.0, 5.0), 1.0), ("rare", line(50.0, 9.0), 0.2)]
    )
    assert len(table.names) == 100
    np.testing.assert_allclose(table.length_m, 1.0)
    rng = np.random.default_rng(0)
    drawn = [table.draw(np.arange(100), rng) for _ in range(6000)]
    shares = {name: sum(one == name for one, _ in drawn) / 6000 for name in ("short", "long", "rare")}
    assert shares == pytest.approx({"short": 10 / 60, "long": 40 / 60, "rare": 10 / 60}, abs=0.03)
    along = np.array([s_m for name, s_m in drawn if name == "long"])
    assert np.histogram(along, 4, (0.0, 40.0))[0] / len(along) == pytest.approx(0.25, abs=0.04)


def test_only_pieces_inside_are_found() -> None:
    table = LineTable.of([("lane", line(40.0, 0.0), 1.0)])
    inside = table.inside(Region(radius_m=(0.0, 5.0), centre_m=(20.0, 0.0)))
    assert table.s_m[inside].min() == pytest.approx(15.5) and table.s_m[inside].max() == pytest.approx(24.5)
    assert not len(LineTable.of([]).inside(Region()))


def test_pieces_lie_where_the_line_has_their_middles() -> None:
    """Bit for bit: the places of road users depend on them."""
    rng = np.random.default_rng(3)
    lines = [
        Polyline.through(np.cumsum(rng.normal(size=(count, 3)) * rng.uniform(0.2, 20), axis=0))
        for count in (2, 3, 9, 40, 40)
    ]
    table = LineTable.of((str(number), each, 0.5 + number) for number, each in enumerate(lines))
    assert len(table.names) > 100 and set(table.names) == {"0", "1", "2", "3", "4"}
    for name, s_m, point_m, weight in zip(table.names, table.s_m, table.points_m, table.weight, strict=True):
        expected_m, _ = lines[int(name)].at(float(s_m))
        assert point_m.tobytes() == expected_m.tobytes() and weight == 0.5 + int(name)
    for number, each in enumerate(lines):
        lengths_m = table.length_m[np.array(table.names) == str(number)]
        assert lengths_m.sum() == pytest.approx(each.length_m) and np.ptp(lengths_m) == 0
