"""The contract of towns (what gear expects of every town), as tests.

Subclass it in your own tests, and set the town and its scenes:

    class TestMyTown(TownContract):
        town = "my/towns/port.xml"
        scenes = "my/scenes/port.yml"

The town's own file is checked against `docs/reference/mjcf.md`: labels, visible and collision geoms, materials, lanes,
walks, parking bays, bounds and clipping planes. Then gear composes the town and plans samples of every scene; the
billboards must be in view, and rendered ids and depth must agree with MuJoCo's rays.

Of billboards, vehicles and people, only those in the first scene are checked: whether gear can compose them, and their
materials. The fit of collision geoms and the number of triangles are not checked. Messages name the geom, the lane or
the scene.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import ClassVar

from gear.testing import town_clear, town_materials, town_scenes, town_streets
from gear.testing.town_facts import TownUnderTest, town_under_test
from gear.values.labels import LABEL_BY_NAME
from gear.world.assets.geom_classes import FIRST_HIDDEN_GROUP, unprefixed_class
from gear.world.compilation.model_compilation import COLLISION_CLASS

MESSAGES_SHOWN = 12

STREET = frozenset(
    {"road", "road_marking", "sidewalk", "terrain", "building", "pole", "traffic_light", "traffic_sign", "vegetation"}
)
"""Labels that a town must have by default; another label of the same Cityscapes class counts too."""

PRIMITIVES = ("mjGEOM_PLANE", "mjGEOM_SPHERE", "mjGEOM_CAPSULE", "mjGEOM_CYLINDER", "mjGEOM_BOX")


class TownContract:
    """The promises of a town, as tests. A test class subclasses it and sets `town` and `scenes`.

    Attributes:
        town: name of a town, or path of its MJCF.
        scenes: path of its scene library; empty for gear's own library of that town.
        expected: labels that the town must have.
        open_ends: names of lanes that may end, such as those where a road leaves the town.
        planned_scenes: names of the scenes that are planned and rendered; None for all.
        samples: number of samples that are planned of each scene.
        join_m, max_turn_deg: largest gap and largest turn between a lane and the lane that continues it.
        lane_width_m, speed_mps: smallest and largest width and speed of a lane.
        ground_m: largest difference between the height of a lane or walk and its ground.
        wheel_m: half the track of a car; the ground is also checked at this distance from the middle of a lane.
        near_m: smallest and largest distance of the near clipping plane.
        far_m: smallest distance of the far clipping plane.
        min_visible: share of each billboard that must be visible in each sample.
        albedo: largest albedo of a visible geom in any colour channel.
        min_agreement: share of rendered pixels, away from edges, that must have the id and depth of a ray.
    """

    town: ClassVar[str | Path]
    scenes: ClassVar[str | Path] = ""
    expected: ClassVar[frozenset[str]] = STREET
    open_ends: ClassVar[frozenset[str]] = frozenset()
    planned_scenes: ClassVar[Sequence[str] | None] = None
    samples: ClassVar[int] = 2
    join_m: ClassVar[float] = 0.1
    max_turn_deg: ClassVar[float] = 40.0
    lane_width_m: ClassVar[tuple[float, float]] = (2.4, 6.0)
    speed_mps: ClassVar[tuple[float, float]] = (1.0, 45.0)
    ground_m: ClassVar[float] = 0.04
    wheel_m: ClassVar[float] = 0.8
    near_m: ClassVar[tuple[float, float]] = (0.005, 0.5)
    far_m: ClassVar[float] = 500.0
    min_visible: ClassVar[float] = 0.1
    albedo: ClassVar[float] = 0.9
    min_agreement: ClassVar[float] = 0.98

    def under_test(self) -> TownUnderTest:
        """The town and its scenes, compiled once for all checks."""
        return town_under_test(str(self.town), str(self.scenes))

    def test_stock_mujoco_compiles_it(self, record_property: Callable[[str, object], None]) -> None:
        """MuJoCo without gear compiles the town's file; the test report has the seconds and the number of triangles."""
        _, model, seconds = self.under_test().compiled
        record_property("compile_s", round(seconds, 2))
        record_property("triangles", int(model.nmeshface))

    def test_gear_composes_it(self, record_property: Callable[[str, object], None]) -> None:
        """Gear composes the world of the first scene; the test report has the seconds that it takes."""
        world, seconds = self.under_test().first_world
        record_property("compose_s", round(seconds, 2))
        assert world.model.ngeom > 0 and world.lanes.lanes

    def test_visible_geoms_are_labelled(self) -> None:
        """The class of every visible geom starts with a label, such as `building.brick`."""
        fail_if("visible geoms have no label: their class must start with one, such as `building.brick`", [
            f"geom {geom.name!r} of body {geom.parent.name!r} has class {unprefixed_class(geom.classname.name)!r}"
            for geom in self.under_test().compiled[0].geoms
            if geom.group < FIRST_HIDDEN_GROUP
            and _label(geom.classname.name) not in (LABEL_BY_NAME.keys() - {"sky"})
        ])  # fmt: skip

    def test_visible_geoms_do_not_collide(self) -> None:
        """Visible geoms do not collide; collision geoms are primitives of group 3, and no other geom is hidden."""
        problems = []
        for geom in self.under_test().compiled[0].geoms:
            is_collision = _label(geom.classname.name) == COLLISION_CLASS
            if is_collision and geom.group < FIRST_HIDDEN_GROUP:
                problems.append(f"geom {geom.name!r} of class collision is in group {geom.group}, so it is visible")
            elif is_collision and geom.group != FIRST_HIDDEN_GROUP:
                problems.append(f"geom {geom.name!r} of class collision is in group {geom.group}, not 3")
            elif not is_collision and geom.group >= FIRST_HIDDEN_GROUP:
                problems.append(
                    f"geom {geom.name!r} is in group {geom.group} and not of class collision: neither visible nor a"
                    " collision geom"
                )
            elif is_collision and geom.type.name not in PRIMITIVES:
                problems.append(
                    f"geom {geom.name!r} of class collision is a {geom.type.name[7:].lower()}, no primitive"
                )
            elif not is_collision and geom.group < FIRST_HIDDEN_GROUP and (geom.contype or geom.conaffinity):
                problems.append(f"geom {geom.name!r} is visible and has contype or conaffinity, so it collides")
        fail_if("visible and collision geoms are mixed up", problems)

    def test_nothing_is_transparent(self) -> None:
        """No visible geom is transparent, since ids and depth hold one geom for each pixel."""
        town = self.under_test()
        # Geoms of the town's own file are named as they are in that file.
        problems = town_materials.transparent(town.compiled[1])
        fail_if("visible geoms are transparent", problems or town_materials.transparent(town.first_world[0].model))

    def test_materials_are_physical(self) -> None:
        """Renderers can show every texture, colours are marked as sRGB, and no geom reflects too much light."""
        town = self.under_test()
        problems = town_materials.unphysical(town.compiled[1], self.albedo)
        if not problems:
            world = town.first_world[0]
            problems = town_materials.unphysical(world.model, self.albedo, world.classes.is_face)
        fail_if("materials are not physical", problems)

    def test_every_class_of_a_street_is_there(self) -> None:
        """The town has every label in `expected`, or another label of the same Cityscapes class."""
        there = {
            LABEL_BY_NAME[label].cityscapes_id
            for geom in self.under_test().compiled[0].geoms
            if geom.group < FIRST_HIDDEN_GROUP and (label := _label(geom.classname.name)) in LABEL_BY_NAME
        }
        fail_if("names in `expected` are no labels", sorted(self.expected - LABEL_BY_NAME.keys()))
        missing = sorted(name for name in self.expected if LABEL_BY_NAME[name].cityscapes_id not in there)
        fail_if("labels are missing from the town (if it needs none, take them out of `expected`)", missing)

    def test_lanes_are_continued(self) -> None:
        """Every lane, except those in `open_ends`, is continued by another lane without a gap."""
        fail_if("lanes end or tear", town_streets.dead_ends(self.under_test().graph, self.open_ends, self.join_m))

    def test_headings_are_continuous(self) -> None:
        """No lane turns by more than `max_turn_deg` at one point, or into the lane that continues it."""
        fail_if("lanes have kinks", town_streets.kinks(self.under_test().graph, self.max_turn_deg))

    def test_widths_and_speeds_are_sane(self) -> None:
        """Widths of lanes and walks and speeds of lanes are within the limits."""
        graph = self.under_test().graph
        fail_if("lanes have odd sizes", town_streets.odd_sizes(graph, self.lane_width_m, self.speed_mps))

    def test_neighbours_run_side_by_side(self) -> None:
        """The left and right neighbours of a lane are on that side and have the same direction."""
        fail_if("neighbours are elsewhere", town_streets.lost_neighbours(self.under_test().graph))

    def test_lanes_lie_on_the_road(self) -> None:
        """Collision ground and visible road are at the height of each lane, also below the wheels of a car."""
        fail_if(
            "lanes are off the road", town_streets.lanes_off_the_road(self.under_test(), self.ground_m, self.wheel_m)
        )

    def test_lanes_are_clear(self) -> None:
        """No collision or visible geom blocks a lane within the width and height of the vehicles that use it."""
        fail_if("lanes are blocked", town_clear.blocked_lanes(self.under_test()))

    def test_people_can_walk(self) -> None:
        """Sidewalks and crosswalks are on the ground and passable; crosswalks cross lanes and end at sidewalks."""
        fail_if("walks are in the air", town_streets.walks_off_the_ground(self.under_test(), self.ground_m))
        fail_if("walks are blocked", town_clear.blocked_walks(self.under_test()))
        fail_if("crosswalks lead nowhere", town_streets.idle_crosswalks(self.under_test().graph))

    def test_cars_can_park(self) -> None:
        """Parking bays are on the ground, empty, and outside of the lanes."""
        fail_if("parking bays cannot be used", town_streets.bad_bays(self.under_test(), self.ground_m))

    def test_bounds_hold_everything(self) -> None:
        """No lane, walk or parking bay leaves `town.bounds`."""
        fail_if("things are out of bounds", town_streets.out_of_bounds(self.under_test().graph))

    def test_depth_has_a_range(self) -> None:
        """The near and far clipping planes are within the limits `near_m` and `far_m`."""
        model = self.under_test().compiled[1]
        near_m, far_m = (float(v * model.stat.extent) for v in (model.vis.map.znear, model.vis.map.zfar))
        problems = []
        if not self.near_m[0] <= near_m <= self.near_m[1]:
            problems.append(f"nearest is {near_m:.3g} m, not {self.near_m[0]:g} to {self.near_m[1]:g} m")
        if far_m < self.far_m:
            problems.append(f"furthest is {far_m:.3g} m, not at least {self.far_m:g} m")
        fail_if(
            "clipping planes are wrong; set <statistic extent> and <map znear zfar>, whose product counts", problems
        )

    def test_scenes_belong_to_the_town(self) -> None:
        """The scene library names this town, and its boards stand on the ground inside the town's bounds."""
        fail_if("scenes are elsewhere", town_scenes.misplaced(self.under_test()))

    def test_every_scene_can_be_planned_with_its_boards_in_view(self) -> None:
        """Samples of every scene can be planned, and a share `min_visible` of each board is visible in each sample."""
        town = self.under_test()
        names = tuple(town.scenes.scenes) if self.planned_scenes is None else tuple(self.planned_scenes)
        fail_if("scenes cannot be used", town_scenes.unusable(town, names, self.samples, self.min_visible))

    def test_the_ground_is_closed(self) -> None:
        """Meshes of ground and buildings have no cracks, through which pixels would show what lies behind."""
        fail_if("there are cracks in the ground", town_scenes.cracks(self.under_test(), self.samples))

    def test_no_surface_is_seen_from_behind(self) -> None:
        """No small piece of sky amid ground and buildings is the back of a surface, as if a face were missing."""
        fail_if("surfaces are seen from behind", town_scenes.open_backs(self.under_test(), self.samples))

    def test_ids_and_depth_are_those_of_rays(self) -> None:
        """Ids and depth of the classic renderer agree with MuJoCo's own rays on the first scene."""
        fail_if("pixels and rays differ", town_scenes.disagreement(self.under_test(), self.min_agreement))


def fail_if(what: str, problems: Sequence[str]) -> None:
    """Fails a test with a list of problems, if there are any.

    Args:
        what: title of the problems.
        problems: one line for each problem.

    Raises:
        AssertionError: there are problems.
    """
    shown = [
        *problems[:MESSAGES_SHOWN],
        *([f"and {len(problems) - MESSAGES_SHOWN} more"] * (len(problems) > MESSAGES_SHOWN)),
    ]
    assert not problems, f"{what}:\n  " + "\n  ".join(shown)


def _label(classname: str) -> str:
    return unprefixed_class(classname).partition(".")[0]
