"""The motorway of harbour: cross-section, lanes, paving, paint, median, guard rails and the overbridge's underside."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from shapely.geometry import Polygon, box  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]

from authoring.kit.parts import Sink
from authoring.towns import paths, solids
from authoring.towns.lanes import Lane
from authoring.towns.markings import LABEL, LIFT_M, WHITE
from authoring.towns.network import Network, Street
from authoring.towns.regions import BRIDGE_SIDEWALK_M, KERB_M, OUTER_M
from authoring.towns.wear import Carriageway, wear

Array = npt.NDArray[np.float64]
MEDIAN_HALF_M = 2.0
INNER_SHOULDER_M = 0.9
LANE_M = 3.6
LANES = 3
HARD_SHOULDER_M = 2.8
EDGE_M = MEDIAN_HALF_M + INNER_SHOULDER_M + LANES * LANE_M + HARD_SHOULDER_M
SPEED_MPS = (33.3, 30.6, 25.0)
CHANGE_M = 50.0
# Where slips meet the motorway; between them all three lanes are driven, beyond them the outer one ends in hatching.
SLIP_JOIN_M = 162.0
HATCH_M = 60.0
SLOPE = 1.7
PIERS_M = (-5.6, 0.0, 5.6)


def lane_y(index: int, side: int) -> float:
    """y of a lane's middle, 0 next to the median; side -1 is the carriageway that leads east."""
    return side * (MEDIAN_HALF_M + INNER_SHOULDER_M + (index + 0.5) * LANE_M)


def slip_y(side: int) -> float:
    """y of the lane that slips lead into and out of."""
    return lane_y(LANES - 1, side)


def motorway_lanes(lanes: Mapping[str, Lane]) -> dict[str, Lane]:
    """The lanes of both carriageways, joined to the slips' lanes, which are given among the others."""
    result = dict(lanes)
    for name, side in (("east", -1), ("west", 1)):
        result |= _carriageway(name, side)
        on, off = ("on_south_f0", "off_south_b0") if side < 0 else ("on_north_f0", "off_north_b0")
        result[on] = replace(result[on], following=(f"{name}_2a", f"{name}_up21"))
        for last in (f"{name}_2c", f"{name}_down12"):
            result[last] = replace(result[last], following=(off,))
    return result


def _carriageway(name: str, side: int) -> dict[str, Lane]:
    """Three lanes between on-slip and off-slip; the inner ones begin and end in lane changes."""
    first, second, third = SLIP_JOIN_M, SLIP_JOIN_M - CHANGE_M, SLIP_JOIN_M - 2 * CHANGE_M
    # name, from index and x, to index and x, followers, and neighbours of the same stretch
    rows: list[tuple[str, int, float, int, float, tuple[str, ...]]] = [
        ("2a", 2, -first, 2, -second, ("2b",)),
        ("up21", 2, -first, 1, -second, ("1a", "up10")),
        ("1a", 1, -second, 1, -third, ("1b",)),
        ("up10", 1, -second, 0, -third, ("0b",)),
        ("0b", 0, -third, 0, third, ("down01",)),
        ("1b", 1, -third, 1, third, ("1c",)),
        ("2b", 2, -second, 2, second, ("2c",)),
        ("down01", 0, third, 1, second, ("down12",)),
        ("1c", 1, third, 1, second, ("down12",)),
        ("down12", 1, second, 2, first, ()),
        ("2c", 2, second, 2, first, ()),
    ]
    neighbours = {"0b": ("", "1b"), "1b": ("0b", "")}
    found = {}
    for short, i, x0, j, x1, following in rows:
        a, b = (np.array([-side * x, lane_y(k, side)]) for x, k in ((x0, i), (x1, j)))
        heading = np.array([-float(side), 0.0])
        plan = np.stack([a, b]) if i == j else paths.blend(a, heading, b, heading)
        left, right = (f"{name}_{n}" if n else "" for n in neighbours.get(short, ("", "")))
        found[f"{name}_{short}"] = Lane(
            name=f"{name}_{short}",
            width_m=LANE_M,
            speed_mps=min(SPEED_MPS[i], SPEED_MPS[j]),
            points=np.round(np.column_stack([plan, np.zeros(len(plan))]), 3),
            following=tuple(f"{name}_{n}" for n in following),
            left=left,
            right=right,
        )
    return found


def paved() -> Polygon:
    """Both carriageways and their shoulders without the median, as far as the town is drawn."""
    return box(-OUTER_M, -EDGE_M, OUTER_M, EDGE_M)


def median() -> Polygon:
    """The strip between the carriageways."""
    return box(-OUTER_M, -MEDIAN_HALF_M, OUTER_M, MEDIAN_HALF_M)


def embankments(network: Network) -> BaseGeometry:
    """The ground under the grass slopes on both sides of the overbridge's ramps."""
    line, z = ramp_profile(network, network.streets["bridge"])
    reach = SLOPE * np.maximum(z, 0) + 0.02
    half = network.streets["bridge"].profile.half_width_m + BRIDGE_SIDEWALK_M
    sides = [np.stack([line[:, 0] + s * (half + reach), line[:, 1]], 1) for s in (-1, 1)]
    whole = Polygon(np.concatenate([sides[0], sides[1][::-1]]))
    abutment = network.streets["bridge"].deck_half_m - 0.5
    return whole.difference(box(-80, -abutment, 80, abutment))


def ramp_profile(network: Network, street: Street) -> tuple[Array, Array]:
    """Line (N, 2) and heights (N,) of a bridge from foot to foot."""
    start, end = network.ramp(street.name)
    line = paths.densified(paths.cut(network.lines[street.name], start, end), 4.0)
    return line, network.height_m(street.name, paths.stations(line) + start)


def lay_motorway(sink: Sink, level_roads: BaseGeometry, *, rng: np.random.Generator) -> None:
    """Asphalt and its wear, median, kerbs and paint of the motorway."""
    solids.flat(sink, paved().difference(median()).difference(level_roads), 0.0, "asphalt", "road")
    wear(sink, _carriageways(), rng=rng)
    solids.flat(sink, median(), KERB_M, "roof_gravel", "terrain", cell_m=110.0)
    for side in (1, -1):
        edge = np.array([(-OUTER_M, side * MEDIAN_HALF_M), (OUTER_M, side * MEDIAN_HALF_M)])
        rim = paths.densified(edge if side < 0 else edge[::-1], 110.0)
        solids.wall(sink, rim, 0.0, KERB_M, "kerb", "road")
        _paint(sink, side)


def _carriageways() -> Carriageway:
    """Both of them as one road, a little above the slips that lead into it."""
    return Carriageway(
        line=np.array([(-OUTER_M, 0.0), (OUTER_M, 0.0)]),
        span=(0.0, 2 * OUTER_M),
        lanes=tuple(lane_y(index, side) for side in (1, -1) for index in range(LANES)),
        lane_m=LANE_M,
        half_m=EDGE_M,
        height_m=np.zeros_like,
        lift_m=0.0004,
    )


def _stripe(sink: Sink, x0: float, x1: float, y: float, width_m: float) -> None:
    half = width_m / 2
    corners = [(x0, y - half, LIFT_M), (x1, y - half, LIFT_M), (x1, y + half, LIFT_M), (x0, y + half, LIFT_M)]
    sink.polygon(WHITE, corners, np.asarray(corners)[:, :2] / 2.0, label=LABEL)


def _paint(sink: Sink, side: int) -> None:
    inner = side * (MEDIAN_HALF_M + INNER_SHOULDER_M - 0.1)
    outer = side * (EDGE_M - HARD_SHOULDER_M + 0.15)
    third = side * (MEDIAN_HALF_M + INNER_SHOULDER_M + 2 * LANE_M)
    for x in np.arange(-OUTER_M, OUTER_M, 60.0):
        _stripe(sink, x, x + 60.0, inner, 0.2)
    for x in np.arange(-OUTER_M, OUTER_M, 18.0):
        _stripe(sink, x, x + 6.0, side * (MEDIAN_HALF_M + INNER_SHOULDER_M + LANE_M), 0.15)
        if abs(x + 3) < SLIP_JOIN_M:
            _stripe(sink, x, x + 6.0, third, 0.3)
        else:
            _stripe(sink, x, x + 18.0, third + side * 0.1, 0.2)
    slip = SLIP_JOIN_M + 30.0
    for x0, x1 in ((-OUTER_M, -slip), (-SLIP_JOIN_M, SLIP_JOIN_M), (slip, OUTER_M)):
        _stripe(sink, x0, x1, outer, 0.25)
    for end in (-1, 1):
        for step in np.arange(4.0, HATCH_M, 4.0):
            x, y0, y1 = end * (SLIP_JOIN_M + step), third + side * 0.5, side * (EDGE_M - HARD_SHOULDER_M - 0.4)
            lean = end * 2.6
            corners = np.array([(x, y0), (x + 0.8, y0), (x + 0.8 + lean, y1), (x + lean, y1)])
            if side < 0:
                corners = corners[::-1]
            sink.polygon(WHITE, np.column_stack([corners, np.full(4, LIFT_M)]), corners / 2.0, label=LABEL)


def finish_bridge(sink: Sink, network: Network) -> None:
    """What a car under the overbridge sees: soffit, girders, piers, abutments; and the ramps' grass slopes."""
    street = network.streets["bridge"]
    half = street.profile.half_width_m + BRIDGE_SIDEWALK_M
    reach, top = street.deck_half_m + 1.5, float(street.hump_m)
    low = top - 0.8
    middle = np.array([(0.0, -reach), (0.0, reach)])
    solids.sweep(sink, middle, low, [(half, 0.0), (-half, 0.0)], "concrete", "bridge")
    for x in np.linspace(-half + 1.2, half - 1.2, 5):
        _block(sink, (x - 0.3, -reach, low - 0.5), (x + 0.3, reach, low))
    for y in (-EDGE_M - 1.6, 0.0, EDGE_M + 1.6):
        _block(sink, (-half + 0.6, y - 0.5, low - 1.2), (half - 0.6, y + 0.5, low - 0.5))
        for x in PIERS_M:
            _block(sink, (x - 0.45, y - 0.4, 0.0), (x + 0.45, y + 0.4, low - 1.2))
    line, z = ramp_profile(network, street)
    for side in (1, -1):
        ramp = line[:, 1] * side >= street.deck_half_m - 0.5
        abutment = side * float(np.abs(line[ramp, 1]).min())
        wall = np.array([(-half, abutment), (half, abutment)])
        solids.wall(sink, wall if side > 0 else wall[::-1], 0.0, top, "concrete", "bridge")
        bank = box(-half, min(side * EDGE_M, abutment), half, max(side * EDGE_M, abutment))
        solids.flat(sink, bank, KERB_M, "cobbles", "ground")
        for sign in (1, -1):
            _slope(sink, line[ramp], z[ramp], sign, half, foot=0 if side > 0 else -1)


def _slope(sink: Sink, line: Array, z: Array, sign: int, half: float, *, foot: int) -> None:
    """The grass beside a ramp, and the wing wall where it ends at the abutment; `foot` is the point that is there."""
    outer = line[:, 0] + sign * (half + SLOPE * np.maximum(z, 0))
    lower = np.column_stack([outer, line[:, 1], np.full(len(line), KERB_M)])
    rim = np.where(z > KERB_M, z - 0.1, KERB_M)
    upper = np.column_stack([line[:, 0] + sign * (half + 0.01), line[:, 1], rim])
    left, right = (lower, upper) if sign < 0 else (upper, lower)
    solids.ribbon(sink, left, right, "grass", "terrain")
    wing = np.array([upper[foot], lower[foot], [*upper[foot][:2], KERB_M]])
    if (sign > 0) == (foot == 0):
        wing = wing[::-1]
    sink.polygon("concrete", wing, wing[:, [0, 2]] / 4.0, label="bridge")


def _block(sink: Sink, low: tuple[float, float, float], high: tuple[float, float, float]) -> None:
    sink.tiled_box("concrete", low, high, tile_m=4.0, label="bridge")
