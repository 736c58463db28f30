"""What stands along harbour's motorway and slips: guard rails, noise walls, lamps, gantries, hedges and trees."""

from __future__ import annotations

import numpy as np
from shapely.geometry import Point  # type: ignore[import-untyped]

from authoring import kit
from authoring.kit.industry_yard import direction_sign, gantry, noise_wall
from authoring.kit.parts import Part, place
from authoring.towns import paths
from authoring.towns.collision import Solid
from authoring.towns.furniture import Furnisher
from authoring.towns.harbour_motorway import EDGE_M
from authoring.towns.props import Props
from authoring.towns.regions import KERB_M, Regions

REACH_M = 300.0
RAIL_M = 20.0
# Where slips cross the edge of the motorway, by |x|: no rail there.
SLIP_GAP_M = (176.0, 220.0)
NOISE_WALLS = ((-1, -160.0, -60.0), (1, 80.0, 160.0), (-1, 236.0, 300.0), (1, -300.0, -236.0))
NOISE_WALL_Y_M = EDGE_M + 4.6
LAMP_M = 38.0


def furnish_motorway(
    props: Props, regions: Regions, furnisher: Furnisher, hedge: list[Part], *, rng: np.random.Generator
) -> None:
    """Everything along the motorway."""
    _rails(props)
    for side, x0, x1 in NOISE_WALLS:
        for x in np.arange(x0 + 10.0, x1, 20.0):
            _run(props, noise_wall(20.0), float(x), side * NOISE_WALL_Y_M, 0.0, 20.0, 3.6)
    mast = kit.street_lamp(height_m=11.0, arm_m=2.6, style="double")
    for x in np.arange(-REACH_M + 8, REACH_M, LAMP_M):
        props.put("mast", mast, float(x), 0.0, KERB_M, 0.0, radius_m=0.2, high_m=10.0)
    span = EDGE_M + 1.4
    for x, side, panels in ((-118.0, -1, (0, 2)), (118.0, 1, (1, 3)), (205.0, -1, (1,)), (-205.0, 1, (2,))):
        parts = gantry(span, panels)
        props.sink.extend(place(parts, x_m=x, y_m=side * span, z_m=0.0, yaw_rad=0.0 if side < 0 else np.pi))
        for y in (0.0, side * span):
            props.solids.append(Solid(f"gantry_{x:.0f}_{y:.0f}", "box", (x, y, 3.5), (0.7, 0.3, 3.5)))
    for x, y, yaw, panel in ((-222.5, -96.0, -np.pi / 2, 3), (222.5, 96.0, np.pi / 2, 1), (-40.0, 130.5, 0.0, 2)):
        props.put("direction", direction_sign(panel, width_m=3.6), x, y, KERB_M, yaw + np.pi, radius_m=1.2, high_m=4.0)
    _slips(props, regions)
    _planting(props, regions, furnisher, hedge, rng=rng)


def _rails(props: Props) -> None:
    rail = kit.guard_rail(RAIL_M)
    for x in np.arange(-REACH_M + RAIL_M / 2, REACH_M, RAIL_M):
        for side in (1, -1):
            _run(props, rail, float(x), side * 0.75, 0.0 if side < 0 else np.pi, RAIL_M, 0.75)
            reach = abs(x) + RAIL_M / 2, abs(x) - RAIL_M / 2
            if reach[0] > SLIP_GAP_M[0] and reach[1] < SLIP_GAP_M[1]:
                continue
            _run(props, rail, float(x), side * (EDGE_M + 0.5), np.pi if side < 0 else 0.0, RAIL_M, 0.75)


def _slips(props: Props, regions: Regions) -> None:
    """Lamps along the slips, chevrons on the outside of their bends."""
    lamp = kit.street_lamp(height_m=9.0)
    for name, line in regions.network.lines.items():
        if not regions.network.streets[name].joins:
            continue
        total = paths.length(line)
        for station in np.arange(24.0, total - 34.0, 30.0):
            point, along = paths.at(line, float(station))
            x, y = point + np.array([-along[1], along[0]]) * (4.6 if name.startswith("off_") else -4.6)
            side = np.pi if name.startswith("off_") else 0.0
            yaw = float(np.arctan2(along[1], along[0])) + np.pi + side
            props.put("slip_lamp", lamp, float(x), float(y), KERB_M, yaw, radius_m=0.15, high_m=6.0)
        for back in (30.0, 44.0, 58.0, 72.0):
            point, along = paths.at(line, total - back)
            left = 1.0 if name.startswith("on_") else -1.0
            x, y = point + left * np.array([-along[1], along[0]]) * 4.0
            heading = along if name.startswith("on_") else -along
            if abs(y) > EDGE_M + 1.5:
                yaw = float(np.arctan2(heading[1], heading[0]) - np.pi / 2)
                parts = kit.traffic_sign("chevron", post_m=0.8)
                props.put("chevron", parts, float(x), float(y), KERB_M, yaw, radius_m=0.1, high_m=1.5)


def _planting(
    props: Props, regions: Regions, furnisher: Furnisher, hedge: list[Part], *, rng: np.random.Generator
) -> None:
    """Clumps of trees, shrubs and hedges behind the rails, thicker behind the noise walls."""
    shrubs = [kit.shrub(float(h), rng, foliage=leaf) for h, leaf in
              ((1.2, "foliage_green"), (1.8, "foliage_olive"), (2.3, "foliage_dark"))]  # fmt: skip
    walls = [(side, x0 - 8, x1 + 8) for side, x0, x1 in NOISE_WALLS]
    clear = furnisher.ground.views.buffer(2.5)
    for side in (1, -1):
        for x in np.arange(-330.0, 331.0, 9.6):
            behind = any(side == s and x0 < x < x1 for s, x0, x1 in walls)
            y = side * (EDGE_M + (8.2 if behind else 6.5) + float(rng.uniform(-1.2, 3.0)))
            spot = Point(x, y)
            draw, kind = rng.random(), int(rng.integers(6))
            clump = np.sin(x / 19.0 + 2.0 * side) + np.sin(x / 41.0) > -0.3
            if abs(x) < 26 or regions.carriageways.distance(spot) < 4.0 or clear.contains(spot):
                continue
            if (behind or clump) and draw < 0.6:
                furnisher.plant(float(x), y, KERB_M, kind=kind, always=True, simple=draw < 0.45 or abs(x) > 200)
            elif draw < 0.72 and abs(x) < 230:
                parts: list[Part] = shrubs[kind % 3]
                props.instance(
                    f"verge_shrub{kind % 3}", parts, float(x), y, KERB_M, draw * 40, radius_m=0.9, high_m=1.5
                )
            elif draw < 0.8 and abs(x) < 230 and props.is_free(float(x), y, 3.0):
                props.instance("hedge", hedge, float(x), y, KERB_M, 0.0, radius_m=0.7, high_m=1.4)


def _run(props: Props, parts: list[Part], x: float, y: float, yaw: float, length_m: float, high_m: float) -> None:
    """Something long that runs along x, with a box that stops."""
    props.sink.extend(place(parts, x_m=x, y_m=y, z_m=KERB_M if abs(y) > EDGE_M or abs(y) < 2 else 0.0, yaw_rad=yaw))
    props.solids.append(
        Solid(f"barrier_{x:.1f}_{y:.1f}", "box", (x, y, KERB_M + high_m / 2), (length_m / 2, 0.1, high_m / 2))
    )
