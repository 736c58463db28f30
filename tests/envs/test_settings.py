"""Settings of an environment, and the drives that they allow."""

from __future__ import annotations

import numpy as np
import pytest

from gear.driving.scenario import load_scenarios
from gear.envs.settings import DriveSettings, settings_of
from gear.values.errors import GearError


def test_an_episode_changes_what_it_names() -> None:
    settings = DriveSettings(width_px=32, height_px=16)
    episode = settings.for_episode({"scene": "billboard01", "patch": "random", "speed_kmh": 50})
    assert (episode.scene, episode.patch, episode.speed_kmh) == ("billboard01", "random", 50)
    assert episode.width_px == 32 and settings.scene == "no_billboard"
    assert settings.for_episode(None) == settings
    with pytest.raises(GearError, match="speed_kmh"):
        settings.for_episode({"speed_kmh": 1})
    with pytest.raises(GearError, match="dynamics: must be kinematic or mujoco"):
        settings_of({"dynamics": "bicycle"})


def test_all_scenarios_and_speeds_are_drawn_once() -> None:
    scenarios = load_scenarios("standard").scenarios
    draws = list(DriveSettings().draws(np.random.Generator(np.random.PCG64(0))))
    pairs = {(draw.name, round(draw.speed_mps * 3.6, 6)) for draw in draws}
    assert pairs == {(name, speed) for name, one in scenarios.items() if name != "red_light"
                     for speed in one.speeds_kmh}  # fmt: skip
    assert len(draws) == len(pairs) and len({draw.seed for draw in draws}) == 1
    fixed = list(settings_of({"scenario": "free_road", "speed_kmh": 33}).draws(np.random.Generator(np.random.PCG64(0))))
    assert [(draw.name, draw.speed_mps) for draw in fixed] == [("free_road", pytest.approx(33 / 3.6))]
