"""Draws the frames of a drive's video: lines of text with units, the camera's picture, and what the network saw."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np

from gear.contracts.controllers import Action
from gear.driving.simulation import Situation
from gear.formats.cityscapes import COLOURS
from gear.formats.coco import CATEGORY_NAMES
from gear.values.frames import UInt8Image

LEAST_WIDTH_PX, WIDTH_PX = 640, 832
"""Smallest and largest width of a frame, pixels: smaller pictures are enlarged so that the text fits, larger ones are
reduced.
"""

FARTHEST_M = 60.0
"""Depth at the end of the colour scale, metres."""

BRAKES_MPS2, SPEEDS_UP_MPS2 = -1.0, 0.3
"""Commanded accelerations below and above which the state is called braking and speeding up, m/s²."""

LINE_PX, MARGIN_PX, FONT_SCALE = 26, 8, 0.62
WHITE, GREY, RED, GREEN, BLACK = (255, 255, 255), (190, 190, 190), (215, 40, 30), (30, 120, 60), (0, 0, 0)
FONT = cv2.FONT_HERSHEY_SIMPLEX

UNITS = (("_mps2", "m/s^2"), ("_mps", "m/s"), ("_kmh", "km/h"), ("_m", "m"), ("_s", "s"), ("_rad", "rad"))
"""Units by the last part of a note's name."""

HIT = {"vehicle": "a vehicle", "person": "a person", "static": "the town"}
"""Words for what a car hit, by kind of the crash."""

ENDINGS = {
    "stood": "no crash: the car stands",
    "passed": "no crash: passed the person",
    "time": "no crash until the end",
    "off_road": "left the road",
}
"""Words for the ends of drives without a crash; other ends are shown with their own name."""


def drawn(title: str, situation: Situation, picture: UInt8Image, seen: Any, action: Action) -> UInt8Image:
    """One frame of a drive's video: three lines of text, the picture with the predicted boxes, and below it the
    predicted label or depth map, if there is one.

    Args:
        title: the drive in a few words; the first line.
        situation: the state of the drive.
        picture: (H, W, 3) uint8 picture of the first camera; it is not changed.
        seen: prediction of the network; None without a network.
        action: the controller's decision: the second line shows its acceleration and state and is red during
            emergency braking; the third line shows its notes with units.

    Returns:
        (H', W', 3) uint8 frame with even sides.
    """
    shown, scale = _fitted(picture)
    for box, name in _boxes(seen):
        _outline(shown, [round(scale * side) for side in box], name)
    parts = [shown]
    dense = _coloured(seen)
    if dense is not None:
        parts += [_text(dense[0], shown.shape[1], GREY), _fitted(dense[1], nearest=True)[0]]
    lines = [
        _text(title, shown.shape[1]),
        _text(_motion(situation, action), shown.shape[1], paper=RED if _is_emergency(action) else BLACK),
        _text(_notes(action), shown.shape[1], GREY),
    ]
    return _stacked([*lines, *parts])


def drawn_end(title: str, situation: Situation, picture: UInt8Image, height_px: int) -> UInt8Image:
    """The last frame of a video: the picture at the end of the drive, and how the drive ended; red for a crash, for a
    car that left the road, and for a red light that was run.

    Args:
        title: the drive in a few words; the first line.
        situation: the state at the end.
        picture: (H, W, 3) uint8 picture of the first camera; it is not changed.
        height_px: height of the video's other frames, even.

    Returns:
        (height_px, W', 3) uint8 frame.
    """
    shown, _ = _fitted(picture)
    is_bad = situation.crash is not None or situation.ending == "off_road" or situation.ran_red_light
    colour = RED if is_bad else GREEN
    cv2.rectangle(shown, (0, 0), (shown.shape[1] - 1, shown.shape[0] - 1), colour, 12)
    width = shown.shape[1]
    lines = [
        _text(title, width),
        _text(outcome(situation), width, paper=colour),
        _text(_end(situation), width, paper=colour),
    ]
    frame = _stacked([*lines, shown])
    return padded(frame, height_px, frame.shape[1])


def outcome(situation: Situation) -> str:
    """The end of a drive in a few words, such as `CRASH with a vehicle: impact 23 km/h`."""
    if situation.crash is None and situation.ran_red_light:
        return "ran the red light"
    if situation.crash is None:
        return ENDINGS.get(situation.ending, situation.ending.replace("_", " "))
    hit = HIT.get(situation.crash.kind, situation.crash.kind)
    return f"CRASH with {hit}: impact {3.6 * situation.crash.impact_mps:.0f} km/h"


def padded(frame: UInt8Image, height_px: int, width_px: int) -> UInt8Image:
    """The frame in the upper left corner of a black picture; what does not fit is cut off.

    Args:
        frame: (H, W, 3) uint8 frame.
        height_px: height of the result.
        width_px: width of the result.
    """
    whole = np.zeros((height_px, width_px, 3), np.uint8)
    kept = frame[:height_px, :width_px]
    whole[: kept.shape[0], : kept.shape[1]] = kept
    return whole


def _end(situation: Situation) -> str:
    time_s = situation.time_s if situation.crash is None else situation.crash.time_s
    return f"after {time_s:.2f} s at {3.6 * situation.ego.speed_mps:.0f} km/h"


def _motion(situation: Situation, action: Action) -> str:
    """Time, speed, command and state of the controller, with units."""
    command_mps2 = action.acceleration_mps2
    state = "BRAKES" if command_mps2 < BRAKES_MPS2 else "SPEEDS UP" if command_mps2 > SPEEDS_UP_MPS2 else "CRUISES"
    if _is_emergency(action):
        state = "EMERGENCY BRAKING"
    speed_kmh = 3.6 * situation.ego.speed_mps
    return f"{situation.time_s:4.1f} s   {speed_kmh:3.0f} km/h   {state}: {command_mps2:+.1f} m/s^2"


def _notes(action: Action) -> str:
    """The notes of the controller with units, but `is_emergency`, which the second line shows."""
    words = []
    for name, value in sorted(action.notes.items()):
        ending, unit = next((pair for pair in UNITS if name.endswith(pair[0])), ("", ""))
        if name != "is_emergency":
            words.append(f"{name.removesuffix(ending).replace('_', ' ')} {value:.1f} {unit}".rstrip())
    return "controller: " + ("   ".join(words) or "no obstacle")


def _is_emergency(action: Action) -> bool:
    return action.notes.get("is_emergency", 0.0) > 0


def _text(words: str, width_px: int, colour: tuple[int, int, int] = WHITE, paper: tuple[int, int, int] = BLACK) -> Any:
    """One line of text, (LINE_PX, width_px, 3) uint8; the text is made smaller where it does not fit. The font has no
    letters but ASCII's: others become question marks.
    """
    line = np.zeros((LINE_PX, width_px, 3), np.uint8)
    line[:] = paper
    shown = words.encode("ascii", "replace").decode()
    (wide_px, _), _ = cv2.getTextSize(shown, FONT, FONT_SCALE, 1)
    scale = FONT_SCALE * min(1.0, (width_px - 2 * MARGIN_PX) / max(wide_px, 1))
    cv2.putText(line, shown, (MARGIN_PX, LINE_PX - MARGIN_PX), FONT, scale, colour, 1, cv2.LINE_AA)
    return line


def _stacked(parts: Sequence[UInt8Image]) -> UInt8Image:
    return np.ascontiguousarray(np.concatenate(list(parts)))


def _coloured(seen: Any) -> tuple[str, UInt8Image] | None:
    """A caption and a picture of a dense prediction: depth in metres, or Cityscapes' label ids; None for other
    predictions.
    """
    if not isinstance(seen, np.ndarray) or seen.ndim != 2:
        return None
    if seen.dtype == np.uint8:
        return "the network's classes, in Cityscapes' colours", np.asarray(COLOURS[np.minimum(seen, len(COLOURS) - 1)])
    far = np.clip(np.nan_to_num(np.asarray(seen, np.float32), nan=FARTHEST_M) / FARTHEST_M, 0.0, 1.0)
    levels = np.asarray(np.rint(255 * (1 - far)), np.uint8)
    coloured = np.ascontiguousarray(cv2.applyColorMap(levels, cv2.COLORMAP_TURBO)[..., ::-1], np.uint8)
    return f"the network's depth: red is near, blue is {FARTHEST_M:.0f} m and more", coloured


def _boxes(seen: Any) -> list[tuple[Sequence[float], str]]:
    """The 2D boxes of detections (left, top, right, bottom in pixels) with class and score; empty for other
    predictions.
    """
    if not isinstance(seen, (tuple, list)):
        return []
    found = []
    for one in seen:
        box, score = getattr(one, "box_px", None), getattr(one, "score", None)
        if box is not None and np.isfinite(box).all():
            name = getattr(one, "type", "") or CATEGORY_NAMES.get(getattr(one, "category_id", 0), "")
            found.append((box, name if score is None else f"{name} {score:.2f}"))
    return found


def _outline(picture: UInt8Image, box: Sequence[int], name: str) -> None:
    """Draws a box (left, top, right, bottom in pixels) and its name above it into a picture."""
    left_px, top_px, right_px, bottom_px = (int(np.clip(side, -10_000, 10_000)) for side in box)
    cv2.rectangle(picture, (left_px, top_px), (right_px, bottom_px), RED, 2)
    place = (max(left_px, 0), max(top_px - 4, 12))
    for colour, thickness in ((BLACK, 3), (WHITE, 1)):
        cv2.putText(picture, name, place, FONT, 0.45, colour, thickness, cv2.LINE_AA)


def _fitted(picture: UInt8Image, *, nearest: bool = False) -> tuple[UInt8Image, float]:
    """A copy of a picture with a width in the allowed range and even sides, as H.264 needs them; and the factor.

    Args:
        picture: (H, W, 3) uint8 picture.
        nearest: whether an enlarged picture keeps its colours, without new ones in between.
    """
    height, width = picture.shape[:2]
    scale = min(max(1.0, LEAST_WIDTH_PX / width), WIDTH_PX / width)
    size = (max(2, round(width * scale) // 2 * 2), max(2, round(height * scale) // 2 * 2))
    if size == (width, height):
        return picture.copy(), 1.0
    larger = cv2.INTER_NEAREST if nearest else cv2.INTER_LINEAR
    method = cv2.INTER_AREA if scale < 1 else larger
    return np.asarray(cv2.resize(picture, size, interpolation=method), np.uint8), scale
