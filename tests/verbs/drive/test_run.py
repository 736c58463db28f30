"""`gear.drive` on the tiny town: files, resumption, equal hashes, exit codes."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import gear
from gear.cli.machine_limits import OPEN_FILES
from gear.cli.main import main
from gear.collecting.patch_sources import digest_of
from gear.contracts.executors import Outcome
from gear.dataset.executors import calibrations
from gear.dataset.guarded_paths import remove_tree
from gear.driving import worker
from gear.driving.drives import DriveRun
from gear.formats.png import encode_rgb
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import GearError
from gear.verbs.drive.report import DriveReport
from gear.verbs.drive.request import DriveRequest
from gear.verbs.drive.run import _problem, run_drive
from tests.shared import ClockedLines, few_files

TEXT = f"""
drivers:
  truth: {{controller: truth}}
  blind: {{controller: blind}}
towns: {{"{TINY_TOWN}": [board]}}
scenarios: {{stopped_lead: [40], crossing_pedestrian: [30], free_road: [30]}}
collect: {{quality: fast, scenes: "{TINY_SCENES}"}}
"""


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("drive") / "tiny.yml"
    path.write_text(TEXT)
    return path


@pytest.fixture(scope="module")
def report(config: Path) -> DriveReport:
    return gear.drive(config, out=config.parent / "out")


def hashes(report: DriveReport) -> list[str]:
    return [one.log_sha256 for one in report.results]


def test_truth_is_the_ceiling_and_blind_the_floor(report: DriveReport) -> None:
    rows = {(row.driver, row.scenario): row for row in report.rows()}
    assert rows["truth", "all"].crashes.count == 0 and rows["truth", "all"].crashes.total == 2
    assert rows["blind", "all"].crashes.count == 2
    assert rows["truth", "free_road"].phantoms.count == 0
    assert rows["truth", "free_road"].score > 0.95 > 0.7 > rows["blind", "all"].score
    assert not report.failed


def test_the_files_of_a_study(report: DriveReport) -> None:
    names = {path.name for path in report.out.iterdir()}
    assert names == {"drive.yml", "drive.json", "drives.csv", "table.txt", "report.html", "drives"}
    folders = list((report.out / "drives").glob("*/*"))
    assert len(folders) == 6 and {p.name for folder in folders for p in folder.iterdir()} == {
        "log.jsonl",
        "result.json",
    }
    lines = list(csv.DictReader((report.out / "drives.csv").read_text().splitlines()))
    assert [line["log_sha256"] for line in lines] == hashes(report)
    assert json.loads((report.out / "drive.json").read_text())["drives"][0]["run"]["driver"] == "truth"
    assert "McNemar" in (report.out / "report.html").read_text()


def test_a_study_resumes_drive_by_drive(config: Path, report: DriveReport) -> None:
    kept = sorted((report.out / "drives").glob("*/*"))
    times = {folder: (folder / "result.json").stat().st_mtime_ns for folder in kept[1:]}
    remove_tree(report.out, kept[0].relative_to(report.out).as_posix())
    (kept[1] / "log.jsonl").write_text("damaged")
    seen: list[tuple[int, int]] = []
    again = gear.drive(config, out=report.out, on_progress=lambda done, total: seen.append((done, total)))
    assert seen[0] == (4, 6) and seen[-1] == (6, 6)
    assert hashes(again) == hashes(report)
    assert all((folder / "result.json").stat().st_mtime_ns == times[folder] for folder in kept[2:])


@pytest.mark.slow
def test_hashes_do_not_depend_on_workers(config: Path, report: DriveReport, tmp_path: Path) -> None:
    assert hashes(gear.drive(config, out=tmp_path / "two", workers=2)) == hashes(report)


@pytest.mark.slow
def test_a_driver_with_a_camera_drives_the_same_twins(config: Path, tmp_path: Path) -> None:
    """A controller that ignores its pictures drives equally with every patch, and equally without pictures."""
    paint = np.full((4, 8, 3), (200, 30, 30), np.uint8)
    (tmp_path / "paint.png").write_bytes(encode_rgb(paint))
    eyes = f"{{controller: blind, task: depth, options: {{width_px: 256, height_px: 96}}, patch: {tmp_path}/paint.png}}"
    settings = [
        f"drivers={{eyes: {eyes}}}",
        "scenarios={stopped_lead: [40]}",
        "twins=[none, patch]",
        "video=true",
    ]
    pytest.importorskip("av")
    out = tmp_path / "out"
    found = gear.drive(config, out=out, settings=settings)
    videos = list((out / "drives").glob("*/*/video.mp4"))
    assert len(videos) == 2 and all(video.stat().st_size > 5000 for video in videos)
    together = list((out / "videos").glob("eyes/*.mp4"))
    shown = (out / "report.html").read_text()
    assert len(together) == 1 and f'href="videos/eyes/{together[0].name}"' in shown and "data:image/svg+xml" in shown
    digest = digest_of([paint])
    logs = [path.read_text().splitlines() for path in sorted((out / "drives").glob("*/*/log.jsonl"))]
    assert len(logs) == len(found.results) == 2 and logs[0][1:] == logs[1][1:]
    assert [json.loads(log[0])["patch_sha256"] for log in logs] == ["", digest], "none comes first by name"
    assert [one.patch for one in found.results] == ["none", f"paint-{digest[:8]}"]
    assert [one.patch_sha256 for one in found.results] == ["", digest]
    lines = csv.DictReader((out / "drives.csv").read_text().splitlines())
    assert [line["patch_sha256"] for line in lines] == ["", digest]
    assert found.results[0].renderer is not None


def test_the_command_line(config: Path, report: DriveReport, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["drive", str(config), "--out", str(report.out)]) == 0
    shown = capsys.readouterr().out
    assert "crossing_pedestrian" in shown and "McNemar" in shown
    assert main(["drive", str(config), "--out", str(report.out), "--list"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 6
    assert main(["drive", str(config), "--out", str(report.out), "--set", "drivers.truth.controller=truht"]) == 2
    error = capsys.readouterr().err
    assert "did you mean truth?" in error and error.count("\n") == 1


def test_scenarios_without_a_place_are_listed_and_do_not_fail_the_study(config: Path, tmp_path: Path) -> None:
    warned: list[str] = []
    settings = ["scenarios={cut_in: [40], free_road: [30]}", "drivers={truth: {controller: truth}}"]
    found = gear.drive(config, out=tmp_path, settings=settings, on_warning=warned.append)
    assert len(found.results) == 1 and len(found.failed) == 1
    assert "neighbouring lane" in found.failed[0][1] and len(warned) == 1
    with pytest.raises(GearError, match="no drive could be made"):
        gear.drive(config, out=tmp_path / "none", settings=[*settings, "scenarios={cut_in: [40]}"])


def test_drives_without_a_worker_are_distinguished_from_those_of_another_run() -> None:
    assert _problem(None).startswith("not begun")
    assert _problem(Outcome(index=0, kind="elsewhere")).startswith("another run is making it")
    assert _problem(Outcome(index=0, kind="failed", error="broken")) == "broken"


def test_a_drive_that_fails_is_tried_again_and_calibrations_are_shown(
    config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[int] = []

    def made(one: worker.DriveWorker, run: DriveRun) -> bool:
        calls.append(run.seed)
        one.callbacks.on_fit_phase("training step", 3, 3)
        if len(calls) < 3:
            raise RuntimeError("broken")
        return real(one, run)

    real: Any = worker._made
    monkeypatch.setattr(worker, "_made", made)
    settings = ["scenarios={free_road: [30]}", "drivers={blind: {controller: blind}}"]
    seen: list[Any] = []
    report = gear.drive(
        config,
        out=tmp_path,
        settings=settings,
        on_progress=lambda *progress: seen.append(progress),
        on_fit_phase=lambda *phase: seen.append(phase),
    )
    assert calls == [calls[0]] * 3 and not report.failed and not (tmp_path / "failures").exists()
    assert seen == [(0, 1), *[("training step", 3, 3), (1, 1)] * 3]


def test_the_drives_after_many_failures_are_not_begun(
    config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[int] = []

    def made(worker: object, run: DriveRun) -> bool:
        calls.append(run.seed)
        if len(calls) == 1:
            return real(worker, run)
        raise RuntimeError("broken")

    real: Any = worker._made
    monkeypatch.setattr(worker, "_made", made)
    settings = ["scenarios={free_road: [30]}", "drivers={blind: {controller: blind}}", "repeats=8"]
    with pytest.raises(GearError, match="5 of 8 drives could not be made"):
        gear.drive(config, out=tmp_path, settings=settings)
    assert len(calls) == 6
    problems = [one["problem"] for one in json.loads((tmp_path / "drive.json").read_text())["failed"]]
    assert problems[:5] == ["RuntimeError: broken"] * 5
    assert len(problems) == 7 and all(one.startswith("not begun") for one in problems[5:])


def test_an_absurd_number_of_workers_is_refused() -> None:
    with pytest.raises(GearError, match="at least 1"):
        DriveRequest(config="quick", out="x", workers=0)


@pytest.mark.parametrize("further", [0, 3])
def test_few_file_descriptors_are_one_line(
    further: int, config: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with few_files(further):
        code = main(["drive", str(config), "--out", str(tmp_path / "out")])
    assert (code, capsys.readouterr().err) == (2, f"gear: {OPEN_FILES}\n")


def test_a_study_that_does_not_fit_the_disk_is_refused_after_its_first_drives(
    config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=1000))
    with pytest.raises(
        GearError, match=r"the missing ones of 6 drives need about .* and 1 kB are free there; make fewer drives"
    ):
        gear.drive(config, out=tmp_path / "out")
    assert not (tmp_path / "out" / "drive.json").exists()


def test_every_part_of_a_study_has_rate_and_time_left(
    config: Path, report: DriveReport, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = ClockedLines(monkeypatch, "drive", "drive")
    again = run_drive(DriveRequest(config=config, out=report.out), lines.callbacks)
    assert hashes(again) == hashes(report)
    assert lines.counted("checking existing drives")[2].endswith("3 of 6, 6 per minute, 30 seconds left")
    assert lines.counted("reading the results of all drives")[2].endswith("3 of 6, 6 per minute, 30 seconds left")
    monkeypatch.setattr(calibrations, "EVERY_S", 0.0)  # workers report every frame
    settings = ("drivers={blind: {controller: blind}}", "scenarios={stopped_lead: [40]}", "twins=[none]")
    fresh = run_drive(DriveRequest(config=config, out=tmp_path / "out", settings=settings), lines.callbacks)
    frames = lines.counted("frames of the first drive")
    assert frames[0] == "gear drive: frames of the first drive, 1 of 100, 6 per minute, 16 minutes left"
    assert len(fresh.results) == 1 and hashes(fresh) == [
        one.log_sha256 for one in report.results if (one.run.driver, one.run.scenario) == ("blind", "stopped_lead")
    ]


def test_files_of_somebody_else_are_not_replaced(
    config: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "drive.yml").write_text(TEXT)
    (tmp_path / "report.html").write_text("mine")
    assert main(["drive", str(tmp_path / "drive.yml"), "--out", str(tmp_path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "holds files that are no drives of gear's, such as 'drive.yml'; use another --out" in line
    assert (tmp_path / "drive.yml").read_text() == TEXT and (tmp_path / "report.html").read_text() == "mine"


def test_a_study_without_a_first_line_in_its_config_is_continued(
    config: Path, report: DriveReport, tmp_path: Path
) -> None:
    shutil.copytree(report.out, tmp_path / "old")
    own = tmp_path / "old/drive.yml"
    own.write_bytes(own.read_bytes().split(b"\n", 1)[1])
    assert hashes(gear.drive(config, out=tmp_path / "old")) == hashes(report)
    assert own.read_bytes().startswith(b"# written by gear drive\n")
