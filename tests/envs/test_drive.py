"""The driving environment, by Gymnasium's own checks and by what it promises."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import gear.envs
from gear.envs.drive import DriveEnv
from gear.values.errors import GearError, PlacementError, UnknownNameError
from tests.envs.conftest import TINY

Make = Callable[..., "gymnasium.Env[Any, Any]"]
COAST, BRAKE = np.array([0.0, 0.0], np.float32), np.array([-1.0, 0.0], np.float32)
STOPPED = {"scenario": "stopped_lead", "speed_kmh": 30}


def last_of(env: gymnasium.Env[Any, Any], action: Any, **reset: Any) -> tuple[Any, ...]:
    env.reset(**reset)
    while True:
        step = env.step(action)
        if step[2] or step[3]:
            return step


@pytest.mark.filterwarnings("error::UserWarning:gymnasium")
def test_gymnasium_finds_nothing_wrong(tiny: Make) -> None:
    check_env(tiny().unwrapped, skip_render_check=True)
    check_env(tiny(obstacles=0, scenario="free_road").unwrapped, skip_render_check=True)


def test_a_crash_terminates_and_time_truncates(tiny: Make) -> None:
    env = tiny()
    _, reward, terminated, truncated, info = last_of(env, COAST, seed=1, options=STOPPED)
    assert terminated and not truncated and info["ending"] == "crash" and reward < -40
    assert info["crash_kind"] == "vehicle" and info["impact_mps"] * 3.6 == pytest.approx(30, abs=1)
    _, reward, terminated, truncated, info = last_of(env, BRAKE, seed=1, options=STOPPED)
    assert truncated and not terminated and info["ending"] == "stood" and reward > -1
    free = {"scenario": "free_road", "speed_kmh": 30}
    _, _, terminated, truncated, info = last_of(env, COAST, seed=1, options=free)
    assert truncated and not terminated and info["ending"] == "time"


def test_a_seed_decides_the_drive(tiny: Make) -> None:
    env, other = tiny(), tiny()
    observation, info = env.reset(seed=7)
    env.step(COAST)
    again, same = other.reset(seed=7)
    assert info == same and all(np.array_equal(observation[key], again[key]) for key in observation)
    assert env.reset()[1]["drive_seed"] != info["drive_seed"], "the next drive of the same seed is another one"
    assert other.reset(seed=8)[1]["drive_seed"] != info["drive_seed"]


def test_what_is_observed_is_the_truth(tiny: Make) -> None:
    env = tiny()
    observation, info = env.reset(seed=1, options=STOPPED)
    assert observation["ego"][0] == pytest.approx(30 / 3.6) and observation["ego"][4] == pytest.approx(
        info["lateral_m"]
    )
    lead = observation["obstacles"][observation["obstacles"][:, 0] > 0]
    ahead = lead[(np.abs(lead[:, 3]) < 1) & (lead[:, 2] > 0)][0]
    assert 25 < ahead[2] < 45 and ahead[1] == 0 and abs(ahead[7]) < 0.1, "a car stands four seconds ahead"
    before = env.unwrapped._stage.simulation.situation  # type: ignore[attr-defined]
    assert observation["path"][5] == pytest.approx(before.path_m[10], abs=1e-5)


def test_progress_is_worth_most_in_the_middle_of_the_lane(tiny: Make) -> None:
    env = tiny()
    _, info = env.reset(seed=1, options={"scenario": "free_road", "speed_kmh": 30})
    _, reward, _, _, later = env.step(COAST)
    assert reward == pytest.approx((later["s_m"] - info["s_m"]) / (3 / 3.6) - 0.05 * abs(later["lateral_m"]), abs=1e-3)
    _, slower, *_ = env.step(BRAKE)
    assert slower < reward


def test_bad_settings_are_one_line(tiny: Make) -> None:
    for settings, said in (
        ({"twon": "x"}, "no setting of the environment named 'twon'; did you mean town"),
        ({"speed_kmh": 500}, "speed_kmh: must be 0, or 5 to 130, got 500"),
        ({"patch": "random"}, "patch: a patch needs a camera"),
        ({"width_px": 64}, "a camera needs a width and a height"),
        ({"obstacles": -1}, "obstacles: must be 0 to 100"),
        ({"render_mode": "rgb_array"}, "render_mode must be rgb_array, and needs a camera"),
    ):
        with pytest.raises(GearError, match=said):
            DriveEnv(**(TINY | settings))
    env = tiny()
    with pytest.raises(UnknownNameError, match="no option of reset named 'speed'; did you mean speed_kmh"):
        env.reset(options={"speed": 3})
    with pytest.raises(UnknownNameError, match="no scenario named 'stoped_lead'; did you mean stopped_lead"):
        env.reset(options={"scenario": "stoped_lead"})
    with pytest.raises(PlacementError, match="cut_in"):
        env.reset(options={"scenario": "cut_in"})
    with pytest.raises(GearError, match="call reset"):
        DriveEnv(**TINY).step(COAST)


def test_several_at_once(tiny: Make) -> None:
    envs = gymnasium.make_vec(gear.envs.DRIVE, num_envs=2, vectorization_mode="sync", **TINY)
    observations, _ = envs.reset(seed=[3, 4])
    single, _ = tiny().reset(seed=4)
    assert observations["ego"].shape == (2, 6)
    assert all(np.array_equal(observations[key][1], single[key]) for key in single)
    _, rewards, *_ = envs.step(np.stack([COAST, BRAKE]))
    assert rewards.shape == (2,)
    envs.close()


@pytest.mark.slow
def test_twins_differ_in_the_picture_alone(tiny: Make) -> None:
    env = tiny(width_px=160, height_px=64, renderer="classic", render_mode="rgb_array")
    options = {"scenario": "free_road", "speed_kmh": 40}
    plain, info = env.reset(seed=3, options=options)
    plain_next = env.step(COAST)[0]
    patched, patched_info = env.reset(seed=3, options=options | {"patch": "random"})
    assert np.array_equal(env.render(), patched["camera"])
    patched_next = env.step(COAST)[0]
    assert info | {"patch": "random"} == patched_info
    for one, other in ((plain, patched), (plain_next, patched_next)):
        differs = (one["camera"] != other["camera"]).any(axis=-1).mean()
        assert 0 < differs < 0.2, "only the board"
        assert all(np.array_equal(one[key], other[key]) for key in one if key != "camera")
    assert (plain["camera"] != plain_next["camera"]).any(), "the car drives"
    check_env(env.unwrapped)
    env.close()
