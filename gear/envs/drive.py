"""`gear/Drive-v0`: a policy drives the ego car of the closed loop, ten times per second."""

from __future__ import annotations

import weakref
from typing import Any, SupportsFloat, cast

import gymnasium
import numpy as np
import numpy.typing as npt

from gear.driving.simulation import FRAME_S, Situation
from gear.driving.start import Draw
from gear.envs.settings import DriveSettings, settings_of
from gear.envs.spaces import ACTION_SPACE, Arrays, action_of, observation_space, observed
from gear.envs.stage import DriveStage
from gear.values.errors import GearError, PlacementError
from gear.values.frames import UInt8Image

LOST = ("crash", "off_road")
"""Endings that terminate an episode. The others truncate it: the time is over, the car stands, or the person was
passed.
"""

PENALTY, LATERAL_WEIGHT = 50.0, 0.05


class DriveEnv(gymnasium.Env[Arrays, npt.NDArray[np.float32]]):
    """A drive of the closed loop as an environment.

    Observations are a dict of arrays (`gear.envs.spaces`): `ego` and `path` always, `obstacles` with the true positions
    of other road users, and `camera` with the picture. An action has two numbers, pedals and steering, -1 to 1.

    The reward of a frame is the distance driven along the lane as a share of the distance at the desired speed, at most
    1, minus 0.05 for each metre beside the centre line; a crash, or a car that leaves the road, costs 50.

    `reset(seed=..., options={"scene": ..., "patch": ..., "scenario": ..., "speed_kmh": ...})` begins a drive. The seed
    decides all draws, and the patch none of them, so two episodes with one seed are twins.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": round(1 / FRAME_S)}  # noqa: RUF012  (Gymnasium's name)

    def __init__(self, render_mode: str | None = None, **settings: Any) -> None:
        """Prepares an environment; the world is compiled by the first `reset`.

        Args:
            render_mode: `rgb_array` if `render` is to return pictures; it needs a camera.
            **settings: the fields of `gear.envs.settings.DriveSettings`.

        Raises:
            GearError: a setting is unknown or impossible.
        """
        self._settings = settings_of(settings)
        if render_mode is not None and (render_mode != "rgb_array" or not self._settings.has_camera):
            raise GearError("environment: render_mode must be rgb_array, and needs a camera (width_px, height_px)")
        self.render_mode = render_mode
        self.observation_space = cast("gymnasium.Space[Arrays]", observation_space(self._settings))
        self.action_space = ACTION_SPACE
        self._stage: DriveStage | None = None
        self._picture: UInt8Image | None = None
        self._draw: Draw | None = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Arrays, dict[str, Any]]:
        """Begins a drive.

        Args:
            seed: seed of the environment's draws; without it, the next drive of the earlier seed.
            options: `scene`, `patch`, `scenario` and `speed_kmh` of this drive.

        Returns:
            The observation, and information: `scene`, `patch`, `scenario`, `speed_kmh` and `drive_seed`, and those of
            `step`.

        Raises:
            GearError: an option is unknown or impossible, or the scene has no place for the scenario.
        """
        super().reset(seed=seed)
        settings = self._settings.for_episode(options)
        stage = self._stage_of(settings)
        situation, self._draw = _begin(stage, settings, self.np_random)
        self._picture = stage.picture()
        about = {
            "scene": settings.scene,
            "patch": settings.patch,
            "scenario": self._draw.name,
            "speed_kmh": self._draw.speed_mps * 3.6,
            "drive_seed": self._draw.seed,
        }
        return observed(situation, self._settings, self._picture), about | _facts(situation)

    def step(self, action: npt.NDArray[np.float32]) -> tuple[Arrays, SupportsFloat, bool, bool, dict[str, Any]]:
        """Drives for a tenth of a second.

        Args:
            action: (2,) numbers in -1..1: pedals (1 full acceleration, -1 full braking) and steering (1 fully to the
                left).

        Returns:
            The observation, the reward, whether the drive was lost (a crash, or off the road), whether it ended
            otherwise, and information: `time_s`, `s_m`, `lateral_m`, `ending`, `ran_red_light`, and after a crash
            `impact_mps` and `crash_kind`.

        Raises:
            GearError: `reset` was not called.
        """
        if self._stage is None or self._draw is None:
            raise GearError("environment: call reset before step")
        before = self._stage.simulation.situation
        situation = self._stage.simulation.step(action_of(action, before.car))
        self._picture = self._stage.picture()
        is_lost = situation.ending in LOST
        observation = observed(situation, self._settings, self._picture)
        reward = reward_of(before, situation)
        return observation, reward, is_lost, situation.is_over and not is_lost, _facts(situation)

    def render(self) -> UInt8Image | None:
        """The (H, W, 3) uint8 picture of the camera after the last `reset` or `step`. None before the first `reset`, or
        if `render_mode` is None.
        """
        return self._picture if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Closes the renderer."""
        if self._stage is not None:
            self._stage.close()
            self._stage = None

    def _stage_of(self, settings: DriveSettings) -> DriveStage:
        """The stage of the episode's scene; another scene's is closed."""
        if self._stage is not None and self._stage.scene != settings.scene:
            self.close()
        if self._stage is None:
            self._stage = DriveStage.open(settings)
            weakref.finalize(self, self._stage.close)  # also at the end of a program that does not call close
        self._stage.show_patch(settings.patch)
        return self._stage


def reward_of(before: Situation, after: Situation) -> float:
    """The reward of one frame: the distance driven along the lane as a share of the distance at the desired speed, at
    most 1, minus `LATERAL_WEIGHT` for each metre beside the centre line, and minus `PENALTY` if the frame ends in a
    crash or off the road.

    Args:
        before: the state at the start of the frame.
        after: the state at the end of the frame.
    """
    wanted_m = max(after.cruise_mps, 1.0) * FRAME_S
    progress = min((after.position.s_m - before.position.s_m) / wanted_m, 1.0)
    penalty = PENALTY if after.ending in LOST and not before.is_over else 0.0
    return float(progress - LATERAL_WEIGHT * abs(after.position.lateral_m) - penalty)


def _begin(stage: DriveStage, settings: DriveSettings, rng: np.random.Generator) -> tuple[Situation, Draw]:
    """Begins the first drive for which the scene has a place.

    Raises:
        PlacementError: there is no such drive.
    """
    problem: PlacementError | None = None
    for draw in settings.draws(rng):
        try:
            return stage.simulation.reset(draw), draw
        except PlacementError as error:
            problem = problem or error
    assert problem is not None
    raise problem


def _facts(situation: Situation) -> dict[str, Any]:
    facts: dict[str, Any] = {
        "time_s": situation.time_s,
        "s_m": situation.position.s_m,
        "lateral_m": situation.position.lateral_m,
        "ending": situation.ending,
        "ran_red_light": situation.ran_red_light,
    }
    if situation.crash is not None:
        facts |= {"impact_mps": situation.crash.impact_mps, "crash_kind": situation.crash.kind}
    return facts
