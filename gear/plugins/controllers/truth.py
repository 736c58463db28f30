"""The controller with perfect perception, the ceiling of a comparison: it knows the true positions of road users, and
the red lights.
"""

from __future__ import annotations

import math

import numpy as np

from gear.contracts.controllers import Observation, Obstacle, Points
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import ControllerSpec
from gear.plugins.controllers.baseline import HEADWAY_S, STANDSTILL_GAP_M, Baseline, BaselineConfig
from gear.plugins.controllers.corridor import Corridor
from gear.plugins.controllers.tracker import Sighting

FORESIGHT_S = {"person": 3.0, "vehicle": 1.0}
"""Time over which the motion of a road user is continued, seconds: people in a straight line, vehicles on a circle."""

MOST_TURNING_RADPS = 1.5
"""Largest turning rate of a vehicle that is continued, rad/s."""

FORESIGHT_STEP_S = 0.1
ONCOMING_MPS = -1.0
"""Speed along the path below which a vehicle comes towards the ego car; the motion of such a vehicle is not continued,
because it keeps to its own lane.
"""


class Truth(Baseline):
    """The baseline driver with the true positions of all road users, and their motion over the next seconds: people
    walk on, vehicles keep their speed and their turning rate.
    """

    def reset(self, seed: int) -> None:
        """Forgets the road users of an earlier drive.

        Args:
            seed: not used.
        """
        Baseline.reset(self, seed)
        self._yaws: dict[int, tuple[float, float]] = {}

    def nearest(self, observation: Observation, corridor: Corridor) -> Sighting | None:
        """Returns the nearest road user that is in the corridor, or that will be there when the car arrives, or the
        stop line of a red light if it is nearer; None without any.

        Args:
            observation: the frame with the true road users.
            corridor: the strip of road that the car needs, in the ego frame.
        """
        turning = self._turning_radps(observation)
        seen = [
            self._sighting(observation, corridor, obstacle, turning.get(obstacle.id, 0.0))
            for obstacle in observation.obstacles
        ]
        if observation.red_light_m is not None:
            seen.append(Sighting(gap_m=observation.red_light_m, speed_mps=0.0))
        return min((one for one in seen if one is not None), key=lambda one: one.gap_m, default=None)

    def _turning_radps(self, observation: Observation) -> dict[int, float]:
        """The turning rates of vehicles by id, from their headings in this frame and in the frame before it."""
        ego = observation.ego
        own_radps = ego.speed_mps * math.tan(ego.steering_rad) / observation.car.wheelbase_m
        rates, yaws = {}, {}
        for obstacle in observation.obstacles:
            yaws[obstacle.id] = (observation.time_s, obstacle.yaw_rad)
            seen_s, yaw_rad = self._yaws.get(obstacle.id, (observation.time_s, 0.0))
            if obstacle.kind == "vehicle" and observation.time_s > seen_s:
                turned_rad = math.remainder(obstacle.yaw_rad - yaw_rad, 2 * math.pi)
                rate = turned_rad / (observation.time_s - seen_s) + own_radps
                rates[obstacle.id] = min(max(rate, -MOST_TURNING_RADPS), MOST_TURNING_RADPS)
        self._yaws = yaws
        return rates

    def _sighting(
        self, observation: Observation, corridor: Corridor, obstacle: Obstacle, turning_radps: float
    ) -> Sighting | None:
        outline_m = outline(obstacle)
        arc_m, left_m = corridor.along(outline_m)
        middle_arc_m, middle_left_m = corridor.along(np.array([[obstacle.ahead_m, obstacle.left_m]]))
        direction = corridor.directions(middle_arc_m)[0]
        velocity = np.array(obstacle.velocity_mps)
        along_mps = float(direction @ velocity)
        aside_mps = float(direction[0] * velocity[1] - direction[1] * velocity[0])
        if float(arc_m.max()) < corridor.front_m or float(arc_m.min()) > corridor.length_m:
            return None
        if left_m.min() < corridor.half_width_m and left_m.max() > -corridor.half_width_m:
            return Sighting(gap_m=max(0.0, float(arc_m.min()) - corridor.front_m), speed_mps=along_mps)
        if obstacle.kind == "vehicle" and along_mps < ONCOMING_MPS:
            return None
        for step in range(1, round(FORESIGHT_S[obstacle.kind] / FORESIGHT_STEP_S) + 1):
            later_s = step * FORESIGHT_STEP_S
            turned_rad = turning_radps * later_s
            c, s = math.cos(turned_rad), math.sin(turned_rad)
            ahead_s, left_s = (s / turning_radps, (1 - c) / turning_radps) if abs(turned_rad) > 1e-6 else (later_s, 0.0)
            off_arc_m, off_left_m = arc_m - middle_arc_m, left_m - middle_left_m
            aside_m = middle_left_m + aside_mps * ahead_s + along_mps * left_s + c * off_left_m + s * off_arc_m
            later_m = middle_arc_m + along_mps * ahead_s - aside_mps * left_s + c * off_arc_m - s * off_left_m
            if aside_m.min() > corridor.half_width_m or aside_m.max() < -corridor.half_width_m:
                continue
            reach_m = observation.ego.speed_mps * (later_s + HEADWAY_S) + STANDSTILL_GAP_M
            gap_m = float(later_m.min()) - corridor.front_m
            if 0 <= gap_m <= reach_m:
                return Sighting(gap_m=max(0.0, float(arc_m.min()) - corridor.front_m), speed_mps=max(0.0, along_mps))
        return None


def outline(obstacle: Obstacle) -> Points:
    """Returns (8, 2) corners and middles of the sides of a road user's footprint, in order, in the ego frame.

    Args:
        obstacle: position, size and yaw of the road user.
    """
    c, s = math.cos(obstacle.yaw_rad), math.sin(obstacle.yaw_rad)
    signs = np.array([(1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1)], np.float64)
    local = signs * np.array([obstacle.half_length_m, obstacle.half_width_m])
    points: Points = local @ np.array([[c, s], [-s, c]]) + np.array([obstacle.ahead_m, obstacle.left_m])
    return points


spec = ControllerSpec(
    name="truth",
    summary="Knows all road users and red lights and brakes for them: the ceiling of every comparison.",
    config=BaselineConfig,
    build=Truth,
    needs_truth=True,
    reads_lights=True,
)


@hookimpl
def gear_controllers() -> list[ControllerSpec[BaselineConfig]]:
    """Hook of the plugin system: returns the controller plugin that this module defines."""
    return [spec]
