"""What a worker of a study keeps open, writes and reads back."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from gear.dataset.sealed_json import sealed_json
from gear.driving import worker
from gear.driving.drives import DriveRun
from gear.driving.log import log_hash
from gear.driving.measures import Measures
from gear.driving.worker import DriveResult
from gear.values.errors import DatasetError, GearError
from gear.values.serial import to_json


def test_a_place_that_fails_to_open_is_opened_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    opener: Any = worker.DriveWorker(drives=cast("Any", SimpleNamespace(casts={"a": SimpleNamespace(task="")})))
    opened: list[str] = []

    def open_place(self: Any, run: Any, cast: Any) -> Any:
        if run.town == "broken":
            raise GearError("the town is broken")
        opened.append(run.town)
        return f"place {len(opened)}"

    monkeypatch.setattr(worker.DriveWorker, "_opened", open_place)
    good, broken = (SimpleNamespace(driver="a", town=town, scene="s") for town in ("good", "broken"))
    assert opener.place_of(good) == opener.place_of(good) == "place 1"
    with pytest.raises(GearError, match="is broken"):
        opener.place_of(broken)
    assert opener.place_of(good) == "place 2", "the first place was closed"


def test_the_folder_of_a_drive_has_no_files_of_a_killed_run(tmp_path: Path) -> None:
    hidden = tmp_path / "drives/a/.b.gear-drive"
    hidden.mkdir(parents=True)
    (hidden / "old").write_text("of a killed run")
    worker._write(tmp_path, "drives/a/b", {"log.jsonl": b"{}"})
    assert [path.name for path in (tmp_path / "drives/a/b").iterdir()] == ["log.jsonl"]


@pytest.mark.parametrize(
    "content",
    [b'{"identity":1}', b'{"identity":1,"result":{"x":1}}', b"[1]", b"{not json", b"[" * 100_000, b"\xff", b"3", b""],
)
def test_a_damaged_result_is_one_line(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a/result.json").write_bytes(content)
    with pytest.raises(DatasetError, match="delete its folder and drive again") as caught:
        worker.read_result(tmp_path, "a", 1)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [b"{}\n{not json\n{}", b"[" * 100_000, b"{}\n[]\n{}\n", b"{}\n{}\n", b"\xff", b""])
def test_a_damaged_log_is_one_line(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a/log.jsonl").write_bytes(content)
    with pytest.raises(DatasetError, match="delete its folder and drive again"):
        worker.read_log(tmp_path, "a")


def test_the_result_of_another_drive_counts_as_missing(tmp_path: Path) -> None:
    log = b"{}\n{}\n{}\n"
    result = DriveResult(
        run=DriveRun(driver="a", town="t", scene="s", scenario="c", speed_kmh=30.0, seed=0, twin="none"),
        measures=Measures(
            ending="time",
            is_crash=False,
            crash_kind="",
            impact_mps=None,
            duration_s=1.0,
            least_gap_m=None,
            least_distance_m=None,
            least_ttc_s=None,
            braking_s=None,
            phantom_brakings=0,
            off_road_share=0.0,
            lateral_peak_m=0.0,
            jerk_peak_mps3=0.0,
            jerk_rms_mps3=0.0,
            progress=1.0,
            score=1.0,
        ),
        log_sha256=log_hash(log),
        patch="none",
    )
    identity = {"seed": 1, "places": ("a", 1.5)}
    content = sealed_json({"identity": identity, "result": to_json(result)})
    worker._write(tmp_path, "a", {"log.jsonl": log, "result.json": content})
    assert worker.read_result(tmp_path, "a", identity) == result
    assert worker.read_result(tmp_path, "a", identity | {"seed": 2}) is None
    assert worker.read_result(tmp_path, "a", identity, with_video=True) is None
