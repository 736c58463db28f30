"""A tiny town of boxes in MJCF for tests; it compiles quickly, and its dimensions are round numbers.

One straight road leads from west to east (lanes at y = -1.75 and 1.75, sidewalks at y = -5 and 7.5, 0.15 m high).
Another road crosses it at x = 30 and climbs 10 % north of y = 20. There are two houses, a lamp post, a bench, a traffic
light, a stop sign and three parking bays. The town has its own box-shaped vehicles, people and billboard.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from gear.config.nodes import parse_file
from gear.config.reader import read_node
from gear.values.rig import CameraMount, Rig
from gear.values.scene import Weather
from gear.world.scene_spec import SceneLibrary
from gear.world.world import World

DATA = Path(__file__).parent / "data"

TINY_TOWN = DATA / "mjcf" / "towns" / "tiny.xml"
"""Path of the tiny town's MJCF file, a value for `--town`."""

TINY_SCENES = DATA / "scenes" / "tiny.yml"
"""Path of the tiny town's scene library with the scenes `board`, `double`, `truck` and `no_billboard`."""

CLEAR = Weather(name="ClearNoon", cloudiness=5.0, sun_altitude_deg=60.0)

SMALL_RIG = Rig(cameras=(CameraMount(name="rgb", width_px=320, height_px=160),))
"""A rig with one small camera, mounted where CARLA-GeAR's camera is."""


def tiny_scenes() -> SceneLibrary:
    """Reads the scene library of the tiny town: its scenes by name."""
    return read_node(SceneLibrary, parse_file(TINY_SCENES))


def build_tiny_world(scene: str = "board", weather: Weather = CLEAR) -> World:
    """Compiles a new world of the tiny town, with one of its scenes.

    Args:
        scene: `board`, `double` (two boards), `truck` or `no_billboard`.
        weather: the weather.
    """
    return World.build(town=TINY_TOWN, scene_name=scene, scene=tiny_scenes().scenes[scene], weather=weather)


@cache
def tiny_world(scene: str = "board") -> World:
    """A world of the tiny town that tests share: compiled once per process, changed by every call of its `place`.

    Args:
        scene: `board`, `double` (two boards), `truck` or `no_billboard`.
    """
    return build_tiny_world(scene)
