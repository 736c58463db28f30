"""Harbour's surroundings: quay and water with cranes, fields with hedges and pylons, sheds, a town, hills."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from shapely.geometry import Point, box  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]

from authoring import kit
from authoring.kit.buildings import STYLES
from authoring.kit.industry import shed, warehouse
from authoring.kit.industry_plant import chimney, pylon, quay_crane, silos, wires
from authoring.kit.industry_yard import container_stack
from authoring.kit.parts import Part, Sink, place
from authoring.towns import solids
from authoring.towns.furniture import Furnisher
from authoring.towns.harbour_motorway import EDGE_M, MEDIAN_HALF_M
from authoring.towns.props import Props
from authoring.towns.regions import KERB_M, OUTER_M
from authoring.towns.skyline import FIELD_Z_M, build_hills

FAR_M = 720.0
QUAY = box(-OUTER_M, -288.0, OUTER_M, -240.0)
# Hedges along the estate's roads: y, from x to x; each has a gate in its middle.
FRONTS = (
    (-130.3, -137.0, -28.0),
    (-150.6, -120.0, -28.0),
    (-130.3, 28.0, 102.0),
    (131.6, -132.0, -28.0),
    (151.3, -110.0, -16.0),
)
PARK_TREES = (
    (-131, 58),
    (-131, 72),
    (-131, 90),
    (-81, 58),
    (-81, 90),
    (-81, 100),
    (-104, 78),
    (-116, 78),
    (-92, 110),
    (-104, 112),
)
WATER = box(-FAR_M, -FAR_M, FAR_M, -288.0)
PYLONS = ((250.0, 60.0), (236.0, 190.0), (172.0, 236.0), (40.0, 300.0), (-90.0, 330.0), (-230.0, 372.0))


def build_surroundings(sink: Sink, *, rng: np.random.Generator) -> None:
    """Everything outside the bounds of the town."""
    beyond = box(-FAR_M, -FAR_M, FAR_M, FAR_M).difference(box(-OUTER_M, -OUTER_M, OUTER_M, OUTER_M))
    solids.flat(sink, beyond.difference(WATER), FIELD_Z_M, "grass", "terrain", cell_m=FAR_M)
    for side in (1, -1):
        for x in ((OUTER_M, FAR_M), (-FAR_M, -OUTER_M)):
            low, high = sorted((side * MEDIAN_HALF_M, side * EDGE_M))
            solids.flat(sink, box(x[0], low, x[1], high), -0.04, "asphalt", "road", cell_m=FAR_M)
    solids.flat(sink, QUAY, KERB_M, "concrete", "ground")
    solids.flat(sink, WATER, KERB_M - 0.05, "water", "ground", cell_m=FAR_M)
    build_hills(sink)
    _quay(sink, rng=rng)
    _sheds(sink, rng=rng)
    _town(sink, rng=rng)
    _pylons(sink)


def plant_fields(
    props: Props, furnisher: Furnisher, taken: BaseGeometry, hedge: list[Part], *, rng: np.random.Generator
) -> None:
    """Hedgerows and simple trees on the open land around the estate, hedges before the yards, trees in car parks."""
    for y, x0, x1 in FRONTS:
        for x in np.arange(x0 + 7.0, x1 - 6.0, 14.3):
            if abs(x - (x0 + x1) / 2) > 11.0:
                props.instance("hedge", hedge, float(x), y, KERB_M, 0.0, radius_m=0.7, high_m=1.2)
    for index, (x, y) in enumerate(PARK_TREES):
        furnisher.plant(x, y, KERB_M, kind=index, always=True)
    rows = [(x, y, yaw) for y in (182.0, 228.0) for x in np.arange(24.0, 120.0, 14.3) for yaw in (0.0,)]
    rows += [(x, y, np.pi / 2) for x in (248.0, -248.0) for y in np.arange(-110.0, 120.0, 14.3)]
    for x, y, yaw in rows:
        if abs(y) > 34 and not taken.intersects(Point(x, y).buffer(5.0)):
            props.instance("hedge", hedge, float(x), float(y), KERB_M, float(yaw), radius_m=0.8, high_m=1.7)
    for _ in range(170):
        x, y = (float(v) for v in rng.uniform((-410, -236), (410, 410)))
        if taken.intersects(Point(x, y).buffer(5.0)) or not props.is_free(x, y, 4.0):
            continue
        inside = abs(x) < 240 and abs(y) < 235
        if rng.random() < (0.5 if inside else 0.75):
            furnisher.plant(x, y, KERB_M, kind=int(rng.integers(6)), always=True, simple=True)


def _quay(sink: Sink, *, rng: np.random.Generator) -> None:
    for x, swatch, raised in ((-30.0, "signal_blue", False), (62.0, "signal_red", True), (128.0, "signal_blue", False),
                              (210.0, "signal_blue", True), (-260.0, "orange", False)):  # fmt: skip
        sink.extend(place(quay_crane(swatch=swatch, raised=raised), x_m=x, y_m=-270.0, z_m=KERB_M))
    for x in np.arange(-380.0, 390.0, 62.0):
        stack = container_stack(3, 3, rng, highest=3)
        sink.extend(place(stack, x_m=float(x), y_m=-248.0, z_m=KERB_M))
    ship = Sink("static")
    hull = [(-95.0, -8.0), (80.0, -8.0), (97.0, 0.0), (80.0, 8.0), (-95.0, 8.0)]
    for a, b in zip(hull, hull[1:] + hull[:1], strict=True):
        for z0, z1, swatch in ((0.0, 2.0, "dark_red"), (2.0, 11.0, "dark_blue")):
            ship.swatch_quad(swatch, [(*a, z0), (*b, z0), (*b, z1), (*a, z1)])
    ship.swatch_mesh(
        "grey_paint", [(*p, 10.5) for p in hull], [(0, 1, 4), (1, 3, 4), (1, 2, 3)], np.tile((0, 0, 1.0), (5, 1))
    )
    ship.swatch_box("white_paint", (-86.0, -7.5, 10.0), (-72.0, 7.5, 33.0))
    ship.swatch_box("dark_glass", (-71.95, -7.0, 29.5), (-71.9, 7.0, 31.5))
    for column in range(9):
        boxes = place(container_stack(5, 1, rng, highest=5), x_m=-56.0 + column * 14.0, z_m=10.0)
        ship.extend(boxes)
    sink.extend(place(ship.parts(), x_m=60.0, y_m=-302.0, z_m=KERB_M))


def _sheds(sink: Sink, *, rng: np.random.Generator) -> None:
    """More industry along the motorway."""
    for x, y, yaw in (
        (-320, -74, np.pi),
        (-330, 84, 0.0),
        (322, 76, 0.0),
        (330, -80, np.pi),
        (-320, 170, 0.0),
        (320, -190, 0.0),
    ):
        wide = float(rng.uniform(60, 95))
        cladding = str(rng.choice(["cladding_white", "cladding_blue", "metal_panel", "cladding_green"]))
        parts = warehouse(wide, 36.0, float(rng.uniform(9, 14)), rng, cladding=cladding)
        sink.extend(place(parts, x_m=x, y_m=y, z_m=KERB_M, yaw_rad=yaw))
    for x, y in ((300, 200), (-300, -200), (372, -130), (-372, 40)):
        sink.extend(place(shed(40, 24, 8, rng), x_m=x, y_m=y, z_m=KERB_M, yaw_rad=float(rng.uniform(0, 3))))
    for x, y, high in ((380, -170, 90), (-390, -150, 75), (405, -150, 90), (-360, 250, 60)):
        sink.extend(place(chimney(high), x_m=x, y_m=y, z_m=KERB_M))
    sink.extend(place(silos(6, radius_m=4.5, height_m=30), x_m=-355, y_m=-215, z_m=KERB_M))


def _town(sink: Sink, *, rng: np.random.Generator) -> None:
    """A town's silhouette beyond the fields, and houses across them."""
    for _ in range(120):
        angle, away = float(rng.uniform(-0.35, np.pi + 0.25)), float(rng.uniform(430, 660))
        x, y = away * np.cos(angle), away * np.sin(angle)
        wide, deep, draw = rng.uniform(18, 44), rng.uniform(14, 26), float(rng.random())
        style, seed, yaw = str(rng.choice(STYLES)), int(rng.integers(1 << 30)), float(rng.uniform(0, np.pi))
        if abs(y) < 45 or (abs(x) < OUTER_M + 30 and abs(y) < OUTER_M + 30):
            continue
        centre = float(np.exp(-(((angle - 1.1) / 0.35) ** 2)))
        floors = int(np.clip(2 + (3 + 16 * centre) * draw**1.4, 2, 20))
        parts = kit.building(style=style, width_m=round(float(wide), 1), depth_m=round(float(deep), 1), floors=floors,
                             rng=np.random.default_rng(seed), lod="far")  # fmt: skip
        sink.extend(place(parts, x_m=float(x), y_m=float(y), z_m=FIELD_Z_M, yaw_rad=yaw))


def _pylons(sink: Sink) -> None:
    parts = pylon()
    spans, tips = [], []
    for index, (x, y) in enumerate(PYLONS):
        near = np.array(PYLONS[max(index - 1, 0)]), np.array(PYLONS[min(index + 1, len(PYLONS) - 1)])
        along = near[1] - near[0]
        yaw = float(np.arctan2(along[1], along[0]) - np.pi / 2)
        sink.extend(place(parts, x_m=x, y_m=y, z_m=KERB_M, yaw_rad=yaw))
        across = np.array([np.cos(yaw), np.sin(yaw)])
        tips.append([np.array([*(np.array([x, y]) + across * reach * side), z * 34.0 - 1.6])
                     for z, reach in ((0.66, 6.5), (0.8, 7.5), (0.93, 5.0)) for side in (-1, 1)])  # fmt: skip
    for first, second in pairwise(tips):
        spans += list(zip(first, second, strict=True))
    sink.extend(wires(spans))
