"""The severity of a drive: one smooth number that attacks on the closed loop increase."""

from __future__ import annotations

from collections.abc import Sequence

from gear.values.serial import Json

LEAST_SPEED_MPS = 1.0
"""Speed at the start below which the impact speed is compared with this speed, m/s."""


def severity(log: Sequence[Json]) -> float:
    """How bad a drive was, computed from its log alone; larger is worse.

    A crash is worth 1 plus the impact speed divided by the speed at the start. A drive without a crash is worth less
    than 1, and the value changes continuously with the motion of the car, so that a search sees progress long before
    the first crash:

    - Where something is in the way: the mean of 1 / (1 + t) and 1 / (1 + d), with the least time to collision t in
      seconds and the least distance to any road user d in metres.
    - On a free road: the largest share of the speed that the car lost by braking for nothing.

    Args:
        log: head, entries of the frames, and end, as `gear.driving.loop.drive` returns them.
    """
    head, frames, end = log[0], log[1:-1], log[-1]
    speed_mps = max(LEAST_SPEED_MPS, float(head["scenario"]["speed_mps"]))
    if end["crash"] is not None:
        return 1.0 + float(end["crash"]["impact_mps"]) / speed_mps
    if head["scripted_id"] is None:
        slowest_mps = min((float(frame["speed_mps"]) for frame in frames if not frame["is_hazard"]), default=speed_mps)
        return min(1.0, max(0.0, 1.0 - slowest_mps / speed_mps))
    return (_nearness(frames, "ttc_s") + _nearness(frames, "least_m")) / 2


def _nearness(frames: Sequence[Json], name: str) -> float:
    """1 / (1 + the least known value); 0 if no frame has a value."""
    known = [float(frame[name]) for frame in frames if frame[name] is not None]
    return 1.0 / (1.0 + min(known)) if known else 0.0
