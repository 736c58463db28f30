"""The data plan of the reference weights: nothing that is held out is trained on, and every collection can be made."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from authoring.weights.patches.plan import plans
from authoring.weights.plan import (
    HELD_OUT_SCENES,
    HELD_OUT_WEATHER,
    TRAINING_OPTIONS,
    Collection,
    held_out,
    training,
)
from gear.collecting.job import resolve
from gear.config.collection import SimulationConfig
from gear.config.load import find_config, load_collection
from gear.config.nodes import parse_file
from gear.config.reader import read_node

ROOT = Path(__file__).parents[2]
TASKS = tuple(TRAINING_OPTIONS)


def flags(collection: Collection) -> dict[str, str | None]:
    words = iter(collection.arguments())
    return {word.removeprefix("--"): next(words) for word in words if word != "--set" or not next(words)}


@pytest.mark.parametrize("task", TASKS)
def test_nothing_held_out_is_trained_on(task: str) -> None:
    plan = training(task, 1000)
    assert not {(one.town, one.scene) for one in plan} & set(HELD_OUT_SCENES)
    assert HELD_OUT_WEATHER not in {one.weather for one in plan}
    assert {(one.town, one.scene) for one in held_out(task)} == set(HELD_OUT_SCENES)
    assert HELD_OUT_WEATHER in {one.weather for one in held_out(task)}


def test_seeds_are_not_used_elsewhere() -> None:
    simulation = read_node(SimulationConfig, parse_file(find_config("simulation", "default")))
    paper = {split.seed for split in simulation.splits.values()}
    learnt = [one.seed for one in training("semseg", 1000)]
    measured = [one.seed for one in held_out("semseg")]
    assert len({*learnt, *measured, *paper}) == len(learnt) + len(measured) + len(paper)


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("samples", [40, 1000])
def test_the_numbers_are_about_what_was_asked_for(task: str, samples: int) -> None:
    plan = training(task, samples)
    assert abs(sum(one.samples for one in plan) - samples) <= len(plan) / 2
    assert len({one.name for one in plan}) == len(plan)
    assert sum(one.samples for one in held_out(task)) == 300
    assert len({one.town for one in plan}) == 3 and len({one.weather for one in plan}) == 7


@pytest.mark.parametrize("task", TASKS)
def test_every_collection_can_be_made(task: str) -> None:
    for one in (training(task, 200)[0], training(task, 200)[12], held_out(task)[-1]):
        job = resolve(load_collection(None, flags(one), [*one.settings, f"patch_seed={one.seed}"]))
        assert job.plan.info.seed == one.seed and job.plan.samples == one.samples
        assert job.plan.info.split == one.split


def test_training_and_patched_streets_have_just_so_many_road_users() -> None:
    """Of the patches' streets, too; a factor that is no whole number leaves whole numbers of them."""

    def counts(flags: Mapping[str, str | None], settings: Sequence[str]) -> tuple[tuple[int, int], tuple[int, int]]:
        scene = resolve(load_collection(None, flags, settings)).scene
        return scene.npc_vehicles.count, scene.pedestrians.count

    for task, around_boards in (("semseg", ((6, 14), (12, 40))), ("depth", ((9, 21), (18, 60)))):
        plan = {(one.town, one.scene): one for one in training(task, 200)}
        drive, board = plan["town10", "no_billboard"], plan["town10", "billboard01"]
        assert counts(flags(drive), drive.settings) == ((24, 54), (24, 72))
        assert counts(flags(board), board.settings) == around_boards
    for task, model, around_boards in (
        ("detect2d", "retinanet_lite0_fpn", ((9, 21), (18, 60))),
        ("stereo3d", "stereo_centre_lite0", ((15, 35), (30, 100))),
    ):
        (patched,) = plans(task, model, towns=["town10"], scenes=["billboard01"])
        assert counts({"task": task, "scene": "billboard01"}, patched.settings) == around_boards


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_closed_output_pipe_is_no_error(unbuffered: str) -> None:
    """Whether it comes up at the first line or at the end, when the rest is printed."""
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "authoring.weights", "training", "--task", "depth", "--list"]
    with os.fdopen(writing, "wb") as closed:
        env = os.environ | {"PYTHONUNBUFFERED": unbuffered}
        done = subprocess.run(command, stdout=closed, stderr=subprocess.PIPE, check=False, env=env, cwd=ROOT)
    assert (done.returncode, done.stderr) == (0, b"")


def test_settings_go_into_every_command_behind_the_plans_own() -> None:
    command = [sys.executable, "-m", "authoring.weights", "training", "--task", "detect2d", "--list"]
    plain, crowded = (
        subprocess.run([*command, *more], capture_output=True, text=True, check=True, cwd=ROOT).stdout.splitlines()
        for more in ([], ["--set", "crowd=5"])
    )
    assert len(plain) == len(crowded) > 20
    for one, other in zip(plain, crowded, strict=True):
        assert "--set crowd=5" not in one
        assert other.rindex("--set crowd=5") > other.find("--set crowd=0.6")
    assert any("--set crowd=0.6" in one for one in plain)
