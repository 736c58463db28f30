"""`gear towns` lists and draws, and reports errors in one line."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import cv2
import pytest

from gear.cli.main import main
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN


def test_the_command_lists(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["towns"]) == 0
    listed = capsys.readouterr().out
    assert "town10: 440 m x 440 m" in listed and "billboard09" in listed and "truck_box" in listed
    assert main(["towns", str(TINY_TOWN), "--scenes", str(TINY_SCENES), "--json"]) == 0
    (town,) = json.loads(capsys.readouterr().out)["towns"]
    assert (town["name"], town["lanes"], town["bounds_m"]) == ("tiny", 13, [-80, -60, 80, 60])
    assert town["scenes"]["double"]["boards"][1]["position_m"] == [55.0, 13.0, 0.0]
    assert main(["towns", str(TINY_TOWN)]) == 0
    assert "no scenes" in capsys.readouterr().out


def test_the_command_draws(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenes = tmp_path / "one.yml"
    scenes.write_text("town: tiny\nscenes:\n  plain: {npc_vehicles: {count: [0, 0]}, pedestrians: {count: [0, 0]}}\n")
    assert main(["towns", str(TINY_TOWN), "--scenes", str(scenes), "--out", str(tmp_path / "out")]) == 0
    assert "tiny with 1 scene" in capsys.readouterr().out
    for name in ("tiny_map.png", "tiny_scenes.png"):
        assert cv2.imread(str(tmp_path / "out" / name)) is not None
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["tiny_map.png", "tiny_scenes.png"]


def test_faulty_scenes_do_not_stop_the_others(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One that cannot be read, one whose board is not there, and one whose board cannot be compiled."""
    shutil.copytree(TINY_TOWN.parents[1], tmp_path / "mjcf")
    town, scenes = tmp_path / "mjcf" / "towns" / "tiny.xml", tmp_path / "my.yml"
    (tmp_path / "mjcf" / "surfaces" / "broken.xml").write_text("<mujoco><worldbody/></mujoco>")
    nobody = "npc_vehicles: {count: [0, 0]}, pedestrians: {count: [0, 0]}"
    board = "ego: {ahead_m: [12, 45], lateral_m: [-12, 12]}, boards: [{position_m: [55, -8.5, 0], facing_deg: 175"
    scenes.write_text(
        "town: tiny\nscenes:\n"
        f"  plain: {{{nobody}}}\n"
        f"  unread: {{{nobody}, trucks: 1}}\n"
        f"  absent: {{{nobody}, {board}, asset: nowhere}}]}}\n"
        f"  broken: {{{nobody}, {board}, asset: broken}}]}}\n"
    )
    words = ["towns", str(town), "--scenes", str(scenes)]
    assert main(words) == 2
    shown = capsys.readouterr()
    assert "plain" in shown.out and "broken" in shown.out
    errors = shown.err.splitlines()
    assert len(errors) == 2 and "scenes.unread.trucks: unknown key" in errors[0] and "nowhere" in errors[1]
    assert main([*words, "--json"]) == 2
    (listed,) = json.loads(capsys.readouterr().out)["towns"]
    assert sorted(listed["faulty_scenes"]) == ["absent", "unread"]
    assert main([*words, "--out", str(tmp_path / "out")]) == 2
    shown = capsys.readouterr()
    assert "tiny with 1 scene" in shown.out
    assert len(shown.err.splitlines()) == 3 and "has no geom of a class ending in `.face`" in shown.err
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"tiny_map.png", "tiny_scenes.png"}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["tow10"], "did you mean town10?"),
        (["--out", "maps"], "needs a town"),
        (["town10", "--out", "maps", "--renderer", "clasic"], "did you mean classic?"),
        (["town10", "--out", "maps", "--weather", "ClearNon"], "did you mean ClearNoon?"),
        (["town10", "--out", "maps", "--quality", "best"], "no quality named"),
        (["town10", "--out", "maps", "--seed", "-1"], "must not be negative"),
        (["town10", "--renderer", "clasic"], "did you mean classic?"),
        (["--weather", "ClearNon"], "did you mean ClearNoon?"),
        (["town10", "--out", "/dev/null/maps"], "a file is where a folder should be; choose another --out"),
    ],
)
def test_the_command_tells_in_one_line(words: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["towns", *words]) == 2
    error = capsys.readouterr().err
    assert told in error and error.count("\n") == 1 and error.startswith("gear: ")
