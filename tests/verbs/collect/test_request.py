"""What `gear collect` is asked to do: names in flags and files, and one clear line for each that is wrong."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import gear
from gear.collecting.job import resolve
from gear.collecting.run import CollectReport
from gear.config.load import load_collection
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import (
    ConfigError,
    PatchError,
    UnknownNameError,
)

Collect = Callable[..., CollectReport]
TASKS = ("semseg", "detect2d", "stereo3d", "depth")


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"task": "stereo3"}, UnknownNameError, "no task named 'stereo3'; did you mean stereo3d"),
        ({"scene": "bord"}, UnknownNameError, "no scene of tiny named 'bord'; did you mean board"),
        ({"town": "town1"}, UnknownNameError, "no town named 'town1'; did you mean town10"),
        ({"weather": "ClearNon"}, UnknownNameError, "no weather named 'ClearNon'; did you mean ClearNoon"),
        ({"split": "tset"}, UnknownNameError, "no split named 'tset'; did you mean test"),
        ({"patch": "nowhere.png"}, PatchError, "is not there"),
        ({"patch": "random", "scene": "no_billboard"}, PatchError, "random: the scene has no surface for a patch"),
        ({"settings": ["optoins.width_px=3"]}, ConfigError, r"optoins: unknown key \(did you mean 'options'\?\)"),
        ({"settings": ["options.width=3"]}, ConfigError, r"options.width: unknown key \(did you mean 'width_px'\?\)"),
        ({"settings": ["options.width_px=3cm"]}, ConfigError, "options.width_px: expected int, got '3cm'"),
        ({"settings": ["weather.cloudiness=-1"]}, ConfigError, "is a percentage"),
    ],
)
def test_bad_input_gets_one_line_and_leaves_nothing(
    changes: dict[str, Any], error: type[Exception], message: str, tmp_path: Path, collect_small: Collect
) -> None:
    with pytest.raises(error, match=message) as caught:
        collect_small(changes.pop("task", "depth"), tmp_path / "out", **changes)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("task: stereo3", r"c.yml:2:7: task: no task named 'stereo3'; did you mean stereo3d"),
        ("scene: bord", r"c.yml:2:8: scene: no scene of tiny named 'bord'; did you mean board"),
        ("scene: my.yml:bord", r"c.yml:2:8: scene: no scene of tiny named 'bord'"),
        ("town: tinny", r"c.yml:2:7: town: no town named 'tinny'"),
        ("scenes: tyny", r"c.yml:2:9: scenes: no scene library for town named 'tyny'; there are: harbour"),
        ("weather: ClearNon", r"c.yml:2:10: weather.preset: no weather named 'ClearNon'; did you mean ClearNoon"),
        ("weather: {wetness: 3, preset: Wet}", r"c.yml:2:31: weather.preset: no weather named 'Wet'"),
        ("split: tset", r"c.yml:2:8: split: no split named 'tset'; did you mean test"),
        ("simulation: defalt", r"c.yml:2:13: simulation: no simulation config named 'defalt'; did you mean default"),
        ("patch: nowhere.png", r"c.yml:2:8: patch: patch nowhere.png: is not there"),
    ],
)
def test_an_unknown_name_in_a_file_is_an_error_with_its_line(line: str, message: str, tmp_path: Path) -> None:
    """A flag that gives another one is named as a flag's is: without a place."""
    key = line.partition(":")[0]
    usual = {"task": "depth", "town": str(TINY_TOWN), "scenes": str(TINY_SCENES), "scene": "board"}
    (tmp_path / "my.yml").write_bytes(Path(TINY_SCENES).read_bytes())
    line = line.replace("my.yml", str(tmp_path / "my.yml"))
    file = tmp_path / "c.yml"
    file.write_text(f"# mine\n{line}\n")
    others = {name: value for name, value in usual.items() if name != key}
    with pytest.raises(ConfigError, match=message):
        resolve(load_collection(str(file), others))
    with pytest.raises((UnknownNameError, PatchError)):
        resolve(load_collection(str(file), others, [f"{key}=nonsense"]))


def test_a_scene_can_be_a_file_with_a_name_in_it(tmp_path: Path, collect_small: Collect) -> None:
    collect_small("depth", tmp_path / "a", samples=1, scene=f"{TINY_SCENES}:double", settings=[])
    assert gear.open_dataset(tmp_path / "a")[0].record.scene == "double"
    with pytest.raises(UnknownNameError, match=r"\(say which: --scene .*tiny.yml:board\)"):
        collect_small("depth", tmp_path / "b", scene=str(TINY_SCENES))
    with pytest.raises(UnknownNameError, match="did you mean double"):
        collect_small("depth", tmp_path / "b", scene=f"{TINY_SCENES}:dubble")


def test_a_scenes_name_leads_nowhere(tmp_path: Path) -> None:
    """A library may be somebody else's."""
    scenes = tmp_path / "my.yml"
    scenes.write_text(TINY_SCENES.read_text().replace("  board:", "  ../../../board:", 1))
    flags = {"task": "depth", "town": str(TINY_TOWN), "scene": f"{scenes}:../../../board", "renderer": "classic"}
    job = resolve(load_collection(None, flags))
    assert job.root == Path("data/depth/tiny-..-..-..-board-ClearNoon/none")
