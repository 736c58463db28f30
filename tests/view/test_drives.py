"""Reading stored drives for the page: damaged, foreign and odd files."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any

import pytest

from gear.view.drives import StoredDrive, motion, pictures, stored_drives, study_roots

from .drive_studies import change_frame


@pytest.fixture
def study(drive_study: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(drive_study, tmp_path / "study"))


def drives(root: Path) -> dict[tuple[str, str], StoredDrive]:
    return {(one.run.driver, one.run.twin): one for one in stored_drives(root) if isinstance(one, StoredDrive)}


def test_studies_are_found_alone_and_in_a_folder(study: Path, tmp_path: Path) -> None:
    assert study_roots(study) == [study]
    shutil.copytree(study, tmp_path / "other")
    (tmp_path / "notes").mkdir()
    assert study_roots(tmp_path) == [tmp_path / "other", study]
    assert study_roots(tmp_path / "notes") == [] == study_roots(tmp_path / "missing")


def test_the_motion_has_one_entry_per_frame(study: Path) -> None:
    found = drives(study)
    assert list(found) == [("blind", "none"), ("blind", "patch"), ("truth", "none")]
    shown = motion(found["blind", "none"])
    frames = len(shown["time_s"])
    assert shown["time_s"][:3] == [0.0, 0.1, 0.2] and shown["speed_kmh"][0] == pytest.approx(40, abs=0.1)
    assert {len(shown[key]) for key in ("ego", "ttc_s", "actors", "is_emergency", "acceleration_mps2")} == {frames}
    assert any(actor[0] == shown["scripted"] for actor in shown["actors"][0]) and not shown["is_walker"]
    way_m = shown["ego"][-1][0] - shown["ego"][0][0]
    assert way_m == pytest.approx(40 / 3.6 * (frames - 1) / 10, abs=1.0), "the blind car does not brake"


def test_a_video_has_at_most_one_picture_per_frame(study: Path) -> None:
    drive = drives(study)["blind", "patch"]
    assert drive.has_video and not drives(study)["blind", "none"].has_video
    assert len(list(pictures(drive, 99))) == 6 and len(list(pictures(drive, 4))) == 4


@pytest.mark.parametrize(
    "change",
    [
        {"ego": "abc"}, {"ego": [1.0]}, {"speed_mps": None}, {"speed_mps": 1e300}, {"speed_mps": "5"},
        {"actors": [[1, 2]]}, {"actors": [["x", 1, 2, 3, 4]]}, {"actors": 5}, {"notes": [1]}, {"time_s": {}},
    ],
)  # fmt: skip
def test_a_damaged_log_is_one_line(study: Path, change: dict[str, Any]) -> None:
    drive = drives(study)["blind", "none"]
    change_frame(study / drive.folder, 3, **change)
    with pytest.raises(ValueError, match=r"^log\.jsonl: is damaged$"):
        motion(drive)


@pytest.mark.parametrize("data", [b"", b"{}", b"\xff\xfe", b"[" * 100_000, b"{}\n{}\n{}", b"null\n" * 5])
def test_a_log_of_other_content_is_one_line(study: Path, data: bytes) -> None:
    drive = drives(study)["blind", "none"]
    (study / drive.folder / "log.jsonl").write_bytes(data)
    with pytest.raises(ValueError, match="damaged"):
        motion(drive)


def test_a_damaged_result_is_a_line_and_not_a_drive(study: Path) -> None:
    first, second, third = (study / one.folder for one in drives(study).values())
    (first / "result.json").write_bytes((first / "result.json").read_bytes()[:-9])
    (second / "result.json").write_text('{"result": {"run": 1}}')
    (third / "result.json").write_text("[" * 100_000)
    lines = list(stored_drives(study))
    assert len(lines) == 3
    assert all(
        isinstance(line, str) and line.endswith("result.json: is damaged") and "\n" not in line for line in lines
    )


def test_links_and_pipes_are_refused(study: Path, tmp_path: Path) -> None:
    plain, patched = drives(study)["blind", "none"], drives(study)["blind", "patch"]
    outside = tmp_path / "outside.jsonl"
    shutil.move(study / plain.folder / "log.jsonl", outside)
    (study / plain.folder / "log.jsonl").symlink_to(outside)
    with pytest.raises(ValueError, match="outside"):
        motion(plain)
    (study / patched.folder / "video.mp4").unlink()
    os.mkfifo(study / patched.folder / "video.mp4")
    with pytest.raises(ValueError, match="FIFO"):
        list(pictures(patched, 5))
