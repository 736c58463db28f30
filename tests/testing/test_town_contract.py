"""The town contract holds for gear's towns, and a town that breaks a promise fails the check of that promise."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from gear.testing.tiny_town import DATA, TINY_SCENES, TINY_TOWN
from gear.testing.town_contract import STREET, TownContract
from gear.values.errors import TownError

TINY_ENDS = frozenset({"lane.main_east_b", "lane.main_west_b", "lane.cross_south_s", "lane.cross_north_n"})


class TestTinyTown(TownContract):
    town = TINY_TOWN
    scenes = TINY_SCENES
    open_ends = TINY_ENDS


@pytest.mark.slow
class TestTown10(TownContract):
    town = "town10"
    # tests/world/test_town10_scenes.py plans all of them, for the rigs of all tasks.
    planned_scenes: ClassVar = ("billboard01", "truck")


@pytest.mark.slow
class TestHarbour(TownContract):
    town = "harbour"


@pytest.fixture
def broken(tmp_path: Path) -> Callable[..., TownContract]:
    """The tiny town with a piece of its MJCF or of its scenes replaced."""

    def make(*changes: tuple[str, str], scenes: tuple[tuple[str, str], ...] = ()) -> TownContract:
        shutil.copytree(DATA, tmp_path, dirs_exist_ok=True)
        town, library = tmp_path / "mjcf" / "towns" / "tiny.xml", tmp_path / "scenes" / "tiny.yml"
        for path, pairs in ((town, changes), (library, scenes)):
            text = path.read_text(encoding="utf-8")
            for old, new in pairs:
                assert text.count(old) >= 1, f"the tiny town has changed: no {old!r}"
                text = text.replace(old, new)
            path.write_text(text, encoding="utf-8")
        return type(
            "Broken", (TownContract,), {"town": town, "scenes": library, "open_ends": TINY_ENDS, "samples": 1}
        )()

    return make


def add_geom(text: str) -> tuple[str, str]:
    return '<geom name="lamp_post"', f'{text}\n    <geom name="lamp_post"'


def custom(text: str) -> tuple[str, str]:
    return "</custom>", f"{text}\n  </custom>"


LAMP = '<geom name="lamp_post" class="pole"'
ROAD = '<geom name="main_road" class="road" material="asphalt"'
GRASS = '<geom name="terrain" class="terrain" material="grass"'
BOUNDS = '<numeric name="town.bounds" data="-80 -60 80 60"/>'
EAST_TO_SOUTH = 'data="3.5 5  26.5 -1.75 0  27.4 -2.1 0  28 -2.75 0  28.25 -3.5 0"'

STEEL = '<material name="steel" rgba="0.30 0.31 0.32 1" metallic="0" roughness="0.5"/>'
CUBE = '<texture name="cube" type="cube" builtin="flat" rgb1="0.3 0.3 0.3" width="16" height="96"/>'
FLAT = '<texture name="flat" type="2d" builtin="flat" rgb1="0.8 0.8 0.8" width="16" height="16" colorspace="sRGB"/>'

SHELL = (
    '<mesh name="shell" inertia="shell" vertex="0 -3 -3  0 3 -3  0 3 3  0 -3 3  2 0 0"'
    ' face="0 1 4  1 2 4  2 3 4  3 0 4"/>'
)
"""A pyramid that is open towards -x, so that its faces show their backs there."""

SLATS = "".join(
    f'<geom class="building.plaster" pos="60 {place:.2f} 3" size="0.02 0.115 2"/>'
    f'<geom class="building.plaster" pos="60.04 0 {3 + place:.2f}" size="0.02 2 0.115"/>'
    for place in np.arange(-2, 2.1, 0.25)
)
"""A wall across the main road, of two layers of slats that leave holes of 2 cm."""

BREAKS: dict[str, tuple[tuple[tuple[str, str], ...], str, str]] = {
    "a geom without a label": (
        ((LAMP, '<geom name="lamp_post" class="seen"'),), "test_visible_geoms_are_labelled", "geom 'lamp_post'.*'seen'"
    ),
    "a visible geom that collides": (
        ((LAMP, LAMP + ' contype="1"'),),
        "test_visible_geoms_do_not_collide", "geom 'lamp_post' is visible and has contype"
    ),
    "a visible collision geom": (
        (('<geom name="post.lamp" class="collision"', '<geom name="post.lamp" class="collision" group="1"'),),
        "test_visible_geoms_do_not_collide", "geom 'post.lamp' of class collision is in group 1",
    ),
    "a collision geom in another group": (
        (('<geom name="post.lamp" class="collision"', '<geom name="post.lamp" class="collision" group="4"'),),
        "test_visible_geoms_do_not_collide", "geom 'post.lamp' of class collision is in group 4, not 3",
    ),
    "a geom neither visible nor a collision geom": (
        ((LAMP, LAMP + ' group="3"'),),
        "test_visible_geoms_do_not_collide", "geom 'lamp_post' is in group 3 and not of class collision",
    ),
    "a pane of glass": (
        ((LAMP + ' material="steel"', LAMP + ' rgba="1 1 1 0.5"'),),
        "test_nothing_is_transparent", "geom 'lamp_post' has an alpha of 0.5",
    ),
    "a pane of tinted glass": (
        ((LAMP + ' material="steel"', LAMP + ' material="steel" rgba="0.2 0.3 0.2 0.5"'),),
        "test_nothing_is_transparent", "geom 'lamp_post' has an alpha of 0.5",
    ),
    "a cube for a texture": (
        (('<material name="steel"', CUBE + '<material name="steel" texture="cube"'),),
        "test_materials_are_physical", "material 'steel' of geom 'lamp_post' has a cube texture, texture 'cube'",
    ),
    "a cube that would end the process": (
        (('<material name="steel"', CUBE + '<material name="steel" texture="cube"'),),
        "test_gear_composes_it", "'steel' of geom 'lamp_post' has metallic or roughness and a cube texture, 'cube'",
    ),
    "colours taken for numbers": (
        (('<material name="steel"', FLAT.replace(' colorspace="sRGB"', "") + '<material name="steel" texture="flat"'),),
        "test_materials_are_physical", "has colours in texture 'flat' that are not marked colorspace",
    ),
    "numbers taken for colours": (
        ((STEEL, FLAT + STEEL.replace("/>", '><layer role="orm" texture="flat"/></material>')),),
        "test_materials_are_physical", "has numbers in texture 'flat' that are marked colorspace",
    ),
    "an odd texture": (
        (('<material name="steel"', FLAT.replace('"16"', '"12"') + '<material name="steel" texture="flat"'),),
        "test_materials_are_physical", "has texture 'flat' with a side of 12 px",
    ),
    "paint that is whiter than snow": (
        (('<material name="paint" rgba="0.70 0.70 0.70 1"', '<material name="paint" rgba="0.70 0.95 0.70 1"'),),
        "test_materials_are_physical", "geom 'centre_line_west' has an albedo of 0.95, above 0.9",
    ),
    "a lamp post whiter than its texture": (
        (('<material name="paint"', FLAT + '<material name="paint" texture="flat"'),
         (LAMP + ' material="steel"', LAMP + ' material="paint" rgba="2 2 2 1"')),
        "test_materials_are_physical", "geom 'lamp_post' has an albedo of 1.21",
    ),
    "a sun of a lamp": (
        (('<material name="steel"', '<material name="steel" emission="3"'),),
        "test_materials_are_physical", "material 'steel' of geom 'lamp_post' has emission 3",
    ),
    "no plants": (
        (('<geom name="hedge" class="vegetation"', '<geom name="hedge" class="terrain"'),),
        "test_every_class_of_a_street_is_there", "vegetation",
    ),
    "a dead end": (
        (('<text name="lane.main_west_a" data="next=lane.x_west"/>', ""),),
        "test_lanes_are_continued", "lane.main_west_a is a dead end at",
    ),
    "a torn lane": (
        (('data="3.5 11  26.5 -1.75 0  33.5 -1.75 0"', 'data="3.5 11  26.8 -1.75 0  33.5 -1.75 0"'),),
        "test_lanes_are_continued", "lane.main_east_a ends 0.30 m from where its follower lane.x_east starts",
    ),
    "an end that is none": (
        (("33.5 -1.75 0  78 -1.75 0", "33.5 -1.75 0  78 -1.75 0  78 -2 0  33.5 -2 0  33.4 -1.75 0"),
         custom('<text name="lane.main_east_b" data="next=lane.main_east_b"/>')),
        "test_lanes_are_continued", "lane.main_east_b is in open_ends",
    ),
    "a kink inside a lane": (
        ((EAST_TO_SOUTH, 'data="3.5 5  26.5 -1.75 0  28.25 -1.75 0  28.25 -3.5 0"'),),
        "test_headings_are_continuous", "lane.x_east_to_south turns by 90 deg at one point",
    ),
    "a kink between lanes": (
        ((EAST_TO_SOUTH, 'data="3.5 5  26.5 -1.75 0  28.25 -3.5 0"'),),
        "test_headings_are_continuous", "lane.main_east_a turns by 45 deg where lane.x_east_to_south",
    ),
    "a lane as narrow as a path": (
        (('data="3.5 11  33.5 1.75 0', 'data="1.5 11  33.5 1.75 0'),),
        "test_widths_and_speeds_are_sane", "lane.x_west is 1.5 m wide",
    ),
    "a speed in km/h": (
        (('data="3.5 11  33.5 1.75 0', 'data="3.5 50  33.5 1.75 0'),),
        "test_widths_and_speeds_are_sane", "lane.x_west is for 50 m/s",
    ),
    "a neighbour that comes towards one": (
        (("next=lane.x_south", "next=lane.x_south left=lane.cross_north_n"),),
        "test_neighbours_run_side_by_side", "lane.cross_north_s has lane.cross_north_n as its left neighbour",
    ),
    "a lane over the lawn": (
        (('data="3.5 8  28.25 -3.5 0  28.25 -58 0"', 'data="3.5 8  28.25 -3.5 0  25 -12 -0.05  25 -58 -0.05"'),),
        "test_lanes_lie_on_the_road", "lane.cross_south_s leads over terrain .'terrain'.",
    ),
    "a lane in the air": (
        (('31.75 20 0  31.75 58 3.8"', '31.75 20 0  31.75 58 5"'),),
        "test_lanes_lie_on_the_road", r"lane.cross_north_n is \+0.\d+ m above its ground",
    ),
    "a road without collision geom": (
        (('name="ground.hill"', 'name="hill"'), ('name="ground.terrain"', 'name="lawn"')),
        "test_lanes_lie_on_the_road", "lane.cross_north_n has no collision geom named ground",
    ),
    "an invisible road": (
        ((ROAD + ' pos="0 0 -0.25"', ROAD + ' pos="0 0 -3"'), (GRASS + ' pos="0 0 -0.55"', GRASS + ' pos="0 0 -5"')),
        "test_lanes_lie_on_the_road", "lane.main_east_a: no surface is seen at its height",
    ),
    "a lane along the kerb": (
        (('data="3.5 11  78 1.75 0  33.5 1.75 0"', 'data="3.5 11  78 -3 0  33.5 -3 0"'),
         ('data="3.5 11  33.5 1.75 0  26.5', 'data="3.5 11  33.5 -3 0  26.5')),
        "test_lanes_lie_on_the_road", "lane.main_west_a .* below the left wheels",
    ),
    "a bollard on a lane": (
        (add_geom('<geom name="bollard" class="collision" pos="-40 1.75 0.5" size="0.1 0.1 0.5"/>'),),
        "test_lanes_are_clear", "lane.main_west_b is blocked by .*bollard",
    ),
    "a kerb stone beside the middle of a lane": (
        (add_geom('<geom name="stone" class="collision" pos="-40 2.9 0.2" size="0.2 0.1 0.2"/>'),),
        "test_lanes_are_clear", "lane.main_west_b is blocked by .*stone",
    ),
    "a barrier at the height of a windscreen": (
        (add_geom('<geom name="barrier" class="collision" pos="-40 1.75 1.3" size="0.05 1.5 0.05"/>'),),
        "test_lanes_are_clear", "lane.main_west_b is blocked by .*barrier",
    ),
    "a skip on a lane that nobody feels": (
        (add_geom('<geom name="skip" class="building.plaster" pos="-40 1.75 0.5" size="1 0.5 0.5"/>'),),
        "test_lanes_are_clear", "lane.main_west_b is blocked by .*skip",
    ),
    "a fence across a sidewalk": (
        (add_geom('<geom name="fence" class="collision" pos="-40 -5 1" size="0.05 1.5 1"/>'),),
        "test_people_can_walk", "sidewalk.south_west is blocked by .*fence.* at .-40",
    ),
    "a wall across a sidewalk that nobody feels": (
        (add_geom('<geom name="sheet" class="building.plaster" pos="-40 -5 1" size="0.05 1.5 1"/>'),),
        "test_people_can_walk", "sidewalk.south_west is blocked by .*sheet",
    ),
    "a sidewalk in the air": (
        (('data="3 -78 -5 0.15  26 -5 0.15"', 'data="3 -78 -5 0.35  26 -5 0.35"'),),
        "test_people_can_walk", r"sidewalk.south_west is \+0.20 m",
    ),
    "a crosswalk beside the road": (
        (('data="3 22 -3.4 0  22 3.4 0"', 'data="3 -70 -9 -0.05  -60 -9 -0.05"'),),
        "test_people_can_walk", "crosswalk.main crosses no lane",
    ),
    "a crosswalk to nowhere": (
        (("0.15  26 7.5 0.15", "0.15  12 7.5 0.15"),),
        "test_people_can_walk", "crosswalk.main ends at .22.0, 3.4., .* from the nearest sidewalk",
    ),
    "a bay on the grass": (
        (("-17 4.75 0 180", "-17 60 0.5 180"),), "test_cars_can_park", "parking.north_0 is .* in a corner"
    ),
    "a bay on a lane": (
        (("-17 4.75 0 180", "-17 1.75 0 180"),), "test_cars_can_park", "parking.north_0 lies on a lane"
    ),
    "a bay in a hedge": (
        (add_geom('<geom name="skip" class="collision" pos="-11 4.75 0.6" size="1 0.5 0.6"/>'),),
        "test_cars_can_park", "parking.north_1 holds .*skip",
    ),
    "bounds too small": (
        (('data="-80 -60 80 60"', 'data="-80 -40 80 60"'),),
        "test_bounds_hold_everything", "lane.cross_south_s leaves town.bounds at .28.2, -58.0.",
    ),
    "no bounds": (
        ((BOUNDS, ""),), "test_bounds_hold_everything", "town.bounds must be"
    ),
    "no such lane": (
        (('data="next=lane.x_west"', 'data="next=lane.x_wset"'),),
        "test_lanes_are_continued", "lane.main_west_a: next names lane.x_wset",
    ),
    "a near plane behind the bonnet": (
        (('znear="0.001"', 'znear="0.02"'),), "test_depth_has_a_range", "nearest is 2 m"
    ),
    "a far plane in the town": (
        (('zfar="20"', 'zfar="2"'),), "test_depth_has_a_range", "furthest is 200 m"
    ),
    "a tank drawn coarser than it is": (
        (('<map znear="0.001"', '<quality numslices="3"/><map znear="0.001"'),
         add_geom('<geom name="tank" class="building.plaster" type="cylinder" pos="80 0 8" size="14 8"/>')),
        "test_ids_and_depth_are_those_of_rays", "scene board: only .* agree with rays .*'tank'",
    ),
    "a road with a gap": (
        ((GRASS, GRASS.replace("<geom ", '<geom group="4" ')),
         ('pos="0 0 -0.25" size="80 3.5 0.25"', 'pos="-20.2 0 -0.01" size="59.8 3.5 0.01"'),
         add_geom('<geom name="rest" class="road" material="asphalt" pos="60.2 0 -0.01" size="19.8 3.5 0.01"/>')),
        "test_the_ground_is_closed", r"sample 0: the sky shows near .(39|40)\.",
    ),
    "a shell behind a wall with holes": (
        (("</asset>", f"{SHELL}</asset>"),
         add_geom(f'{SLATS}<geom name="shell" class="building.plaster" type="mesh" mesh="shell" pos="61 0 3"/>')),
        "test_no_surface_is_seen_from_behind", "the sky shows through the back of 'shell' near .6[1-3]",
    ),
    "no MJCF": (
        (("<worldbody>", "<worldbodies>"), ("</worldbody>", "</worldbodies>")),
        "test_stock_mujoco_compiles_it", "MuJoCo cannot compile it: .*worldbodies",
    ),
    "a bench that cannot be counted": (
        (add_geom('<geom name="plank" class="bench" size="1 0.2 0.05"/>'),),
        "test_gear_composes_it", "geom 'plank' is a bench and needs a body of its own",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BREAKS)
def test_a_broken_town_fails_its_check(broken: Callable[..., TownContract], name: str) -> None:
    changes, check, message = BREAKS[name]
    with pytest.raises((AssertionError, TownError), match=re.compile(message, re.DOTALL)):
        run(broken(*changes), check)


@pytest.mark.parametrize(
    ("change", "check", "message"),
    [
        (("town: tiny", "town: huge"), "test_scenes_belong_to_the_town", "is for 'huge', the town is 'tiny'"),
        (("[55.0, -8.5, 0.0], facing_deg: 175.0", "[155.0, -8.5, 0.0], facing_deg: 175.0"),
         "test_scenes_belong_to_the_town", "scene board: board 0 at .155, -8.5. stands outside of town.bounds"),
        (("[55.0, -8.5, 0.0], facing_deg: 175.0", "[55.0, -8.5, -9.0], facing_deg: 175.0"),
         "test_scenes_belong_to_the_town", "scene board: board 0 at .55, -8.5. has no ground below it"),
        (("[55.0, -8.5, 0.0], facing_deg: 175.0", "[55.0, -8.5, 3.0], facing_deg: 175.0"),
         "test_scenes_belong_to_the_town", "scene board: board 0 at .55, -8.5. has its foot at 3.00 m, the ground is"),
        (("facing_deg: 175.0", "facing_deg: 85.0"), "test_every_scene_can_be_planned_with_its_boards_in_view",
         "scene board: "),
        (("[55.0, 13.0, 0.0]", "[-20.0, 18.0, 0.0]"), "test_every_scene_can_be_planned_with_its_boards_in_view",
         "scene double: .*face"),
        (("asset: truck_box", "asset: truck_bix"), "test_every_scene_can_be_planned_with_its_boards_in_view",
         "scene truck: .*did you mean truck_box"),
    ],
)  # fmt: skip
def test_broken_scenes_fail_their_check(
    broken: Callable[..., TownContract], change: tuple[str, str], check: str, message: str
) -> None:
    contract = broken(scenes=(change,))
    if message.startswith("scene "):
        type(contract).planned_scenes = (message.split(":")[0].removeprefix("scene "),)
    with pytest.raises(AssertionError, match=re.compile(message, re.DOTALL)):
        run(contract, check)


def test_a_board_behind_a_wall_without_collision_is_noticed(broken: Callable[..., TownContract]) -> None:
    """Placement knows collision geoms alone; the contract checks visible geoms as well."""
    wall = '<geom name="sheet" class="building.plaster" material="plaster" pos="53 -8.5 3" size="0.1 6 3"/>'
    contract = broken(add_geom(wall))
    type(contract).planned_scenes = ("board",)
    with pytest.raises(AssertionError, match="scene board: surface_0 shows only 0% of itself in sample 0"):
        run(contract, "test_every_scene_can_be_planned_with_its_boards_in_view")


@pytest.mark.parametrize(
    ("colour", "check", "message"),
    [
        ("0.4 0.4 0.4 0.5", "test_nothing_is_transparent", "geom '.*' has an alpha of 0.5"),
        ("0.4 1.0 0.4 1", "test_materials_are_physical", "geom '.*' has an albedo of 1.00"),
    ],
)
def test_a_board_is_looked_at_as_well(
    broken: Callable[..., TownContract], colour: str, check: str, message: str
) -> None:
    contract = broken()
    board = Path(type(contract).town).parents[1] / "surfaces" / "billboard.xml"
    text, count = re.subn(r'(<geom name="post[^>]*) material="[^"]*"', rf'\1 rgba="{colour}"', board.read_text("utf-8"))
    assert count
    board.write_text(text, encoding="utf-8")
    with pytest.raises(AssertionError, match=message):
        run(contract, check)


def test_every_check_has_a_town_that_fails_it() -> None:
    checks = {name for name in vars(TownContract) if name.startswith("test_")}
    failed = {check for _, check, _ in BREAKS.values()}
    failed |= {"test_scenes_belong_to_the_town", "test_every_scene_can_be_planned_with_its_boards_in_view"}
    assert checks == failed


def test_one_can_walk_round_what_stands_on_a_sidewalk(broken: Callable[..., TownContract]) -> None:
    stop = '<geom name="stop" class="collision" pos="-40 -4.5 1" size="2 0.6 1"/>'
    kiosk = '<geom name="kiosk" class="collision" pos="-35 -5.5 1" size="2 0.6 1"/>'
    run(broken(add_geom(stop), add_geom(kiosk)), "test_people_can_walk")


def test_what_a_town_needs_not_can_be_left_out(broken: Callable[..., TownContract]) -> None:
    town = broken(('<geom name="hedge" class="vegetation"', '<geom name="hedge" class="terrain"'))
    type(town).expected = STREET - {"vegetation"}
    run(town, "test_every_class_of_a_street_is_there")


@pytest.mark.parametrize(
    ("attribute", "value", "check", "message"),
    [
        ("planned_scenes", ("bord",), "test_every_scene_can_be_planned_with_its_boards_in_view",
         "scene bord: no scene of tiny named 'bord'; did you mean board"),
        ("expected", frozenset({"rode"}), "test_every_class_of_a_street_is_there", "`expected` are no labels:\n  rode"),
    ],
)  # fmt: skip
def test_missing_names_of_a_contract_are_reported(
    broken: Callable[..., TownContract], attribute: str, value: object, check: str, message: str
) -> None:
    town = broken()
    setattr(type(town), attribute, value)
    with pytest.raises(AssertionError, match=message):
        run(town, check)


def run(contract: TownContract, check: str) -> None:
    takes_property = check in ("test_stock_mujoco_compiles_it", "test_gear_composes_it")
    getattr(contract, check)(*([lambda name, value: None] if takes_property else []))
