"""Reads the drives of `gear drive` for the HTML page: outcomes, motion in each frame, and pictures of the videos.

The folder may come from a stranger. Every number is checked, texts are only passed on, and a damaged drive is named in
one line and does not stop the others.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gear.dataset.files import inside
from gear.dataset.json_text import parse_json
from gear.dataset.sealed_json import DamagedError, load_sealed
from gear.driving.drives import RUNS, DriveRun
from gear.driving.measures import Measures
from gear.driving.video import decoded
from gear.plugins.text import printable
from gear.values.errors import DatasetError, GearError
from gear.values.frames import UInt8Image
from gear.values.regular_file import read_regular
from gear.values.serial import Json, from_json

RESULT, LOG, VIDEO, CONFIG = "result.json", "log.jsonl", "video.mp4", "drive.yml"
"""Names of files of `gear drive`."""

MOST_BYTES = 256 << 20
"""Largest size of a log or of a video in bytes."""

MOST_FRAMES, MOST_SIDE_PX = 20_000, 8192
"""Largest number of frames of a drive, and largest side of a video's picture, pixels."""

DIGITS = 2
"""Number of decimals of metres, seconds and speeds on the page; directions have one more."""

DAMAGE = (LookupError, TypeError, ValueError, RecursionError, AttributeError, OverflowError)
"""Errors of values in files that gear did not write."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredDrive:
    """A drive on the disk.

    Attributes:
        root: folder of the study.
        folder: folder of the drive, relative to the root.
        run: the drive.
        measures: its measures.
    """

    root: Path
    folder: str
    run: DriveRun
    measures: Measures

    @property
    def title(self) -> str:
        """The drive in one printable line, with the name of its study."""
        return f"{printable(self.root.name)}/{self.run.title}"

    @property
    def has_video(self) -> bool:
        """Whether the folder of the drive has a video."""
        return (self.root / self.folder / VIDEO).is_file()


def study_roots(path: str | Path) -> list[Path]:
    """The folders of `gear drive` at a path: the path itself, or the folders in it; empty if there are none.

    Args:
        path: any path.
    """
    root = Path(path)
    try:
        every = [root, *sorted(one for one in root.iterdir() if one.is_dir())] if root.is_dir() else []
    except OSError:
        return []
    found = [one for one in every if (one / CONFIG).is_file() and (one / RUNS).is_dir()]
    return [root] if root in found else found


def stored_drives(root: Path) -> Iterator[StoredDrive | str]:
    """Yields the drives of a study in the order of their folders; a text of one line for each damaged drive.

    Args:
        root: folder of the study.

    Raises:
        DatasetError: the folder cannot be read.
    """
    try:
        folders = sorted((root / RUNS).glob("*/*/"))
    except OSError as error:
        raise DatasetError(root / RUNS, f"cannot be read: {error.strerror}") from error
    for folder in folders:
        relative = folder.relative_to(root).as_posix()
        if not (folder / RESULT).is_file():
            continue
        try:
            content: Json = load_sealed(inside(root, f"{relative}/{RESULT}"))
            run = from_json(DriveRun, content["result"]["run"])
            measures = from_json(Measures, content["result"]["measures"])
            yield StoredDrive(root=root, folder=relative, run=run, measures=measures)
        except (GearError, OSError, *DAMAGE) as error:
            problem = "is damaged" if isinstance(error, (DamagedError, *DAMAGE)) else printable(str(error))
            yield printable(f"{relative}/{RESULT}: {problem}")


def motion(drive: StoredDrive) -> dict[str, Json]:
    """The motion in a drive, for the page's map and curves.

    Args:
        drive: the drive.

    Returns:
        `scripted` (id of the scripted road user, or None), `is_walker` (whether it is a person), and lists with one
        entry per frame: `time_s`, `ego` (x, y, yaw), `speed_kmh`, `acceleration_mps2`, `ttc_s` (None where nothing is
        approached), `gap_m`, `is_emergency` and `actors` (id, x, y, yaw of each road user). World coordinates, metres
        and radians.

    Raises:
        ValueError: the log is damaged; the message is one line.
    """
    try:
        data = read_regular(inside(drive.root, f"{drive.folder}/{LOG}"), most_bytes=MOST_BYTES)
        head, *frames, _end = [_object(parse_json(line)) for line in data.splitlines()[: MOST_FRAMES + 3]]
        if not 1 <= len(frames) <= MOST_FRAMES:
            raise ValueError("no frames, or too many")
        return {
            "scripted": None if head["scripted_id"] is None else int(head["scripted_id"]),
            "is_walker": _object(_object(head["scenario"])["scenario"]).get("walker") is not None,
            "time_s": [_number(one["time_s"]) for one in frames],
            "ego": [[*_numbers(one["ego"][:2], 2), _number(one["ego"][3], DIGITS + 1)] for one in frames],
            "speed_kmh": [_number(3.6 * one["speed_mps"]) for one in frames],
            "acceleration_mps2": [_number(one["acceleration_mps2"]) for one in frames],
            "ttc_s": [None if one["ttc_s"] is None else _number(one["ttc_s"]) for one in frames],
            "gap_m": [None if one["gap_m"] is None else _number(one["gap_m"]) for one in frames],
            "is_emergency": [bool(_object(one.get("notes", {})).get("is_emergency", 0)) for one in frames],
            "actors": [[[int(actor[0]), *_numbers(actor[1:4], 3)] for actor in one["actors"]] for one in frames],
        }
    except (GearError, OSError, *DAMAGE) as error:
        problem = printable(str(error)) if isinstance(error, (GearError, OSError)) else "is damaged"
        raise ValueError(f"{LOG}: {problem}") from error


def pictures(drive: StoredDrive, count: int) -> Iterator[UInt8Image]:
    """Yields the pictures of a drive's video, at most one per frame of the log.

    Args:
        drive: a drive with a video.
        count: number of the frames in the log.

    Returns:
        (H, W, 3) uint8 pictures.

    Raises:
        ValueError: the video cannot be read, or is too large; the message is one line.
    """
    try:
        data = read_regular(inside(drive.root, f"{drive.folder}/{VIDEO}"), most_bytes=MOST_BYTES)
        for picture in itertools.islice(decoded(data), count):
            if max(picture.shape) > MOST_SIDE_PX:
                raise ValueError("the pictures are too large")
            yield picture
    except ModuleNotFoundError as error:
        raise ValueError(f"{VIDEO}: pictures of videos need PyAV: pip install 'mujoco-gear[video]'") from error
    except (GearError, OSError, ValueError) as error:
        raise ValueError(f"{VIDEO}: {printable(str(error))}") from error


def _object(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise TypeError("expected an object")
    return value


def _number(value: Any, digits: int = DIGITS) -> float:
    number = float(value)
    if isinstance(value, str) or not math.isfinite(number) or abs(number) > 1e9:
        raise ValueError("expected a number")
    return round(number, digits)


def _numbers(values: Any, count: int) -> list[float]:
    if not isinstance(values, list) or len(values) != count:
        raise ValueError(f"expected {count} numbers")
    return [_number(one, DIGITS + 1 if place == 2 else DIGITS) for place, one in enumerate(values)]
