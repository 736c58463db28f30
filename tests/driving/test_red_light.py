"""A red traffic light in the way: the driver who knows it stops, the blind one runs it, and the score says so."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from gear.driving.loop import Wheel, drive
from gear.driving.measures import RED_LIGHT_PENALTY, measure
from gear.driving.scenario import Scenario, load_scenarios
from gear.driving.simulation import DriveSimulation
from gear.driving.start import Draw
from gear.driving.worker import with_any_number
from gear.plugins.build import find
from gear.plugins.controllers.baseline import BaselineConfig
from gear.testing.tiny_town import CLEAR, TINY_TOWN, tiny_scenes, tiny_world
from gear.values.errors import FieldError, PlacementError
from gear.values.serial import Json
from gear.world.world import World

STANDARD = load_scenarios("standard").scenarios
SCENARIO = STANDARD["red_light"]
GREY = '<body name="light_main_east" pos="25.5 -6.2 0.15">'


def town_with_light(folder: Path, colour: str) -> Path:
    """The tiny town, whose light on the main road shows a colour to those who drive east; the lane ends at x = 26.5."""
    shutil.copytree(TINY_TOWN.parents[1], folder / "mjcf")
    town = folder / "mjcf" / "towns" / "tiny.xml"
    text = town.read_text()
    assert GREY in text
    turned = GREY.replace(">", ' euler="0 0 -90">')
    town.write_text(text.replace(GREY, turned).replace("light_main_east_head", f"light_main_east_{colour}"))
    return town


@pytest.fixture(scope="module")
def simulation(tmp_path_factory: pytest.TempPathFactory) -> DriveSimulation:
    town = town_with_light(tmp_path_factory.mktemp("red"), "red")
    scene = tiny_scenes().scenes["board"]
    world = World.build(town=town, scene_name="board", scene=scene, weather=CLEAR)
    return DriveSimulation(
        world, with_any_number(replace(scene, npc_vehicles=replace(scene.npc_vehicles, count=(0, 0))))
    )


def draw(speed_kmh: float, seed: int = 0) -> Draw:
    return Draw(name="red_light", scenario=SCENARIO, speed_mps=speed_kmh / 3.6, seed=seed)


def log_of(simulation: DriveSimulation, controller: str, speed_kmh: float, seed: int = 0) -> list[Json]:
    plugin = find("controller", controller)
    wheel = Wheel(plugin=plugin, controller=plugin.spec.build(BaselineConfig()))
    return drive(simulation, draw(speed_kmh, seed), wheel)


def test_the_line_is_reached_after_the_time_of_the_scenario(simulation: DriveSimulation) -> None:
    now = simulation.reset(draw(40.0))
    assert now.red_light_m == pytest.approx(40.0 / 3.6 * SCENARIO.ttc_s) and not now.ran_red_light
    assert now.ego.x_m + now.car.front_m + now.red_light_m == pytest.approx(26.5, abs=0.01)
    assert now.observation().red_light_m is None, "only controllers that know the truth receive it"
    assert now.observation(with_truth=True).red_light_m == now.red_light_m


@pytest.mark.parametrize("speed_kmh", [20.0, 60.0])
def test_truth_stops_before_the_line(simulation: DriveSimulation, speed_kmh: float) -> None:
    log = log_of(simulation, "truth", speed_kmh)
    found = measure(log)
    assert (found.ending, found.ran_red_light, found.phantom_brakings) == ("stood", False, 0)
    assert 0.5 < log[-2]["red_light_m"] < 6.0, "it stands near the line"
    assert found.score > 0.9


def test_a_blind_driver_runs_it(simulation: DriveSimulation) -> None:
    log = log_of(simulation, "blind", 40.0)
    found = measure(log)
    assert found.ran_red_light and (found.ending, found.is_crash) == ("passed", False)
    assert found.score == pytest.approx(RED_LIGHT_PENALTY * found.progress * (1 - found.off_road_share))
    assert RED_LIGHT_PENALTY == 0.7
    first = next(entry["time_s"] for entry in log[1:-1] if entry["ran_red_light"])
    assert first == pytest.approx(SCENARIO.ttc_s, abs=0.11) and log[-2]["red_light_m"] is None


def test_a_green_light_is_no_place_for_the_scenario(tmp_path: Path) -> None:
    scene = tiny_scenes().scenes["board"]
    world = World.build(town=town_with_light(tmp_path, "green"), scene_name="board", scene=scene, weather=CLEAR)
    with pytest.raises(PlacementError, match="without a red light ahead"):
        DriveSimulation(world, scene).reset(draw(40.0))


def test_behind_a_truck_is_no_place_for_the_scenario() -> None:
    with pytest.raises(PlacementError, match="use a scene with boards"):
        world = tiny_world("truck")
        DriveSimulation(world, world.scene).reset(draw(40.0))


def test_a_red_light_comes_alone() -> None:
    assert not Scenario(red_light=True).is_free
    with pytest.raises(FieldError, match="red_light: a scenario with a red light"):
        replace(STANDARD["stopped_lead"], red_light=True)
