"""The reference camera must see each face near enough to head-on, inside of the picture, and past the town."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gear.testing.tiny_town import SMALL_RIG
from gear.values.geometry import RigidTransform
from gear.world.surfaces.view_limits import FaceInWorld, ViewLimits, reference_camera


class FakeSpace:
    """Shows a share of the points of each face."""

    def __init__(self, share: float) -> None:
        self._share = share

    def visible(self, _: Any, targets_m: np.ndarray) -> np.ndarray:
        return np.arange(len(targets_m)) < self._share * len(targets_m)


def face(x_m: float, y_m: float, turn_deg: float) -> FaceInWorld:
    turn = np.radians(180.0 + turn_deg)
    outward = np.array([np.cos(turn), np.sin(turn), 0.0])
    return FaceInWorld(np.array([x_m, y_m, 1.5]), outward, np.full((15, 3), (x_m, y_m, 1.5)))


@pytest.mark.parametrize(
    ("seen", "share", "verdict"),
    [
        (face(20.0, 0.0, 0.0), 1.0, "seen"),
        (face(20.0, 0.0, 60.0), 1.0, "seen"),
        (face(20.0, 0.0, 85.0), 1.0, "too oblique"),
        (face(20.0, 0.0, 180.0), 1.0, "too oblique"),
        (face(-20.0, 0.0, 0.0), 1.0, "out of the picture"),
        (face(20.0, 40.0, 0.0), 1.0, "out of the picture"),
        (face(20.0, 0.0, 0.0), 0.3, "hidden"),
        (face(20.0, 0.0, 0.0), 0.5, "seen"),
    ],
)
def test_the_first_broken_limit_is_named(seen: FaceInWorld, share: float, verdict: str) -> None:
    mount, camera = reference_camera(SMALL_RIG, RigidTransform.from_yaw("world", "ego", (0.0, 0.0, 0.0), 0.0))
    space: Any = FakeSpace(share)
    assert ViewLimits().judge(space, [seen], mount, camera) == verdict
    assert ViewLimits().judge(space, [], mount, camera) == "seen"
