"""One faulty scene of a library is an error of its own, and the other scenes are read."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.testing.tiny_town import TINY_SCENES
from gear.values.errors import ConfigError, UnknownNameError
from gear.world.scene_library import read_scene_file


def write(tmp_path: Path, faulty: str) -> Path:
    path = tmp_path / "tiny.yml"
    path.write_text(TINY_SCENES.read_text() + f"  faulty: {faulty}\n")
    return path


@pytest.mark.parametrize(
    ("scene", "problem"),
    [
        ("{trucks: {}}", r"scenes.faulty.trucks: unknown key"),
        ("{truck: {gap_m: [9.0, 3.0]}}", r"scenes.faulty.truck.gap_m: the first number must not exceed the second"),
        ("{boards: [{position_m: [0, 0, 0], facing_deg: 0}]}", r"scenes.faulty.ego: a scene with boards needs"),
        ("{boards: [{position_m: [0, 0], facing_deg: 0}]}", r"scenes.faulty.boards\[0\].position_m"),
        ("[]", r"scenes.faulty: expected keys and values"),
    ],
)
def test_a_faulty_scene_does_not_stop_the_others(scene: str, problem: str, tmp_path: Path) -> None:
    whole, file = read_scene_file(TINY_SCENES), read_scene_file(write(tmp_path, scene))
    assert file.scenes == whole.scenes and file.scene("board") == whole.scene("board")
    assert file.names == (*whole.names, "faulty")
    with pytest.raises(ConfigError, match=problem):
        file.scene("faulty")
    with pytest.raises(UnknownNameError, match="no scene of tiny named 'fautly'"):
        file.scene("fautly")


def test_a_library_of_faulty_scenes_alone_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "tiny.yml"
    path.write_text("town: tiny\nscenes:\n  one: {truk: {}}\n  two: []\n")
    with pytest.raises(ConfigError, match=r"scenes.one.truk: unknown key"):
        read_scene_file(path)


@pytest.mark.parametrize("text", ["town: tiny\n", "town: tiny\nscenes: []\n", "[]\n", "town: tiny\nscenes: {}\n"])
def test_what_is_no_library_is_refused(text: str, tmp_path: Path) -> None:
    path = tmp_path / "tiny.yml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=r"tiny\.yml"):
        read_scene_file(path)
