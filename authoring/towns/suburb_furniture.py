"""Street furniture of the suburb: less of it than in town10, and priority signs only on arms that give way."""

from __future__ import annotations

import numpy as np
from shapely.geometry import Point  # type: ignore[import-untyped]

from authoring import kit
from authoring.towns import paths, signage, suburb
from authoring.towns.furniture import FAR_M, Furnisher
from authoring.towns.network import Street
from authoring.towns.props import Ground, Props
from authoring.towns.regions import KERB_M, Regions
from authoring.towns.suburb_streets import gives_way

SPECIES = (("broad", 8.0), ("street", 6.5), ("linden", 8.5), ("columnar", 8.0), ("conifer", 7.5))
# The first few keep their branches out of the road.
STREET_SPECIES = 4
FAR_SPECIES = (("broad", 8.0), ("linden", 7.0), ("street", 5.5), ("conifer", 8.0))
LAMP_M = 34.0
EXTRAS = ("bench", "cable_box", "bin", "letter_box") + ("none",) * 22


class SuburbFurnisher(Furnisher):
    """Furnishes residential streets."""

    def __init__(self, props: Props, regions: Regions, ground: Ground, *, rng: np.random.Generator) -> None:
        super().__init__(props, regions, ground, rng=rng)
        tree_rng = np.random.default_rng([88, 1])
        self.trees = [kit.tree(species, height, tree_rng) for species, height in SPECIES]
        self.far_trees = [kit.tree(species, height, tree_rng, lod="far") for species, height in FAR_SPECIES]

    def plant(self, x: float, y: float, z: float, *, kind: int, always: bool = False, simple: bool = False) -> None:
        """A tree, if there is room; simple ones stand wherever gardens want them."""
        if not simple and max(abs(x), abs(y)) < FAR_M:
            super().plant(x, y, z, kind=kind, always=always)
        elif not self.ground.views.contains(Point(x, y)):
            # Merged, a tree costs no geom; shared, it costs no triangles: the town has room for some of both.
            index = kind % len(self.far_trees)
            put = self.props.instance if index == 0 else self.props.put
            yaw = float(self.rng.uniform(0, 2 * np.pi))
            put(f"tree_far{index}", self.far_trees[index], x, y, z, yaw, radius_m=0.3, high_m=4.0)

    def signs(self, street: Street) -> None:
        """Signs along a street, which warn of children here."""
        if street.profile.one_way:
            return
        start, end = self.network.span(street.name)
        signage.signs_along(self, street, last_m=end if street.end else min(end, start + 90.0), slow=True)
        signage.chevrons(self, street)

    def node(self, name: str) -> None:
        """Signals, or signs on arms that give way, and lights before the roundabout."""
        node = self.network.nodes[name]
        for arm, starts, _ in self.network.arms(name):
            if (name, arm) in suburb.LIGHTS:
                station = self.network.mouths[arm, starts] + 1.0
                total = paths.length(self.network.lines[arm])
                station = station if starts else total - station
                signage.light(self, self.network.streets[arm], station, forward=not starts, lit="green")
        if node.control == "signals":
            super().node(name)
            return
        for arm, starts, away in self.network.arms(name):
            street = self.network.streets[arm]
            if street.end is None or street.profile.one_way:
                continue
            mouth = self.network.mouths[arm, starts]
            yaw = float(np.arctan2(-away[1], -away[0]) - np.pi / 2)
            if gives_way(self.network, name, arm):
                x, y = self.at_mouth(street, starts, mouth - 0.2, 0.65)
                sign = "stop" if node.control == "stop" else "yield"
                self.stand(f"sign_{sign}", kit.traffic_sign(sign), x, y, yaw, 0.08, high=2.9)
            if node.control == "stop":
                x, y = self.at_mouth(street, starts, mouth + 1.2, 0.65)
                self.stand("sign_crossing", kit.traffic_sign("crossing"), x, y, yaw, 0.08, high=2.8)
            if np.hypot(*node.position) < suburb.CIRCUS_M + 1:
                x, y = self.at_mouth(street, starts, mouth + 9.0, 0.65)
                self.stand("sign_roundabout", kit.traffic_sign("roundabout"), x, y, yaw, 0.08, high=2.8)
            else:
                x, y = self.at_mouth(street, starts, mouth + 13.0, 0.65, left=True)
                sign = str(self.rng.choice(["speed_30", "warning_children", "no_parking", "speed_30"]))
                self.stand(f"sign_{sign}", kit.traffic_sign(sign), x, y, yaw + np.pi, 0.08, high=2.8)
        self._street_name(name)
        signage.heads(self, name)

    def _street_name(self, name: str) -> None:
        arm, starts, away = self.network.arms(name)[0]
        x, y = self.at_mouth(self.network.streets[arm], starts, self.network.mouths[arm, starts] + 2.2, 0.65, left=True)
        yaw = float(np.arctan2(away[1], away[0]))
        self.stand("street_name", kit.street_name_sign(), x, y, yaw, 0.08, high=3.0)

    def _lamps(self, street: Street, side: int, start: float, end: float) -> None:
        parts = kit.street_lamp(height_m=6.2, arm_m=1.1)
        first = start + 6 + (LAMP_M if side < 0 else 0)
        for station in np.arange(first, min(end, start + 150.0) - 2, 2 * LAMP_M):
            self.lamp("lamp_modern", parts, street, side, float(station))

    def _trees(self, street: Street, side: int, start: float, end: float) -> None:
        kind = sum(map(ord, street.name)) % STREET_SPECIES
        for station in np.arange(start + (0 if side > 0 else street.trees_m / 2), end, street.trees_m):
            if signage.hides_lights(self.network, street.name, side, float(station)):
                continue
            x, y, _ = self.beside(street, side, float(station), 0.85)
            other = int(self.rng.integers(STREET_SPECIES))
            self.plant(x, y, KERB_M, kind=kind if self.rng.random() < 0.7 else other)

    def _meters(self, street: Street) -> None:
        if street.name == "east_1":
            super()._meters(street)

    def _extras(self, street: Street, side: int, start: float, end: float) -> None:
        for station in np.arange(start + float(self.rng.uniform(0, 5)), end, 7.5):
            kind = str(self.rng.choice(EXTRAS))
            x, y, toward = self.beside(street, side, float(station), 0.8)
            yaw = float(np.arctan2(toward[1], toward[0]) + np.pi / 2)
            if kind == "bench":
                self.stand("bench", kit.bench(style="wood"), x, y, yaw + np.pi, 0.9, high=0.8)
            elif kind == "letter_box":
                self.stand("letter_box", kit.letter_box(colour="signal_red"), x, y, yaw + np.pi, 0.35, high=1.2)
            elif kind == "cable_box":
                self.stand("cable_box", kit.cable_box(), x, y, yaw + np.pi, 0.5, high=1.1)
            elif kind == "bin":
                self.stand("bin", kit.bin_(style="post"), x, y, yaw, 0.3, high=1.0)
