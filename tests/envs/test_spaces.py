"""Actions and observations as arrays."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gear.contracts.controllers import CarFacts
from gear.envs.settings import DriveSettings
from gear.envs.spaces import EGO, OBSTACLE, action_of, observation_space
from gear.values.errors import GearError

CAR = CarFacts(
    wheelbase_m=2.7, front_m=2.2, rear_m=2.2, half_width_m=0.9, most_acceleration_mps2=3.0, most_braking_mps2=8.0,
    most_steering_rad=0.6,
)  # fmt: skip


def test_actions_are_shares_of_the_cars_limits() -> None:
    for given, wanted in (((1, 1), (3.0, 0.6)), ((-1, -1), (-8.0, -0.6)), ((0.5, 0), (1.5, 0)), ((-9, 9), (-8.0, 0.6))):
        action = action_of(np.array(given, np.float32), CAR)
        assert (action.acceleration_mps2, action.steering_rad) == pytest.approx(wanted)


def test_an_action_that_is_no_number_is_one_line() -> None:
    for wrong in (math.nan, math.inf):
        with pytest.raises(GearError, match="two finite numbers"):
            action_of(np.array([0.0, wrong], np.float32), CAR)


def test_the_space_has_what_the_settings_ask_for() -> None:
    assert sorted(observation_space(DriveSettings(obstacles=0))) == ["ego", "path"]
    space = observation_space(DriveSettings(obstacles=3, width_px=32, height_px=16))
    shapes = {key: one.shape for key, one in space.items()}
    assert shapes == {"ego": (len(EGO),), "path": (21, 2), "obstacles": (3, len(OBSTACLE)), "camera": (16, 32, 3)}
