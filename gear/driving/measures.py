"""The measures of a drive, computed from its log alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gear.contracts.controllers import Points
from gear.driving.simulation import FRAME_S, PASSED_M
from gear.values.serial import Json

BRAKES_MPS2 = 2.0
"""Deceleration that a controller must command for at least one frame to count as braking, m/s²."""

PHANTOM_MPS2, PHANTOM_FRAMES = 3.0, 2
"""A phantom braking is a commanded deceleration of at least this much, over at least this many frames, without a
hazard.
"""

STANDING_GAP_M = 5.0
"""Distance before a standing obstacle at which a drive counts as complete, metres."""

PENALTIES = {"person": 0.5, "vehicle": 0.6, "static": 0.65}
"""CARLA's factors on the score for a collision, by what was hit (CARLA Autonomous Driving Leaderboard)."""

RED_LIGHT_PENALTY = 0.7
"""CARLA's factor on the score for running a red light."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Measures:
    """The measures of one drive.

    Attributes:
        ending: why the drive ended.
        is_crash: whether the ego car crashed.
        crash_kind: what it hit: `vehicle`, `person`, `static`; "" without a crash.
        impact_mps: speed relative to what was hit, at first contact; None without a crash.
        duration_s: length of the drive.
        least_gap_m: least free distance to a road user in the corridor; None if the corridor was always free.
        least_distance_m: least distance to any road user.
        least_ttc_s: least time to collision in the corridor; None if nothing was approached.
        braking_s: time of the first braking; None without braking.
        phantom_brakings: number of phases of hard braking without a hazard.
        off_road_share: share of the driven way on which the middle of the car was outside its lane.
        lateral_peak_m: largest distance of the car's middle from the centre line.
        jerk_peak_mps3, jerk_rms_mps3: largest and root mean square change of the acceleration.
        progress: driven share of the way that a perfect driver would drive, 0..1.
        score: CARLA's driving score, 0..1: progress times the factors of collisions, of a red light that was run, and
            of the way in the lane.
        ran_red_light: whether the ego car passed the stop line of a red light.
    """

    ending: str
    is_crash: bool
    crash_kind: str
    impact_mps: float | None
    duration_s: float
    least_gap_m: float | None
    least_distance_m: float | None
    least_ttc_s: float | None
    braking_s: float | None
    phantom_brakings: int
    off_road_share: float
    lateral_peak_m: float
    jerk_peak_mps3: float
    jerk_rms_mps3: float
    progress: float
    score: float
    ran_red_light: bool = False


def measure(log: Sequence[Json]) -> Measures:
    """Computes the measures of a drive from its log alone.

    Args:
        log: head, entries of the frames, and end, as `drive` returns them.
    """
    head, frames, end = log[0], log[1:-1], log[-1]
    crash = end["crash"]
    commands = [frame["command"][0] for frame in frames if "command" in frame]
    braking = next((number for number, value in enumerate(commands) if value <= -BRAKES_MPS2), None)
    acceleration = np.array([frame["acceleration_mps2"] for frame in frames])
    jerk = np.diff(acceleration) / FRAME_S if len(frames) > 1 else np.zeros(1)
    lateral = np.array([frame["lateral_m"] for frame in frames])
    arc_m = np.array([frame["s_m"] for frame in frames])
    off_share = _off_road_share(arc_m, np.abs(lateral) > np.array([f["lane_width_m"] / 2 for f in frames]))
    progress = _progress(head, frames)
    ran_red_light = any(frame.get("ran_red_light", False) for frame in frames)
    factor = (1.0 if crash is None else PENALTIES[crash["kind"]]) * (RED_LIGHT_PENALTY if ran_red_light else 1.0)
    return Measures(
        ending=end["ending"],
        is_crash=crash is not None,
        crash_kind="" if crash is None else crash["kind"],
        impact_mps=None if crash is None else float(crash["impact_mps"]),
        duration_s=float(frames[-1]["time_s"]),
        least_gap_m=_least(frames, "gap_m"),
        least_distance_m=_least(frames, "least_m"),
        least_ttc_s=_least(frames, "ttc_s"),
        braking_s=None if braking is None else float(frames[braking]["time_s"]),
        phantom_brakings=_phantoms(frames),
        off_road_share=off_share,
        lateral_peak_m=float(np.abs(lateral).max()),
        jerk_peak_mps3=float(np.abs(jerk).max()),
        jerk_rms_mps3=float(np.sqrt(np.mean(jerk**2))),
        progress=progress,
        score=progress * factor * (1 - off_share),
        ran_red_light=ran_red_light,
    )


def _least(frames: Sequence[Json], name: str) -> float | None:
    return min((float(frame[name]) for frame in frames if frame[name] is not None), default=None)


def _phantoms(frames: Sequence[Json]) -> int:
    """Number of phases of hard braking during which there is no hazard."""
    count, length = 0, 0
    for frame in frames:
        is_phantom = "command" in frame and frame["command"][0] <= -PHANTOM_MPS2 and not frame["is_hazard"]
        length = length + 1 if is_phantom else 0
        count += length == PHANTOM_FRAMES
    return count


def _off_road_share(arc_m: Points, is_off: Points) -> float:
    """Share of the driven way on which the car is outside its lane; of the time where it does not move."""
    ways_m = np.abs(np.diff(arc_m))
    if ways_m.sum() < 1e-6:
        return float(is_off.mean())
    return float((ways_m * is_off[1:]).sum() / ways_m.sum())


def _progress(head: Json, frames: Sequence[Json]) -> float:
    """Driven share of the way that a perfect driver would drive in the same time."""
    draw, start_m, conflict_m = head["scenario"], float(head["start_s_m"]), head["conflict_s_m"]
    scenario, speed_mps = draw["scenario"], float(draw["speed_mps"])
    driven_m = float(frames[-1]["s_m"]) - start_m
    wanted_m = speed_mps * float(scenario["duration_s"])
    if scenario["walker"] is not None and scenario["walker"]["pace_mps"] > 0:
        wanted_m = float(conflict_m) + PASSED_M - start_m
    elif conflict_m is not None and math.isfinite(float(conflict_m)):
        lead_mps = _lead_mps(scenario, speed_mps)
        gap_m = (float(conflict_m) - start_m) * (1 - lead_mps / speed_mps)
        wanted_m = min(wanted_m, gap_m + lead_mps * float(scenario["duration_s"]) - STANDING_GAP_M)
    return min(1.0, max(0.0, driven_m / max(wanted_m, 1.0)))


def _lead_mps(scenario: Json, speed_mps: float) -> float:
    lead = scenario["lead"]
    if lead is None:
        return 0.0
    wanted = lead["speed_share"] * speed_mps if lead["speed_kmh"] is None else lead["speed_kmh"] / 3.6
    return min(float(wanted), speed_mps)
