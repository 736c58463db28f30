"""Bridges: a street lifted over the canal on ramps, with sidewalks, guard rails, railings and girders."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from authoring.kit.parts import Sink
from authoring.towns import paths, solids
from authoring.towns.network import Network, Street
from authoring.towns.regions import BRIDGE_SIDEWALK_M, KERB_M

Array = npt.NDArray[np.float64]
STEP_M = 2.0
DECK_M = 0.8
SLAB_M = 0.5


@dataclass(frozen=True, slots=True)
class Slab:
    """A sloped collision box: centre, half sizes, heading and slope (rise over run along the heading)."""

    name: str
    centre: tuple[float, float, float]
    half: tuple[float, float, float]
    yaw_rad: float
    slope: float


def build_bridge(sink: Sink, network: Network, street: Street) -> None:
    """Build the visible parts of one bridge, from the foot of one ramp to the foot of the other."""
    line, z = _profile(network, street)
    half = street.profile.half_width_m
    edge = half + BRIDGE_SIDEWALK_M
    solids.sweep(sink, line, z, [(-half, 0.0), (half, 0.0)], "asphalt", "road")
    for sign in (1, -1):
        kerb = [(sign * half, 0.0), (sign * half, KERB_M)]
        walk = [(sign * (half + 0.18), KERB_M), (sign * (edge - 0.3), KERB_M)]
        stone = [(sign * half, KERB_M), (sign * (half + 0.18), KERB_M)]
        parapet = [(sign * (edge - 0.3), KERB_M), (sign * (edge - 0.3), 0.35), (sign * edge, 0.35)]
        for section, material, label in (
            (kerb, "kerb", "sidewalk"),
            (stone, "kerb", "sidewalk"),
            (walk, "pavement", "sidewalk"),
            (parapet, "concrete", "bridge"),
        ):
            solids.sweep(sink, line, z, section if sign > 0 else section[::-1], material, label)
        _side(sink, street, line, z, sign, edge)
        solids.railing(sink, paths.offset(line, sign * (edge - 0.15)), z + 0.35, "dark_green", "fence", top_m=0.85)
        _guard_rail(sink, line, z, sign, half + 0.45)
    if street.profile.median_m:
        middle = street.profile.median_m / 2 - 0.45
        rim = [(-middle, 0.0), (-middle, KERB_M), (-middle + 0.3, KERB_M)]
        solids.sweep(sink, line, z, rim, "kerb", "sidewalk")
        solids.sweep(sink, line, z, [(-middle + 0.3, KERB_M), (middle - 0.3, KERB_M)], "cobbles", "sidewalk")
        solids.sweep(sink, line, z, [(middle - 0.3, KERB_M), (middle, KERB_M), (middle, 0.0)], "kerb", "sidewalk")


def slabs(network: Network, street: Street) -> Iterator[Slab]:
    """Collision boxes of a bridge, which carry cars and people."""
    line, z = _profile(network, street)
    half = street.profile.half_width_m
    strips = [("road", 0.0, half, 0.0)]
    for side, sign in (("left", 1), ("right", -1)):
        strips.append((f"sidewalk_{side}", sign * (half + BRIDGE_SIDEWALK_M / 2), BRIDGE_SIDEWALK_M / 2, KERB_M))
    if street.profile.median_m:
        strips.append(("median", 0.0, street.profile.median_m / 2 - 0.45, KERB_M))
    for kind, left, width, lift in strips:
        for index in range(len(line) - 1):
            ends = paths.offset(line, left)[index : index + 2]
            run = float(np.linalg.norm(ends[1] - ends[0]))
            slope = float(z[index + 1] - z[index]) / run
            top = float(z[index] + z[index + 1]) / 2 + lift
            down = np.array([*(ends[1] - ends[0]) / run * slope, -1.0]) / np.hypot(slope, 1)
            centre = np.array([*ends.mean(0), top]) + down * SLAB_M / 2
            yaw = float(np.arctan2(*(ends[1] - ends[0])[::-1]))
            yield Slab(
                f"ground.{street.name}_{kind}_{index}",
                (float(centre[0]), float(centre[1]), float(centre[2])),
                (run / 2 * float(np.hypot(slope, 1)), width, SLAB_M / 2),
                yaw,
                slope,
            )


def _profile(network: Network, street: Street) -> tuple[Array, Array]:
    start, end = network.ramp(street.name)
    line = paths.densified(paths.cut(network.lines[street.name], start, end), STEP_M)
    return line, network.height_m(street.name, paths.stations(line) + start)


def _side(sink: Sink, street: Street, line: Array, z: Array, sign: int, edge: float) -> None:
    """Walls of the ramps down to the ground, girders over the water."""
    along = paths.stations(line)
    over = (along > street.ramp_m - 1.5) & (along < street.ramp_m + 2 * street.deck_half_m + 1.5)
    foot = np.where(over, z + 0.35 - DECK_M - 0.35, -0.05)
    rim = paths.offset(line, sign * edge)
    if sign > 0:
        solids.wall(sink, rim[::-1], foot[::-1], z[::-1] + 0.35, "concrete", "bridge")
    else:
        solids.wall(sink, rim, foot, z + 0.35, "concrete", "bridge")
    for pick in (np.flatnonzero(over)[0], np.flatnonzero(over)[-1], len(line) // 2):
        x, y = paths.offset(line, sign * (edge + 0.12))[pick]
        top = float(z[pick])
        low, high = (x - 0.35, y - 0.45, -1.9), (x + 0.35, y + 0.45, top + 1.5)
        if pick != len(line) // 2:
            sink.tiled_box("ashlar", low, high, tile_m=3.0, skip="z", label="bridge")


def _guard_rail(sink: Sink, line: Array, z: Array, sign: int, left: float) -> None:
    rail = paths.offset(line, sign * left)
    beam = [(0.02, 0.42), (-0.03, 0.48), (0.03, 0.56), (-0.03, 0.64), (0.02, 0.72)]
    both = [(0.05, 0.72), (0.05, 0.42)]
    face = beam if sign < 0 else [(-o, h) for o, h in beam]
    for section in (face, face[::-1], both):
        solids.sweep(sink, rail, z + KERB_M, section, "palette", "guard_rail", swatch="galvanised")
    for index in range(0, len(rail), 2):
        x, y = rail[index]
        low, high = (x - 0.05, y - 0.05, z[index] + KERB_M), (x + 0.05, y + 0.05, z[index] + KERB_M + 0.7)
        sink.swatch_box("galvanised", low, high, skip="z", label="guard_rail")
