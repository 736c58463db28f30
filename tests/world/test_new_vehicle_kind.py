"""A new kind of vehicle is one row of `gear.values.labels` and one MJCF file."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

from gear.testing.tiny_town import DATA
from gear.values import labels

ROW = """    VehicleKind(
        34, "tram", 31, coco_id=7, kitti_type="Tram", is_instance=True,
        weight=1.0, headlamps=1, max_speed_mps=4.0, has_lit_interior=True,
    ),
"""
SCRIPT = """
import importlib.util, json, sys
labels_file, town = sys.argv[1:]
spec = importlib.util.spec_from_file_location("gear.values.labels", labels_file)
labels = importlib.util.module_from_spec(spec)
sys.modules["gear.values.labels"] = labels
spec.loader.exec_module(labels)

from dataclasses import replace
from gear.config.collection import SplitConfig
from gear.testing.tiny_town import CLEAR, SMALL_RIG, tiny_scenes
from gear.world.planner import ScenePlanner
from gear.world.weather.night import night_of
from gear.world.world import World

scene = tiny_scenes().scenes["no_billboard"].mixed({"tram": 1000.0})
weather = replace(CLEAR, sun_altitude_deg=-30.0)
world = World.build(town=town, scene_name="no_billboard", scene=scene, weather=weather)
record = ScenePlanner(world, SMALL_RIG, SplitConfig(seed=0, samples=1), split_name="debug").plan(0)
night = night_of(world, weather, "raster")
trams = [actor for actor in record.actors if actor.asset == "tram_short"]
placed = world.place(record)
print(json.dumps({
    "roles": sorted({actor.role for actor in trams}),
    "speeds": [sum(v * v for v in actor.velocity_world_mps) ** 0.5 for actor in trams],
    "labels": sorted({placed.objects[actor.id].label_code for actor in trams}),
    "kitti": sorted({placed.objects[actor.id].kitti_type for actor in trams}),
    "half_gauge_m": night.vehicles["tram_short"].half_gauge_m,
    "panes": int(night.is_pane.sum()),
}))
"""


def test_a_tram_is_one_row_and_one_file(tmp_path: Path) -> None:
    mjcf = tmp_path / "mjcf"
    shutil.copytree(DATA / "mjcf", mjcf)
    van = (mjcf / "vehicles" / "van_small.xml").read_text()
    pane = '<geom name="pane" class="van.tyre" material="glass" pos="2.51 0 1.4" size="0.01 0.5 0.3"/>'
    tram = van.replace('<geom name="hull"', f'{pane}<geom name="hull"', 1)
    tram = tram.replace("van_small", "tram_short").replace('"van', '"tram')
    (mjcf / "vehicles" / "tram_short.xml").write_text(tram)
    source = Path(labels.__file__).read_text()
    end = '    Label(33, "traffic_sign_back", 4),\n'
    assert source.count(end) == 1
    (tmp_path / "labels.py").write_text(source.replace(end, end + ROW))

    command = [sys.executable, "-c", SCRIPT, str(tmp_path / "labels.py"), str(mjcf / "towns" / "tiny.xml")]
    result = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)

    assert set(result["roles"]) <= {"npc", "parked"} and result["roles"]
    assert max(result["speeds"]) <= 4.0
    assert result["labels"] == [34] and result["kitti"] == ["Tram"]
    assert result["half_gauge_m"] == 0.0
    assert result["panes"] > 0
