"""What removes a road user from a sample: it has fallen over, or it hides a face."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gear.values.geometry import RigidTransform
from gear.world.scene_spec import BoardSpec, NpcLimits
from gear.world.traffic.crowd import OcclusionTest, is_upright, region_of


@pytest.mark.parametrize(("tilt_deg", "upright"), [(0, True), (20, True), (30, False), (90, False), (180, False)])
def test_a_tilted_actor_has_fallen_over(tilt_deg: float, upright: bool) -> None:
    c, s = np.cos(np.radians(tilt_deg)), np.sin(np.radians(tilt_deg))
    rotation = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    assert is_upright(RigidTransform.from_parts("world", "actor", rotation, (0, 0, 0))) == upright


class FakeSpace:
    """Hides the points of a face by a list of bodies."""

    def __init__(self, occluders: list[str | None]) -> None:
        self._occluders = occluders

    def occluders(self, *_: Any) -> list[str | None]:
        return self._occluders


def test_actors_that_together_hide_too_much_are_found() -> None:
    test = OcclusionTest(np.zeros(3), (np.zeros((4, 3)),), min_free=0.5)
    few: Any = FakeSpace(["car", "van", None, None])
    many: Any = FakeSpace(["car", "van", "car", None])
    assert test.occluders(few, {}) == set()
    assert test.occluders(many, {}) == {"car", "van"}


def test_limits_around_the_ego_car_need_no_board() -> None:
    board = BoardSpec(position_m=(10.0, 0.0, 0.0), facing_deg=0.0)
    around = region_of(NpcLimits(count=(0, 1), radius_m=(0.0, 5.0)), [board], (100.0, 0.0))
    assert around.board is None and around.holds([[104.0, 0.0], [106.0, 0.0]]).tolist() == [True, False]
    ahead = region_of(NpcLimits(count=(0, 1), ahead_m=(0.0, 5.0)), [board], (100.0, 0.0))
    assert ahead.board == board and ahead.holds([[14.0, 0.0], [16.0, 0.0]]).tolist() == [True, False]
