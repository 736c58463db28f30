"""Makes the HTML page of `gear drive`: a list of drives, a player, a map from above and curves over time.

Like the page of a dataset, it is one file that opens from disk. Texts and numbers are embedded as data, never as HTML.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from gear.driving.drawing import HIT
from gear.driving.measures import Measures
from gear.values.errors import DatasetError
from gear.values.frames import UInt8Image
from gear.values.progress import Progress
from gear.values.serial import Json, to_json
from gear.view.build import deflated
from gear.view.document import asset, block, framed, script
from gear.view.drives import StoredDrive, motion, pictures, stored_drives
from gear.view.encoding import MEDIA_TYPE, SCALES, encode, largest_scale
from gear.view.rows import finite
from gear.view.streets import streets

SCRIPTS = ("dom", "drive_map", "drive_curves", "drives")
"""Names of the JavaScript files in `gear/view/page`, in the order in which they are joined."""

STEPS = (1, 2, 5, 10)
"""Numbers of frames from one shown picture to the next, of which the smallest that fits the budget is used."""

LEAST_SCALE = 0.5
"""Scale of the pictures below which fewer pictures are shown instead, so that their text stays legible."""

PROBES = 4
"""Number of drives from whose pictures the size of the page is estimated."""

END = {"stood": "stopped", "passed": "passed the person", "time": "drove to the end", "off_road": "left the road"}
"""Words for the ends of drives without a crash; other ends are shown with their own name."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DrivePage:
    """The content of a page.

    Attributes:
        title: title of the page.
        index: what the page's script reads first, as JSON.
        motions: motion of each drive, compressed.
        films: pictures of each drive as base64 texts of WebP files, one per line; "" without pictures.
        scale: factor by which the pictures were resized.
        problems: number of the drive and problem, for drives that are not shown in full; -1 for damaged results.
    """

    title: str
    index: Json
    motions: tuple[bytes, ...]
    films: tuple[str, ...]
    scale: float
    problems: tuple[tuple[int, str], ...] = field(default=())

    def document(self) -> Iterator[str]:
        """Yields the HTML page in pieces of text."""
        style = asset("style.css") + asset("drives.css")
        code, blocks = script(SCRIPTS), self._blocks()
        return framed("drives.html", title=self.title, style=style, code=code, index=self.index, blocks=blocks)

    def _blocks(self) -> Iterator[str]:
        """Yields the script blocks with motions and pictures of the drives."""
        for number, data in enumerate(self.motions):
            yield block(f"d{number}", data)
        for number, film in enumerate(self.films):
            if film:
                yield f'<script type="text/plain" id="f{number}">{film}</script>\n'


def drive_page(
    roots: Sequence[Path], *, most: int | None, budget_bytes: float, on_progress: Progress | None
) -> DrivePage:
    """Reads the drives of studies and makes their page.

    Args:
        roots: folders of `gear drive`.
        most: number of drives, counted from the first; None for all.
        budget_bytes: bytes for the encoded pictures.
        on_progress: called after every drive with the numbers of finished and of all drives.

    Raises:
        DatasetError: there is no drive to show, or a folder cannot be read.
    """
    found: list[StoredDrive] = []
    problems: list[tuple[int, str]] = []
    for root in roots:
        for one in stored_drives(root):
            if isinstance(one, StoredDrive):
                found.append(one)
            else:
                problems.append((-1, one))
    found = found[:most]
    if not found:
        problem = f"{problems[0][1]}" if problems else "has no finished drive"
        raise DatasetError(roots[0], problem)
    read = [_motion(number, drive, problems) for number, drive in enumerate(found)]
    frames = [len(one["time_s"]) if one else 0 for one in read]
    step, scale = _step_and_scale(found, frames, budget_bytes)
    films = []
    for number, drive in enumerate(found):
        films.append(_film(number, drive, frames[number], step, scale, problems))
        if on_progress is not None:
            on_progress(number + 1, len(found))
    index = {
        "mediaType": MEDIA_TYPE,
        "step": step,
        "studies": [root.resolve().name for root in roots],
        "problems": [text for number, text in problems if number < 0],
        "streets": {town: streets(town) for town in _towns(found)},
        "drives": [_row(drive, roots, number, problems) for number, drive in enumerate(found)],
    }
    return DrivePage(
        title=f"drives · {', '.join(root.resolve().name for root in roots)}",
        index=finite(index),
        motions=tuple(deflated(one) for one in read),
        films=tuple(films),
        scale=scale,
        problems=tuple(problems),
    )


def outcome(measures: Measures) -> str:
    """The end of a drive in a few words, such as `crash with a vehicle at 23 km/h`."""
    if not measures.is_crash:
        return END.get(measures.ending, measures.ending.replace("_", " "))
    hit = HIT.get(measures.crash_kind, measures.crash_kind)
    return f"crash with {hit} at {3.6 * (measures.impact_mps or 0.0):.0f} km/h"


def _row(drive: StoredDrive, roots: Sequence[Path], number: int, problems: Sequence[tuple[int, str]]) -> Json:
    run = drive.run
    return {
        "study": roots.index(drive.root),
        "driver": run.driver,
        "town": run.town,
        "place": f"{Path(run.town).stem}/{run.scene}",
        "scenario": run.scenario,
        "speed_kmh": run.speed_kmh,
        "seed": run.seed,
        "twin": run.twin,
        "outcome": outcome(drive.measures),
        "measures": to_json(drive.measures),
        "problem": "; ".join(text for at, text in problems if at == number),
    }


def _motion(number: int, drive: StoredDrive, problems: list[tuple[int, str]]) -> Json:
    """The motion of a drive; None if its log is damaged, which is added to the problems."""
    try:
        return motion(drive)
    except ValueError as error:
        problems.append((number, f"{drive.title}: {error}"))
        return None


def _towns(drives: Sequence[StoredDrive]) -> list[str]:
    """Names of towns; paths of files are left out, because a stranger's result must not decide which files are read."""
    return sorted({one.run.town for one in drives if not set("/\\.:~") & set(one.run.town)})


def _shown(drive: StoredDrive, count: int, step: int) -> Iterator[UInt8Image]:
    """Every `step`-th picture of a drive, and the last one."""
    last = None
    for number, picture in enumerate(pictures(drive, count)):
        last = picture
        if number % step == 0:
            last = None
            yield picture
    if last is not None:
        yield last


def _film(number: int, drive: StoredDrive, count: int, step: int, scale: float, problems: list[tuple[int, str]]) -> str:
    """The pictures of a drive, encoded; those before a damaged picture if the video is damaged."""
    lines: list[str] = []
    if not count or not drive.has_video:
        return ""
    try:
        for picture in _shown(drive, count, step):
            lines.append(base64.b64encode(encode(picture, scale).data).decode())
    except ValueError as error:
        problems.append((number, f"{drive.title}: {error}"))
    return "\n".join(lines)


def _step_and_scale(drives: Sequence[StoredDrive], frames: Sequence[int], budget_bytes: float) -> tuple[int, float]:
    """How many pictures are shown, and at which scale, so that they fit the budget."""
    filmed = [(one, count) for one, count in zip(drives, frames, strict=True) if count and one.has_video]
    probes: list[list[UInt8Image]] = []
    for drive, count in filmed[:: max(1, len(filmed) // PROBES)]:
        try:
            probes.append(list(pictures(drive, count))[::40])
        except ValueError:
            continue  # the page says so where the drive is shown
    several = [[picture] for one in probes for picture in one]
    if not several:
        return 1, 1.0
    total = sum(count for _, count in filmed)
    scale = SCALES[-1]
    for step in STEPS:
        scale = largest_scale(several, -(-total // step), budget_bytes)
        if scale >= LEAST_SCALE:
            return step, scale
    return STEPS[-1], scale
