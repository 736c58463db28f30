"""Street furniture: lamps, trees, signals, signs, benches and the rest, each where it belongs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from shapely.geometry import LineString, Point  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]
from shapely.ops import unary_union  # type: ignore[import-untyped]

from authoring import kit
from authoring.kit.parts import Part
from authoring.towns import paths, signage
from authoring.towns.network import BAY_M, CROSSING_M, STOP_LINE_GAP_M, Street
from authoring.towns.props import Ground, Props
from authoring.towns.regions import KERB_M, Regions

Array = npt.NDArray[np.float64]
LAMP_M = 25.0
MEDIAN_TREE_M = 14.5
# Trees on the quays that are farther from every bridge are simple ones.
SEEN_FROM_BRIDGE_M = 34.0
# Length of a street out of town along which there are lamps.
OUTSIDE_M = 80.0
FROM_KERB_M = 0.65
LAMP_SHIFTS_M = (0.0, 0.8, -0.8)
# Faster streets have priority signs, for the case that traffic lights fail.
PRIORITY_MPS = 12.0
FAR_M = 236.0
TREES = (
    ("street", 7.5), ("broad", 8.5), ("linden", 8.0), ("street", 6.5), ("columnar", 9.0), ("linden", 7.0),
    ("broad", 7.2), ("street", 8.2),
)  # fmt: skip
EXTRAS = ("bin", "bench", "cable_box", "planter") + ("none",) * 11


class Furnisher:
    """Furnishes a town's streets; the same generator gives the same town."""

    def __init__(
        self,
        props: Props,
        regions: Regions,
        ground: Ground,
        *,
        rng: np.random.Generator,
        extras: Sequence[str] = EXTRAS,
    ) -> None:
        self.props, self.regions, self.ground, self.rng, self.extras = props, regions, ground, rng, extras
        self.network = regions.network
        self.bays = unary_union([group.outline for group in regions.bay_groups]).buffer(0.3)
        tree_rng = np.random.default_rng([77, 1])
        self.trees = [kit.tree(species, height, tree_rng) for species, height in TREES]
        self.far_trees = [kit.tree(species, height, tree_rng, lod="far") for species, height in TREES]
        self.grate = kit.road_cover("tree_grate")

    def street(self, street: Street) -> None:
        """Everything along one street."""
        start, end = self.network.span(street.name)
        signage.crossing_lights(self, street)
        for side in (1, -1):
            self._lamps(street, side, start, end)
            if street.trees_m and not street.hump_m:
                self._trees(street, side, start + 7, end - 7)
            if street.end is not None and not street.hump_m:
                self._extras(street, side, start + 5, end - 5)
        if street.profile.median_m and not street.hump_m:
            for station in np.arange(start + 7, end - 5, MEDIAN_TREE_M):
                point, _ = paths.at(self.network.lines[street.name], float(station))
                self.plant(float(point[0]), float(point[1]), KERB_M, kind=int(self.rng.integers(3)), always=True)
        if street.end is not None:
            self._hydrant(street, start, end)
            self._meters(street)
            self._covers(street, start, end)
        self.signs(street)

    def signs(self, street: Street) -> None:
        """Signs along a street; what stands there already stays where it is."""
        if street.hump_m or street.joins:
            return
        start, end = self.network.span(street.name)
        signage.signs_along(self, street, last_m=end if street.end else min(end, start + OUTSIDE_M))
        signage.chevrons(self, street)

    def node(self, name: str) -> None:
        """Signals or signs on every arm of a junction, facing arriving traffic."""
        node = self.network.nodes[name]
        east_west_green = bool(self.rng.random() < 0.5)
        for arm, starts, away in self.network.arms(name):
            street = self.network.streets[arm]
            coming = street.profile.backward if starts else street.profile.forward
            if street.end is None or coming == 0:
                continue
            heading = -away
            mouth = self.network.mouths[arm, starts]
            green = (abs(heading[0]) > abs(heading[1])) == east_west_green
            lit = "green" if green else "red"
            back = mouth - STOP_LINE_GAP_M - CROSSING_M - 0.35
            x, y = self.at_mouth(street, starts, back, FROM_KERB_M + 0.1)
            yaw = float(np.arctan2(heading[1], heading[0]) - np.pi / 2)
            if node.control == "signals":
                if coming > 1 or street.hump_m:
                    parts = kit.traffic_light_mast(arm_m=6.4 if coming > 1 else 4.6, lit=(lit,) * max(coming, 1))
                    self.stand(f"light_mast{coming}_{lit}", parts, x, y, yaw, 0.2, high=5.5)
                else:
                    self.stand(f"light_{lit}", kit.traffic_light(lit=lit), x, y, yaw, 0.15, high=3.0)
                    x, y = self.at_mouth(street, starts, mouth + 0.8, FROM_KERB_M + 0.1, left=True)
                    self.stand(f"light_{lit}", kit.traffic_light(lit=lit), x, y, yaw, 0.15, high=3.0)
                if coming > 1 and not street.hump_m:
                    signage.corner_railings(self, street, starts=starts)
                sign = "priority" if street.profile.speed_mps > PRIORITY_MPS else "yield"
                x, y = self.at_mouth(street, starts, mouth + 10.0, FROM_KERB_M)
                self.stand(f"sign_{sign}", kit.traffic_sign(sign), x, y, yaw, 0.08, high=2.8)
            else:
                x, y = self.at_mouth(street, starts, mouth - 0.2, FROM_KERB_M)
                sign = "stop" if node.control == "stop" else "yield"
                self.stand(f"sign_{sign}", kit.traffic_sign(sign), x, y, yaw, 0.08, high=2.9)
            if self.rng.random() < 0.6:
                x, y = self.at_mouth(street, starts, mouth + 14.0, FROM_KERB_M, left=True)
                sign = str(self.rng.choice(["speed_30", "no_parking", "crossing", "speed_50", "parking"]))
                self.stand(f"sign_{sign}", kit.traffic_sign(sign), x, y, yaw + np.pi, 0.08, high=2.8)
            if street.profile.one_way and not starts:
                for left in (False, True):
                    x, y = self.at_mouth(street, starts, mouth + 1.6, FROM_KERB_M, left=left)
                    self.stand("no_entry", kit.traffic_sign("no_entry"), x, y, yaw + np.pi, 0.08, high=2.8)
        self._one_way(name)
        self._corner(name)
        signage.heads(self, name)

    def quay(self, line: Array, from_middle_m: float, land: BaseGeometry) -> None:
        """Trees, lamps and benches on both banks of a canal, wherever `land` is free for them."""
        for side in (1, -1):
            bank = paths.offset(line, side * from_middle_m)
            for index, station in enumerate(np.arange(0.0, paths.length(bank), 6.5)):
                point, along = paths.at(bank, float(station))
                x, y = (float(v) for v in point)
                if max(abs(x), abs(y)) > FAR_M or not land.contains(Point(x, y).buffer(1.0)):
                    continue
                yaw = float(np.arctan2(along[1], along[0]) + (np.pi if side > 0 else 0.0))
                if index % 2 == 0:
                    simple = self.regions.corridors.distance(Point(x, y)) > SEEN_FROM_BRIDGE_M
                    self.plant(x, y, KERB_M, kind=1 + (index // 2) % 4, always=True, simple=simple)
                elif index % 4 == 1:
                    self.props.put("lamp", kit.street_lamp(style="heritage"), x, y, KERB_M, yaw, radius_m=0.2, high_m=4)
                elif index % 16 == 3:
                    self.props.put("bench", kit.bench(style="stone"), x, y, KERB_M, yaw, radius_m=0.9, high_m=0.6)

    def plant(self, x: float, y: float, z: float, *, kind: int, always: bool = False, simple: bool = False) -> None:
        """A tree, if there is room: near ones in detail, far ones simple."""
        index = kind % len(self.trees)
        if not always and not (self.ground.takes(x, y, tall=True) and self.props.is_free(x, y, 1.2)):
            return
        if always and self.ground.views.contains(Point(x, y)):
            return
        yaw = float(self.rng.uniform(0, 2 * np.pi))
        if simple or max(abs(x), abs(y)) > FAR_M:
            self.props.put(f"tree_far{index}", self.far_trees[index], x, y, z, yaw, radius_m=0.35, high_m=4.0)
        else:
            self.props.instance(f"tree{index}", self.trees[index], x, y, z, yaw, radius_m=0.3, high_m=4.0)

    def _lamps(self, street: Street, side: int, start: float, end: float) -> None:
        style = "heritage" if street.name.startswith("quay") else "modern"
        parts = kit.street_lamp(style=style)
        if street.hump_m:
            return
        if street.end is None:
            end = min(end, start + OUTSIDE_M)
        for station in np.arange(start + 4 + (LAMP_M / 2 if side < 0 else 0), end - 2, LAMP_M):
            self.lamp(f"lamp_{style}", parts, street, side, float(station))

    def lamp(self, kind: str, parts: list[Part], street: Street, side: int, station: float) -> None:
        """A lamp over the road, which gives way by a step to a sign that has its place."""
        for shift in LAMP_SHIFTS_M:
            x, y, toward = self.beside(street, side, station + shift, FROM_KERB_M)
            if self.stand(kind, parts, x, y, float(np.arctan2(toward[1], toward[0]) + np.pi / 2), 0.15, high=6.0):
                return

    def _trees(self, street: Street, side: int, start: float, end: float) -> None:
        kind = sum(map(ord, street.name)) % len(TREES)
        for station in np.arange(start + (0 if side > 0 else street.trees_m / 3), end, street.trees_m):
            if signage.hides_lights(self.network, street.name, side, float(station)):
                continue
            x, y, _ = self.beside(street, side, float(station), 1.0)
            before = len(self.props.spots)
            self.plant(x, y, KERB_M, kind=kind if self.rng.random() < 0.8 else int(self.rng.integers(len(TREES))))
            if len(self.props.spots) > before and max(abs(x), abs(y)) < FAR_M:
                self.props.sink.extend(kit.place(self.grate, x_m=x, y_m=y, z_m=KERB_M))

    def _extras(self, street: Street, side: int, start: float, end: float) -> None:
        for station in np.arange(start + float(self.rng.uniform(0, 5)), end, 7.5):
            kind = str(self.rng.choice(self.extras))
            if kind == "none":
                continue
            x, y, toward = self.beside(street, side, float(station), 0.75)
            yaw = float(np.arctan2(toward[1], toward[0]) + np.pi / 2)
            if kind == "bench":
                self.stand("bench", kit.bench(style="wood"), x, y, yaw + np.pi, 0.9, high=0.8)
            elif kind == "planter":
                self.stand("planter", kit.planter("box", self.rng), x, y, yaw, 0.8, high=0.8)
            elif kind == "letter_box":
                self.stand("letter_box", kit.letter_box(colour="signal_blue"), x, y, yaw + np.pi, 0.35, high=1.2)
            elif kind == "cable_box":
                self.stand("cable_box", kit.cable_box(), x, y, yaw + np.pi, 0.5, high=1.1)
            else:
                self.stand("bin", kit.bin_(style="post" if side > 0 else "steel"), x, y, yaw, 0.3, high=1.0)

    def _hydrant(self, street: Street, start: float, end: float) -> None:
        side = 1 if sum(map(ord, street.name)) % 2 else -1
        x, y, toward = self.beside(street, side, start + 0.37 * (end - start), 0.6)
        yaw = float(np.arctan2(toward[1], toward[0]) + np.pi / 2)
        self.stand("hydrant", kit.fire_hydrant(), x, y, yaw, 0.25, high=0.8)

    def bus_stop(self, street: Street, side: int, share: float) -> None:
        """A shelter beside a street, its back to the houses."""
        start, end = self.network.span(street.name)
        x, y, toward = self.beside(street, side, start + share * (end - start), 2.0)
        yaw = float(np.arctan2(toward[1], toward[0]) + np.pi / 2)
        if self.props.is_free(x, y, 1.0):
            self.stand("bus_stop", kit.bus_stop(self.rng), x, y, yaw, 1.9, high=2.4)

    def _meters(self, street: Street) -> None:
        axis = LineString(self.network.lines[street.name])
        for group in self.regions.bay_groups:
            if group.street == street.name:
                for index, (x, y, yaw_deg) in enumerate(group.bays):
                    if index % 4 == 1:
                        along = np.array([np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg))])
                        normal = np.array([along[1], -along[0]])
                        beyond = np.array([x, y]) + normal
                        away = normal if axis.distance(Point(*beyond)) > axis.distance(Point(x, y)) else -normal
                        px, py = np.array([x, y]) + along * BAY_M[0] / 2 + away * (BAY_M[1] / 2 + 0.4)
                        yaw = float(np.arctan2(-away[1], -away[0]) + np.pi / 2) + np.pi
                        self.stand("meter", kit.parking_meter(), float(px), float(py), yaw, 0.12, high=1.3)

    def _covers(self, street: Street, start: float, end: float) -> None:
        if street.hump_m:
            return
        line = self.network.lines[street.name]
        for station in np.arange(start + float(self.rng.uniform(3, 12)), end, 28.0):
            point, along = paths.at(line, float(station))
            normal = np.array([-along[1], along[0]])
            half = street.profile.half_width_m
            x, y = point + normal * float(self.rng.choice([-1, 1])) * (street.profile.median_m / 2 + 1.6)
            yaw = float(np.arctan2(along[1], along[0]))
            cover = kit.road_cover(str(self.rng.choice(["manhole", "manhole_square"])))
            self.props.sink.extend(kit.place(cover, x_m=float(x), y_m=float(y), z_m=0.003, yaw_rad=yaw))
            x, y = point + normal * (half - 0.3)
            if not self.bays.contains(Point(*(point + normal * (half + 0.6)))):
                self.props.sink.extend(
                    kit.place(kit.road_cover("drain"), x_m=float(x), y_m=float(y), z_m=0.003, yaw_rad=yaw)
                )

    def _one_way(self, name: str) -> None:
        """Signs where a one-way street starts."""
        for arm, starts, away in self.network.arms(name):
            street = self.network.streets[arm]
            if street.profile.one_way and street.profile.forward and starts:
                x, y = self.at_mouth(street, starts, self.network.mouths[arm, starts] + 3.0, FROM_KERB_M, left=True)
                yaw = float(np.arctan2(away[1], away[0]) - np.pi / 2)
                self.stand("one_way", kit.traffic_sign("one_way"), x, y, yaw, 0.08, high=2.8)

    def _corner(self, name: str) -> None:
        arm, starts, away = self.network.arms(name)[0]
        street = self.network.streets[arm]
        x, y = self.at_mouth(street, starts, self.network.mouths[arm, starts] + 2.2, FROM_KERB_M, left=True)
        yaw = float(np.arctan2(away[1], away[0]))
        self.stand("street_name", kit.street_name_sign(), x, y, yaw, 0.08, high=3.0)
        for arm, starts, _ in self.network.arms(name):
            back = self.network.mouths[arm, starts] - STOP_LINE_GAP_M - CROSSING_M - 0.7
            x, y = self.at_mouth(self.network.streets[arm], starts, back, 0.45)
            self.stand("bollard", kit.bollard(), x, y, 0.0, 0.12, high=0.9)

    def beside(self, street: Street, side: int, station: float, from_kerb: float) -> tuple[float, float, Array]:
        """A point on a sidewalk's edge and the unit direction from it to the road."""
        point, along = paths.at(self.network.lines[street.name], station)
        normal = side * np.array([-along[1], along[0]])
        half = street.profile.half_width_m
        spot = point + normal * (half + from_kerb)
        if self.bays.contains(Point(*(point + normal * (half + 0.5)))):
            spot = spot + normal * BAY_M[1]
        return float(spot[0]), float(spot[1]), -normal

    def at_mouth(
        self, street: Street, starts: bool, back: float, from_kerb: float, *, left: bool = False
    ) -> tuple[float, float]:
        """A point at the right kerb of arriving traffic, at a distance before the middle of the junction."""
        line = self.network.lines[street.name]
        station = back if starts else paths.length(line) - back
        # Traffic that arrives at the street's start drives against its direction, so its right kerb is on the left.
        side = 1 if starts != left else -1
        x, y, _ = self.beside(street, side, station, from_kerb)
        return x, y

    def stand(
        self, kind: str, parts: list[Part], x: float, y: float, yaw: float, radius: float, *, high: float
    ) -> bool:
        """Put an object on the sidewalk if there is room; returns whether there was room."""
        has_room = self.ground.takes(x, y) and self.props.is_free(x, y, radius)
        if has_room:
            self.props.put(kind, parts, x, y, KERB_M, yaw, radius_m=radius, high_m=high)
        return has_room
