"""`gear.attack_drive` on the tiny town, with a driver whose loop can be attacked in a known way."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gear
from gear.cli.main import main
from gear.driving import attacked_drives
from gear.driving.worker import drive_once
from gear.values.errors import GearError
from gear.verbs.attack import monitor

SETTINGS = ["height_px=2", "width_px=2", "area=1.0", "batch=1", "turns=1"]
QUERIES = 5


def attacked(config: Path, out: Path, **changes: Any) -> gear.AttackReport:
    given: dict[str, Any] = {"queries": QUERIES, "settings": SETTINGS, "held_out": 1, "seed": 29}
    return gear.attack_drive(config, out=out, **(given | changes))


@pytest.mark.slow
def test_the_attack_finds_the_patch_that_crashes_the_car(magenta_blind: Path, tmp_path: Path) -> None:
    used: list[tuple[int, int]] = []
    out = tmp_path / "out"
    report = attacked(magenta_blind, out, on_progress=lambda done, total: used.append((done, total)))
    rgb = report.patches[0].rgb.reshape(-1, 3)
    assert (rgb == (1, 0, 1)).all(axis=1).any(), "magenta blinds this driver"
    curve = report.facts["curves"]["harm"]
    assert curve == sorted(curve) and curve[-1] > 1 > curve[0], "no crash at first, a crash at last"
    twins = report.facts["held_out"]["twins"]
    assert [twins[name]["crashes"] for name in ("none", "random", "patch")] == [0, 0, 1]
    assert twins["patch"]["least_ttc_s"] < twins["none"]["least_ttc_s"]
    assert {one["run"]["seed"] for one in report.facts["held_out"]["drives"]} == {1_000_000}
    assert used[0] == (0, QUERIES) and (QUERIES, QUERIES) in used and used[-1] == (3, 3)
    assert "held-out drives, these patches: 1 of 1 crashed" in report.summary()
    assert report.facts["data"][0]["scene"] == "tiny/board"
    seen: list[tuple[int, int]] = []
    gear.drive(out / "held_out/drive.yml", out=out / "held_out", on_progress=lambda *done: seen.append(done))
    assert seen[0] == (3, 3), "the report of the held-out drives drives nothing again"
    again = attacked(magenta_blind, out)
    assert not again.made and np.array_equal(again.patches[0].rgb, report.patches[0].rgb)
    with pytest.raises(GearError, match="made with other settings"):
        attacked(magenta_blind, out, seed=3)


@pytest.mark.slow
def test_a_killed_attack_continues_with_the_same_result(
    magenta_blind: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(monitor, "SECONDS_BETWEEN", 0.0)
    whole = attacked(magenta_blind, tmp_path / "whole", queries=4, held_out=0)
    made: list[str] = []

    def killed(*args: Any) -> Any:
        made.append(args[1].title)
        if len(made) == 3:
            raise KeyboardInterrupt
        return drive_once(*args)

    monkeypatch.setattr(attacked_drives, "drive_once", killed)
    with pytest.raises(KeyboardInterrupt):
        attacked(magenta_blind, tmp_path / "killed", queries=4, held_out=0)
    assert not (tmp_path / "killed/attack.json").exists()
    continued = attacked(magenta_blind, tmp_path / "killed", queries=4, held_out=0)
    assert len(made) < 3 + 4, "finished queries are not repeated"
    assert continued.patches[0].rgb.tobytes() == whole.patches[0].rgb.tobytes()
    assert continued.facts["curves"] == whole.facts["curves"] and continued.facts["held_out"] is None
    assert json.loads((tmp_path / "killed/attack.json").read_text())["steps_done"] == whole.facts["steps_done"]


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        ([], "--model and --data, or drives with --drive"),
        (["--model", "x", "--data", "y", "--held-out", "2"], "add --drive"),
        (["--drive", "quick", "--model", "x"], "--model is for attacks on pictures"),
        (["--drive", "quick", "--per-scene"], "--per-scene is for attacks on pictures"),
        (["--drive", "nothing.yml"], "nothing.yml"),
        (["--drive", "quick", "--steps", "5"], "takes queries; --steps"),
        (["--drive", "quick", "--attack", "scene_specific", "--queries", "5"], "takes steps; --queries"),
    ],
)
def test_the_command_line_refuses_what_does_not_fit(
    words: list[str], problem: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["attack", *words, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert problem in error and error.count("\n") == 1
