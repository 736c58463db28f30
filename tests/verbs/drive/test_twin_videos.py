"""Videos of twins, from videos that are written by hand in place of drives."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gear.config.nodes import parse_text
from gear.config.reader import read_node
from gear.driving.config import DriveConfig
from gear.driving.drives import Drives, patches_of, plan_drives
from gear.driving.video import decoded, encoded
from gear.driving.worker import VIDEO, DriveResult
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import DatasetError
from gear.verbs.drive.twin_videos import write_twin_videos

from .test_report import MEASURES

TEXT = f"""
drivers:
  eyes: {{controller: blind, task: depth}}
  blind: {{controller: blind}}
towns: {{"{TINY_TOWN}": [board]}}
scenarios: {{stopped_lead: [40], free_road: [30]}}
twins: [none, random]
video: true
collect: {{scenes: "{TINY_SCENES}"}}
"""


@pytest.fixture
def drives(tmp_path: Path) -> Drives:
    pytest.importorskip("av")
    drives = plan_drives(read_node(DriveConfig, parse_text(TEXT, "tiny.yml")), tmp_path)
    for number, (run, patch) in enumerate(zip(drives.runs, patches_of(drives, drives.runs), strict=True)):
        if drives.has_video(run):
            folder = tmp_path / drives.folder(run, patch)
            folder.mkdir(parents=True)
            (folder / VIDEO).write_bytes(encoded([np.full((32, 64, 3), 40 * number, np.uint8)] * (1 + number)))
    return drives


def results(drives: Drives) -> list[DriveResult]:
    return [DriveResult(run=run, measures=MEASURES, log_sha256="0" * 64, patch=run.twin) for run in drives.runs]


def test_twins_of_a_situation_share_a_video_which_is_made_once(drives: Drives) -> None:
    written = write_twin_videos(drives, results(drives))
    assert [title.split(":")[1].split(" at")[0] for title, _ in written] == [" stopped_lead", " free_road"]
    paths = [drives.root / path for _, path in written]
    assert [len(list(decoded(path.read_bytes()))) for path in paths] == [2, 4]
    paths[0].write_bytes(b"kept")
    assert write_twin_videos(drives, results(drives)) == written
    assert paths[0].read_bytes() == b"kept"


def test_one_twin_alone_has_no_such_video(drives: Drives) -> None:
    only = [one for one in results(drives) if one.run.twin == "none"]
    assert write_twin_videos(drives, only) == []
    assert write_twin_videos(replace(drives, config=replace(drives.config, video=False)), results(drives)) == []


def test_a_damaged_video_is_one_line(drives: Drives) -> None:
    for path in drives.root.glob(f"drives/*/*/{VIDEO}"):
        path.write_bytes(path.read_bytes()[:40])
    with pytest.raises(DatasetError, match="damaged video") as caught:
        write_twin_videos(drives, results(drives))
    assert "\n" not in str(caught.value)
