"""What every town promises. Subclass it in your own tests, and say where the town and its scenes are:

    class TestMyTown(TownContract):
        town = "my/towns/port.xml"
        scenes = "my/scenes/port.yml"

The town's own file is held against `docs/reference/mjcf.md`: labels, what is seen and felt, materials, lanes, walks,
bays, bounds and depth. Then gear composes the town, plans samples of every scene with the boards in view, and rendered
ids and depth must be those of rays. Boards, vehicles and people are read as far as the first scene is composed of them,
which tells what gear cannot use, and their materials are looked at; how well collision geoms fit, how many triangles
there are and how meshes are rounded is not. Messages name the geom, the lane or the scene.
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
"""Labels without which a street is none; another label of the same Cityscapes class will do."""

PRIMITIVES = ("mjGEOM_PLANE", "mjGEOM_SPHERE", "mjGEOM_CAPSULE", "mjGEOM_CYLINDER", "mjGEOM_BOX")


class TownContract:
    """Attributes:
    town: name of a town, or path of its MJCF.
    scenes: path of its scene library; empty for gear's own of that town.
    expected: labels that must be there.
    open_ends: lanes that may end, such as where a road leaves the town.
    planned_scenes: scenes that are planned and rendered; None for all.
    samples: planned of each scene.
    join_m, max_turn_deg: how far and how sharply a lane may be from the one that continues it.
    lane_width_m, speed_mps: least and most.
    ground_m: how far lanes and walks may be from the height of their ground.
    wheel_m: half the track of a car, which must stand on the road as well.
    near_m, far_m: least and most distance of the near clipping plane, least of the far one.
    min_visible: share of each board that must be seen in each sample.
    albedo: most that a visible geom gives back, of any colour.
    min_agreement: share of pixels away from edges whose id and depth must be those of rays.
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
        """The town, compiled once for all checks."""
        return town_under_test(str(self.town), str(self.scenes))

    def test_stock_mujoco_compiles_it(self, record_property: Callable[[str, object], None]) -> None:
        """It is plain MJCF; how long it takes is put into the report."""
        _, model, seconds = self.under_test().compiled
        record_property("compile_s", round(seconds, 2))
        record_property("triangles", int(model.nmeshface))

    def test_gear_composes_it(self, record_property: Callable[[str, object], None]) -> None:
        """The first scene becomes a world; how long it takes is put into the report."""
        world, seconds = self.under_test().first_world
        record_property("compose_s", round(seconds, 2))
        assert world.model.ngeom > 0 and world.lanes.lanes

    def test_what_is_seen_is_labelled(self) -> None:
        """The first part of every visible geom's class is a label."""
        fail_if("visible geoms have no label: their class must start with one, such as `building.brick`", [
            f"geom {geom.name!r} of body {geom.parent.name!r} has class {unprefixed_class(geom.classname.name)!r}"
            for geom in self.under_test().compiled[0].geoms
            if geom.group < FIRST_HIDDEN_GROUP
            and _label(geom.classname.name) not in (LABEL_BY_NAME.keys() - {"sky"})
        ])  # fmt: skip

    def test_what_is_seen_is_not_felt(self) -> None:
        """Visible geoms touch nothing; collision geoms are primitives of group 3, and nothing else is hidden."""
        problems = []
        for geom in self.under_test().compiled[0].geoms:
            is_collision = _label(geom.classname.name) == COLLISION_CLASS
            if is_collision and geom.group < FIRST_HIDDEN_GROUP:
                problems.append(f"geom {geom.name!r} of class collision is in group {geom.group}, so it is seen")
            elif is_collision and geom.group != FIRST_HIDDEN_GROUP:
                problems.append(f"geom {geom.name!r} of class collision is in group {geom.group}, not 3")
            elif not is_collision and geom.group >= FIRST_HIDDEN_GROUP:
                problems.append(
                    f"geom {geom.name!r} is in group {geom.group} and not of class collision: neither seen nor felt"
                )
            elif is_collision and geom.type.name not in PRIMITIVES:
                problems.append(
                    f"geom {geom.name!r} of class collision is a {geom.type.name[7:].lower()}, no primitive"
                )
            elif not is_collision and geom.group < FIRST_HIDDEN_GROUP and (geom.contype or geom.conaffinity):
                problems.append(f"geom {geom.name!r} is seen and has contype or conaffinity, so it is felt")
        fail_if("geoms are seen and felt", problems)

    def test_nothing_is_transparent(self) -> None:
        """Ids and depth know every pixel, so nothing shines through."""
        town = self.under_test()
        # What the town's own file holds is told by the names that it has there.
        problems = town_materials.transparent(town.compiled[1])
        fail_if("visible geoms are transparent", problems or town_materials.transparent(town.first_world[0].model))

    def test_materials_are_physical(self) -> None:
        """Renderers can show every texture, colours are marked as such, and nothing gives back more light than it
        gets."""
        town = self.under_test()
        problems = town_materials.unphysical(town.compiled[1], self.albedo)
        if not problems:
            world = town.first_world[0]
            problems = town_materials.unphysical(world.model, self.albedo, world.classes.is_face)
        fail_if("materials are not physical", problems)

    def test_every_class_of_a_street_is_there(self) -> None:
        """No class that networks know from streets is missing."""
        there = {
            LABEL_BY_NAME[label].cityscapes_id
            for geom in self.under_test().compiled[0].geoms
            if geom.group < FIRST_HIDDEN_GROUP and (label := _label(geom.classname.name)) in LABEL_BY_NAME
        }
        fail_if("names in `expected` are no labels", sorted(self.expected - LABEL_BY_NAME.keys()))
        missing = sorted(name for name in self.expected if LABEL_BY_NAME[name].cityscapes_id not in there)
        fail_if("labels are missing from the town (if it needs none, take them out of `expected`)", missing)

    def test_one_can_drive_for_ever(self) -> None:
        """Every lane is continued, without a gap."""
        fail_if("lanes end or tear", town_streets.dead_ends(self.under_test().graph, self.open_ends, self.join_m))

    def test_headings_are_continuous(self) -> None:
        """No lane turns on the spot."""
        fail_if("lanes have kinks", town_streets.kinks(self.under_test().graph, self.max_turn_deg))

    def test_widths_and_speeds_are_sane(self) -> None:
        """As wide and as fast as roads are."""
        graph = self.under_test().graph
        fail_if("lanes have odd sizes", town_streets.odd_sizes(graph, self.lane_width_m, self.speed_mps))

    def test_neighbours_run_side_by_side(self) -> None:
        """`left` is left, `right` is right, and both go the same way."""
        fail_if("neighbours are elsewhere", town_streets.lost_neighbours(self.under_test().graph))

    def test_lanes_lie_on_the_road(self) -> None:
        """Felt and seen, at the lane's height, all along and as wide as a car."""
        fail_if(
            "lanes are off the road", town_streets.lanes_off_the_road(self.under_test(), self.ground_m, self.wheel_m)
        )

    def test_lanes_are_clear(self) -> None:
        """Nothing stands or hangs on a lane, felt or only seen, as wide and as high as what drives there."""
        fail_if("lanes are blocked", town_clear.blocked_lanes(self.under_test()))

    def test_people_can_walk(self) -> None:
        """Sidewalks and crosswalks lie on the ground and let people pass; crosswalks join sidewalks across lanes."""
        fail_if("walks are in the air", town_streets.walks_off_the_ground(self.under_test(), self.ground_m))
        fail_if("walks are blocked", town_clear.blocked_walks(self.under_test()))
        fail_if("crosswalks lead nowhere", town_streets.idle_crosswalks(self.under_test().graph))

    def test_cars_can_park(self) -> None:
        """Bays are on the ground, empty and beside the lanes."""
        fail_if("parking bays cannot be used", town_streets.bad_bays(self.under_test(), self.ground_m))

    def test_bounds_hold_everything(self) -> None:
        """Nothing that road users keep to leaves `town.bounds`."""
        fail_if("things are out of bounds", town_streets.out_of_bounds(self.under_test().graph))

    def test_depth_has_a_range(self) -> None:
        """Clipping planes are where a car's camera needs them."""
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
        """The library names the town, and its boards stand inside of it."""
        fail_if("scenes are elsewhere", town_scenes.misplaced(self.under_test()))

    def test_every_scene_can_be_planned_with_its_boards_in_view(self) -> None:
        """Samples of every scene are drawn, and rays from the camera reach the faces."""
        town = self.under_test()
        names = tuple(town.scenes.scenes) if self.planned_scenes is None else tuple(self.planned_scenes)
        fail_if("scenes cannot be used", town_scenes.unusable(town, names, self.samples, self.min_visible))

    def test_the_ground_is_closed(self) -> None:
        """Meshes that meet in a T leave cracks of a pixel: a slab below the town keeps the sky out of them."""
        fail_if("there are cracks in the ground", town_scenes.cracks(self.under_test(), self.samples))

    def test_ids_and_depth_are_those_of_rays(self) -> None:
        """The classic renderer and MuJoCo's own rays agree on the first scene."""
        fail_if("pixels and rays differ", town_scenes.disagreement(self.under_test(), self.min_agreement))


def fail_if(what: str, problems: Sequence[str]) -> None:
    """Fails with what was found, if anything was.

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
