"""Names are looked up before anything is rendered, and told where they stand."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.cli.main import main
from gear.collecting.job import resolve
from gear.collecting.lookup import look_up
from gear.config.load import load_collection
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import ConfigError, UnknownNameError
from gear.verbs.towns.facts import read_town

ASSETS = """town: tiny
scenes:
  corner:
    boards:
      - {position_m: [55, -8.5, 0], facing_deg: 175}
      - {position_m: [5, -8.5, 0], facing_deg: 175, asset: bilboard}
    ego: {ahead_m: [9, 40], lateral_m: [-9, 9]}
"""
TRUCK = "town: tiny\nscenes:\n  behind:\n    truck: {asset: truck_bix}\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            ASSETS,
            r"my.yml:6:60: scenes.corner.boards\[1\].asset: no surface named 'bilboard'; did you mean billboard\?",
        ),
        (TRUCK, r"my.yml:4:20: scenes.behind.truck.asset: no vehicle named 'truck_bix'; did you mean truck_box\?"),
        (ASSETS.replace("tiny", "tony"), r"my.yml:1:7: town: its boards stand in tony, not in tiny"),
    ],
)
def test_errors_in_a_scene_library_name_file_and_line(text: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "my.yml"
    file.write_text(text)
    flags = {"task": "depth", "town": str(TINY_TOWN), "scene": str(file)}
    with pytest.raises(ConfigError, match=message):
        look_up(load_collection(None, flags))
    with pytest.raises(ConfigError, match=message):
        read_town(TINY_TOWN, file)


def test_a_scene_library_is_found_by_commands_alike(tmp_path: Path) -> None:
    assert read_town("town10", "town10").scenes == read_town("town10").scenes
    with pytest.raises(UnknownNameError, match=r"no scene library named '.*gone.yml' \(that file does not exist\)"):
        look_up(load_collection(None, {"task": "depth"}, [f"scenes={tmp_path}/gone.yml"]))
    for name in ("a" * 300, f"{'a' * 300}.yml"):
        with pytest.raises(ConfigError, match=f"^{name}: cannot read it: File name too long"):
            look_up(load_collection(None, {"task": "depth"}, [f"scenes={name}"]))


@pytest.mark.parametrize("town", ["town10", "suburb", "harbour"])
def test_the_usual_limits_leave_the_towns_own_scenes_as_they_are(town: str) -> None:
    scenes = read_town(town).scenes
    assert scenes is not None
    for name, scene in scenes.scenes.items():
        assert look_up(load_collection(None, {"task": "depth", "town": town, "scene": name})).scene == scene


def test_a_scene_without_a_name_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "my.yml"
    file.write_text('town: tiny\nscenes:\n  "": {}\n')
    with pytest.raises(ConfigError, match=r"my.yml:3:3: scenes: a scene needs a name"):
        look_up(load_collection(None, {"task": "depth", "town": str(TINY_TOWN), "scene": str(file)}))


def test_a_folding_lens_is_an_error_with_its_place_in_the_file(tmp_path: Path) -> None:
    file = tmp_path / "c.yml"
    file.write_text("task: semseg\ncamera: {lens: {k1: -0.5, k2: -0.5}}\noptions: {hfov_deg: 150}\n")
    flags = {"town": str(TINY_TOWN), "scene": f"{TINY_SCENES}:board", "renderer": "classic"}
    with pytest.raises(ConfigError, match=r"c.yml:2:9: camera.lens: a lens of k1 -0.5 and k2 -0.5 folds"):
        resolve(load_collection(str(file), flags))


@pytest.mark.parametrize(
    ("flag", "value", "message"),
    [
        ("--task", "semsex", "no task named 'semsex'; did you mean semseg?"),
        ("--town", "tonw10", "no town named 'tonw10'; did you mean town10?"),
        ("--scene", "truk", "no scene of town10 named 'truk'; did you mean truck?"),
        ("--split", "trian", "no split named 'trian'; did you mean train?"),
        ("--weather", "Foggy", "no weather named 'Foggy'"),
        ("--patch", "nowhere", "patch nowhere: is not there"),
        ("--set", "simulation=defalt", "no simulation config named 'defalt'; did you mean default?"),
        ("--set", "options.width=3", "options.width: unknown key (did you mean 'width_px'?)"),
    ],
)
def test_show_config_prints_nothing_that_cannot_be_collected(
    flag: str, value: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["show-config", "--task", "semseg", flag, value]) == 2
    printed = capsys.readouterr()
    assert message in printed.err and printed.err.count("\n") == 1 and printed.out == ""


def test_show_config_prints_what_reads_back_as_the_same(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "c.yml"
    argv = ["--task", "semseg", "--town", str(TINY_TOWN), "--scene", f"{TINY_SCENES}:double"]
    assert main(["show-config", *argv, "--set", "options.width_px=64"]) == 0
    file.write_text(printed := capsys.readouterr().out)
    assert f"scene: {TINY_SCENES}:double" in printed
    assert main(["show-config", "--config", str(file)]) == 0
    assert capsys.readouterr().out == printed
