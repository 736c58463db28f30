from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gear.config.nodes import parse_text
from gear.config.reader import read_node
from gear.contracts.tasks import NO_PATCH
from gear.driving.config import DriveConfig
from gear.driving.drives import Drives, patches_of, plan_drives
from gear.driving.worker import with_any_number, with_pool
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN, tiny_scenes
from gear.values.errors import ConfigError, FieldError, GearError

TEXT = f"""
drivers:
  truth: {{controller: truth}}
  eyes: {{controller: blind, task: depth, options: {{width_px: 320, height_px: 96}}, patch: random}}
towns: {{"{TINY_TOWN}": [board]}}
scenarios: {{stopped_lead: [20, 40], free_road: []}}
repeats: 2
seed: 5
collect: {{quality: fast, scenes: "{TINY_SCENES}"}}
"""


def planned(text: str = TEXT, root: Path = Path("out")) -> Drives:
    return plan_drives(read_node(DriveConfig, parse_text(text, "drive.yml")), root)


def test_the_list_of_drives() -> None:
    drives = planned()
    truth = [run for run in drives.runs if run.driver == "truth"]
    eyes = [run for run in drives.runs if run.driver == "eyes"]
    assert len(truth) == (2 + 5) * 2, "two speeds, five of the library, two seeds; one twin without cameras"
    assert len(eyes) == 3 * len(truth)
    assert {run.seed for run in drives.runs} == {5, 6}
    assert [run.twin for run in eyes[:3]] == ["none", "random", "patch"], "twins follow each other"
    assert len({run.situation for run in eyes}) == len(truth)


def test_folders_differ_and_depend_on_all_that_decides_a_drive() -> None:
    def folders(drives: Drives) -> list[str]:
        return [drives.folder(*one) for one in zip(drives.runs, patches_of(drives, drives.runs), strict=True)]

    first = folders(planned())
    assert len(set(first)) == len(first) and first == folders(planned())
    changed = folders(planned(TEXT + "crowd: 0.7\n"))
    assert not set(first) & set(changed)
    assert str(TINY_TOWN.parent) not in "".join(first)


def test_red_lights_are_left_out_for_those_who_read_none() -> None:
    text = TEXT.replace("scenarios: {stopped_lead: [20, 40], free_road: []}\n", "")
    text = text.replace("drivers:\n", "drivers:\n  depth: {controller: depth_baseline, model: ddrnet23_slim_depth}\n")
    drives = planned(text)
    met = {driver: {run.scenario for run in drives.runs if run.driver == driver} for driver in drives.casts}
    assert "red_light" in met["truth"] and "red_light" in met["eyes"] and "stopped_lead" in met["depth"]
    assert "red_light" not in met["depth"], "it reads a task and no lights"
    named = planned(text + "scenarios: {red_light: [40]}\n")
    assert {run.driver for run in named.runs} == set(named.casts), "a config may name the scenario"


def test_dynamics_are_part_of_what_decides_a_drive() -> None:
    first, other = planned(), planned(TEXT + "dynamics: mujoco\n")
    run = first.runs[0]
    patch = first.patch(run, 1)
    assert "dynamics" not in first.identity(run, patch) and other.identity(run, patch)["dynamics"] == "mujoco"
    with pytest.raises(ConfigError, match=r"drive.yml:\d+:11: dynamics: .*kinematic.*mujoco"):
        planned(TEXT + "dynamics: bicycle\n")


def test_pictures_have_the_options_of_the_driver() -> None:
    drives = planned()
    config = drives.collection(next(run for run in drives.runs if run.driver == "eyes"))
    assert (config.task, config.quality, config.crowd) == ("depth", "fast", 0.5)
    assert drives.patch(drives.runs[0], 1).label == NO_PATCH


def test_names_in_braces_in_the_patch(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    monkeypatch.setattr("gear.driving.drives.resolve_patch", lambda wanted, **_: asked.append(wanted))
    planned(TEXT.replace("patch: random", "patch: 'a/{scene}/{town}/{model}.png'"))
    assert f"a/board/{TINY_TOWN}/.png" in asked


def test_a_title_is_safe_to_print() -> None:
    run = replace(planned().runs[0], scenario="a\x1b[2J\nb")
    assert run.title.isprintable() and "a\\x1b[2J\\nb" in run.title


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("controller: truth", "controller: truht", "drive.yml:3:23: drivers.truth.controller: no controller named"),
        ("stopped_lead", "stoped_lead", "did you mean stopped_lead"),
        ("controller: blind, task: depth", "controller: depth_baseline, task: depth", "needs a network"),
        ("task: depth", "task: dept", "did you mean depth"),
        ("width_px: 320", "width_pix: 320", "width_px"),
        ("repeats: 2", "repeats: 0", "must be 1 to 10000"),
        ("board]", "bord]", "did you mean board"),
        ("patch: random", "patch: nowhere.png", "is not there"),
        ("patch: random", "patch: '{town.__class__}.png'", "drive.yml:4:90: drivers.eyes.patch: may contain {town}"),
        ("patch: random", "patch: '{}.png'", "no other braces"),
        ("patch: random", "patch: '{town:>999999999}.png'", "no other braces"),
        ("[20, 40]", "[-5]", "drive.yml:6:27: scenarios.stopped_lead: must be 5 to 130 km/h, got -5"),
        ("[20, 40]", "[0]", "must be 5 to 130"),
        ("[20, 40]", "[1e9]", "must be 5 to 130"),
        ("patch: random", "model: ddrnet23_slim", "does semseg, not depth"),
    ],
)
def test_mistakes_are_one_line_before_the_first_drive(old: str, new: str, problem: str) -> None:
    assert old in TEXT
    with pytest.raises(GearError) as caught:
        planned(TEXT.replace(old, new))
    assert problem in str(caught.value) and "\n" not in str(caught.value)


def test_controllers_without_eyes_need_none() -> None:
    with pytest.raises((ConfigError, FieldError), match="protects a network"):
        planned(TEXT.replace("controller: truth", "controller: truth, defense: jpeg"))


@pytest.mark.parametrize("factor", [0.0, 1.0])
def test_a_world_always_has_actors_for_scripts(factor: float) -> None:
    scene = tiny_scenes().scenes["board"].crowded(factor)
    assert with_pool(scene).npc_vehicles.count[1] >= 4 and with_pool(scene).pedestrians.count[1] >= 4
    crowd: Any = with_any_number(scene)
    assert crowd.npc_vehicles.count == (0, scene.npc_vehicles.count[1])
