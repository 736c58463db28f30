"""The tracker of the baselines: confirms an obstacle by 2 of 3 frames, estimates its speed, and remembers it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gear.contracts.controllers import Points

MEMORY_S = 0.5
"""Time after which an obstacle is forgotten that no frame has shown, seconds."""

WANTED_OF_LAST = (2, 3)
"""An obstacle counts when this many of this many last frames have shown it."""

GATE_M, GATE_SHARE = 2.0, 0.2
"""A frame shows a known obstacle if the gap is nearer to the expected one than this distance, or this share of the gap.
"""

NOISE_M, NOISE_SHARE = 0.2, 0.04
"""Standard deviation of a measured gap: metres, plus a share of the gap."""

FIRST_SPEED_STD_MPS, ACCELERATION_STD_MPS2 = 8.0, 3.0
"""Standard deviations of an obstacle's speed when it is first seen (about standing still), and of its acceleration."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """The nearest obstacle in the corridor in one frame.

    Attributes:
        gap_m: free distance from the front of the ego car to the obstacle.
        speed_mps: speed of the obstacle along the path, where it is known; None where it is to be estimated.
    """

    gap_m: float
    speed_mps: float | None = None


@dataclass(slots=True, eq=False)
class Track:
    """One obstacle over several frames: a Kalman filter of its gap and of its speed along the path.

    Attributes:
        state: (2,) gap in metres and speed in m/s.
        covariance: (2, 2) covariance of the state.
        seen_s: time of the last frame that showed it.
        hits: for each of the last frames, whether it showed the obstacle.
        is_confirmed: whether enough frames have shown it.
    """

    state: Points
    covariance: Points
    seen_s: float
    hits: list[bool] = field(default_factory=lambda: [True])
    is_confirmed: bool = False

    @property
    def gap_m(self) -> float:
        """Estimated free distance from the front of the ego car to the obstacle, metres."""
        return float(self.state[0])

    @property
    def speed_mps(self) -> float:
        """Estimated speed along the path."""
        return float(self.state[1])


class Tracker:
    """Follows obstacles over the frames of a drive: confirms them, estimates their speed and remembers them for
    `MEMORY_S`.
    """

    def __init__(self) -> None:
        self._tracks: list[Track] = []
        self._time_s = 0.0

    def update(self, sighting: Sighting | None, time_s: float, ego_mps: float) -> Track | None:
        """Takes over the sighting of a frame.

        Args:
            sighting: the nearest obstacle in this frame; None if the frame shows none.
            time_s: time of the frame.
            ego_mps: speed of the ego car.

        Returns:
            The confirmed obstacle with the smallest gap; None without one.
        """
        step_s, self._time_s = max(0.0, time_s - self._time_s), time_s
        for track in self._tracks:
            _predict(track, step_s, ego_mps)
        shown = None
        if sighting is not None:
            shown = self._matching(sighting)
            if shown is None:
                shown = _begin(sighting, time_s)
                self._tracks.append(shown)
            else:
                _correct(shown, sighting)
                shown.seen_s = time_s
                shown.hits.append(True)
        wanted, last = WANTED_OF_LAST
        for track in self._tracks:
            if track is not shown:
                track.hits.append(False)
            track.hits = track.hits[-last:]
            track.is_confirmed = track.is_confirmed or sum(track.hits) >= wanted
        self._tracks = [track for track in self._tracks if time_s - track.seen_s < MEMORY_S - 1e-9]
        confirmed = [track for track in self._tracks if track.is_confirmed]
        return min(confirmed, key=lambda track: track.gap_m, default=None)

    def _matching(self, sighting: Sighting) -> Track | None:
        gate_m = max(GATE_M, GATE_SHARE * sighting.gap_m)
        near = [track for track in self._tracks if abs(track.gap_m - sighting.gap_m) <= gate_m]
        return min(near, key=lambda track: abs(track.gap_m - sighting.gap_m), default=None)


def _begin(sighting: Sighting, time_s: float) -> Track:
    speed_mps, std_mps = (0.0, FIRST_SPEED_STD_MPS) if sighting.speed_mps is None else (sighting.speed_mps, 0.1)
    return Track(
        state=np.array([sighting.gap_m, speed_mps]),
        covariance=np.diag([_noise_m(sighting) ** 2, std_mps**2]),
        seen_s=time_s,
    )


def _predict(track: Track, step_s: float, ego_mps: float) -> None:
    motion = np.array([[1.0, step_s], [0.0, 1.0]])
    track.state = motion @ track.state - np.array([ego_mps * step_s, 0.0])
    pushed = np.array([step_s**2 / 2, step_s]) * ACCELERATION_STD_MPS2
    track.covariance = motion @ track.covariance @ motion.T + np.outer(pushed, pushed)


def _correct(track: Track, sighting: Sighting) -> None:
    if sighting.speed_mps is not None:
        track.state = np.array([sighting.gap_m, sighting.speed_mps])
        return
    gain = track.covariance[:, 0] / (track.covariance[0, 0] + _noise_m(sighting) ** 2)
    track.state = track.state + gain * (sighting.gap_m - track.state[0])
    track.covariance = track.covariance - np.outer(gain, track.covariance[0])


def _noise_m(sighting: Sighting) -> float:
    return NOISE_M + NOISE_SHARE * sighting.gap_m
