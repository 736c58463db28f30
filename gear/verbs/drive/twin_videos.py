"""The videos of a study in which the twins of one situation drive beside each other."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

from gear.dataset.files import read_bytes, write_whole
from gear.driving.drives import RUNS, Drives, patches_of
from gear.driving.video import beside_each_other
from gear.driving.worker import VIDEO, DriveResult
from gear.values.errors import DatasetError
from gear.values.progress import Progress

VIDEOS = "videos"
"""Name of the folder of the videos of twins."""


def write_twin_videos(
    drives: Drives, results: Sequence[DriveResult], on_progress: Progress = lambda done, total: None
) -> list[tuple[str, str]]:
    """Writes one video for each situation of each driver of which at least two twins have a video; a video that is
    there is not made again.

    Args:
        drives: the study.
        results: the finished drives.
        on_progress: called after every video with the numbers of finished and of all videos.

    Returns:
        Title and path, relative to the folder of the study, of each video, in the order of the drives.

    Raises:
        DatasetError: a video of a drive is damaged, or a file cannot be written.
    """
    groups: dict[tuple[str, object], list[DriveResult]] = {}
    for one in results:
        if drives.has_video(one.run):
            groups.setdefault((one.run.driver, one.run.situation), []).append(one)
    written, several = [], [group for group in groups.values() if len(group) > 1]
    for group in several:
        title = group[0].run.title.rsplit(",", 1)[0]
        written.append((title, _written(drives, group)))
        on_progress(len(written), len(several))
    return written


def _written(drives: Drives, group: Sequence[DriveResult]) -> str:
    """Writes the video of one situation, unless it is there; returns its path relative to the folder of the study."""
    runs = [one.run for one in group]
    folders = [drives.folder(run, patch) for run, patch in zip(runs, patches_of(drives, runs), strict=True)]
    videos = [read_bytes(drives.root / folder / VIDEO) for folder in folders]
    digest = hashlib.sha256("".join(hashlib.sha256(data).hexdigest() for data in videos).encode()).hexdigest()[:8]
    name = Path(folders[0]).name.rsplit("-", 2)[0]
    path = f"{VIDEOS}/{runs[0].driver}/{name}-{digest}.mp4"
    if not (drives.root / path).is_file():
        try:
            data = beside_each_other(videos)
        except ValueError as error:
            problem = (
                f"holds a damaged video of {runs[0].title} or of a twin ({error}); delete these folders and run again"
            )
            raise DatasetError(drives.root / RUNS, problem) from error
        write_whole(drives.root, path, data)
    return path
