"""The bird's-eye map of a situation: the ways of its twins, and their speeds over time."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence

import numpy as np

from gear.contracts.tasks import NO_PATCH, RANDOM_PATCH
from gear.driving.config import PATCH
from gear.values.serial import Json

COLOURS = {NO_PATCH: "#2f7d4f", RANDOM_PATCH: "#8b95a1", PATCH: "#b3402a"}
SIZE_IN = (9.0, 2.6)


def chart(logs: Mapping[str, Sequence[Json]]) -> bytes:
    """Draws the twins of one situation as an SVG; equal logs give equal bytes.

    Left: the ways of the ego car from above, with the scripted road user's way in black, in the frame of the start (x
    along the first heading, y to the left). A cross is a crash. Right: the speed over time.

    Args:
        logs: log of each twin, by name.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE_IN, layout="constrained")
    FigureCanvasAgg(figure)
    above, speeds = figure.subplots(1, 2, width_ratios=(3, 2))
    start = next(iter(logs.values()))[1]["ego"]
    for number, (twin, log) in enumerate(logs.items()):
        frames, colour, width = log[1:-1], COLOURS.get(twin, "#1f5fa8"), 3.4 - number
        way = from_start(start, [frame["ego"][:2] for frame in frames])
        above.plot(way[:, 0], way[:, 1], color=colour, lw=width, label=twin)
        scripted = _scripted(log)
        if scripted:
            other = from_start(start, scripted)
            above.plot(other[:, 0], other[:, 1], color="0.1", lw=1.0, ls=":")
            above.plot(*other[-1], color="0.1", marker="s", ms=3)
        kmh = [3.6 * frame["speed_mps"] for frame in frames]
        times_s = [frame["time_s"] for frame in frames]
        speeds.plot(times_s, kmh, color=colour, lw=width)
        if log[-1]["crash"] is not None:
            above.plot(*way[-1], color=colour, marker="x", ms=8, mew=2)
            speeds.plot(times_s[-1], kmh[-1], color=colour, marker="x", ms=8, mew=2)
    above.set_xlabel("ahead of the start, m", fontsize=8)
    above.set_ylabel("left, m", fontsize=8)
    low, high = above.get_ylim()
    above.set_ylim(min(low, -4.0), max(high, 4.0))
    speeds.set_xlabel("s", fontsize=8)
    speeds.set_ylabel("km/h", fontsize=8)
    for axis in (above, speeds):
        axis.tick_params(labelsize=8)
        axis.grid(alpha=0.3)
    figure.legend(loc="outside upper center", ncols=3, frameon=False, fontsize=8)
    data = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "gear", "svg.fonttype": "path"}):
        figure.savefig(data, format="svg", metadata={"Date": None})
    return data.getvalue()


def from_start(start: Sequence[float], points: Sequence[Sequence[float]]) -> np.ndarray:
    """(N, 2) points in the frame of the start, from points in world coordinates.

    Args:
        start: x, y, z and yaw of the ego car in the first frame.
        points: N points, x and y.
    """
    c, s = math.cos(start[3]), math.sin(start[3])
    offsets = np.asarray(points, np.float64).reshape(-1, 2) - np.asarray(start[:2])
    return np.asarray(offsets @ np.array([[c, -s], [s, c]]))


def _scripted(log: Sequence[Json]) -> list[list[float]]:
    """The way of the scripted road user, x and y in each frame; empty on a free road."""
    number = log[0]["scripted_id"]
    return [actor[1:3] for frame in log[1:-1] for actor in frame["actors"] if actor[0] == number]
