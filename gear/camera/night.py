"""Lamps at night in linear frames: light on surfaces, computed from depth, and surfaces that emit light.

    L' = L (k + E / A) + G

L is the frame under even light: a surface appears as its albedo times A, where A is the irradiance for its normal. k is
the share of the even light that remains at night, E the irradiance by lamps, and G emitted light. k, E, A and G do not
depend on any albedo. Frames therefore stay linear, and a patch changes only the pixels that show the patch.

Normals are computed from depth. Static objects of the town and the scene's road users cast shadows.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from gear.camera.glow import LampGlare, LitWindows
from gear.camera.lamp_shadows import SHADOWED_WITHIN_M, LampShadow, LampShadows
from gear.camera.lamps import Headlamps, Lamps, headlamps
from gear.camera.lamps_in_view import LampsInView
from gear.camera.light_sources import INSIDE_LIGHT, board_light, bus_interior_light, vehicle_lamp_light
from gear.camera.normals import STRIP_ROWS, Strip, strips_of
from gear.camera.response import DISPLAY_POWER
from gear.contracts.rendering import RawView
from gear.values.frames import LINEAR_FULL_SCALE, FloatImage, GeomTable, IdImage, UInt16Image
from gear.values.geometry import Array
from gear.values.labels import OPEN_GROUND_CODES
from gear.values.rng import derive_rng
from gear.values.scene import CameraRecord, SceneRecord

HalfImage = npt.NDArray[np.float16]

GLARE = {"street": 0.12, "globe": 0.6, "head": 0.03}
"""Factor from the intensity that a lamp sends to the camera to the light at the middle of the lamp's spot, by kind of
lamp.
"""

SIGNAL_GAIN = 0.9
STREAK_SHARE = 0.12
"""Share of the light of a lamp's spot that appears as a streak on wet ground."""

_GRAIN_PX = 128


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class NightLight:
    """The light of lamps in one view of one scene. It does not depend on the patches in the scene.

    Attributes:
        share: (H, W, 3) float16 factor by which the light of the frame under even light is multiplied.
        glow: (H, W, 3) float16 light that is then added, in units of the frame: glare, and surfaces that emit light.
        streaks: (H, W, 3) float16 reflections of lamps on wet ground, in units of the frame; None for dry ground.
    """

    share: HalfImage
    glow: HalfImage
    streaks: HalfImage | None

    def apply(self, linear_rgb: UInt16Image) -> UInt16Image:
        """Converts a frame under even light to night: a new (H, W, 3) uint16 array, rounded with a fixed dither
        pattern.

        Args:
            linear_rgb: (H, W, 3) uint16 frame under even light.
        """
        result = np.empty_like(linear_rgb)
        for rows in _bands(len(linear_rgb)):
            light = self.share[rows].astype(np.float32) * linear_rgb[rows] + self.glow[rows]
            result[rows] = _rounded(light.astype(np.float32, copy=False), rows)
        return result

    def apply_reflections(self, linear_rgb: UInt16Image) -> UInt16Image:
        """Adds the reflections of lamps on wet ground to a frame, as a new array; `linear_rgb` itself if the
        ground is dry.

        Args:
            linear_rgb: (H, W, 3) uint16 frame at night, after `apply`.
        """
        if self.streaks is None:
            return linear_rgb
        result = np.empty_like(linear_rgb)
        for rows in _bands(len(linear_rgb)):
            result[rows] = _rounded(self.streaks[rows].astype(np.float32) + linear_rgb[rows], rows)
        return result


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Night:
    """The lamps of a town in one weather.

    Attributes:
        level, sky_level: shares 0..1 of the light without direct sun (even light) that remain at night, on surfaces and
            in the sky.
        lit: strength of the lamps, 0..1; small at dusk, when lamps are on but look pale.
        even: (3, 3) light of white surfaces without direct sun: rows for surfaces that face up, sideways and down,
            columns for red, green and blue; 1.0 is the frame's full scale.
        lamps: lamps of the town by kind: `street` and `globe`.
        windows: lit windows.
        vehicles: positions of headlamps by asset name.
        wetness: wetness of open ground, 0..1.
        is_signal: (ngeom,) bool: whether a geom is a glass of a traffic light; these already emit light in the frame.
        is_lens: (ngeom,) bool: whether a geom is a glass of a vehicle's lamp.
        is_pane: (ngeom,) bool: whether a geom is a window of a bus.
        is_display: whether frames hold display values instead of light (the classic renderer).
        shadows: the objects that cast shadows; None for no shadows.
    """

    level: float
    sky_level: float
    lit: float
    even: Array
    lamps: Mapping[str, Lamps]
    windows: LitWindows
    vehicles: Mapping[str, Headlamps]
    wetness: float
    is_signal: npt.NDArray[np.bool_]
    is_lens: npt.NDArray[np.bool_]
    is_pane: npt.NDArray[np.bool_]
    is_display: bool
    shadows: LampShadows | None = None

    def light(self, truth: RawView, camera: CameraRecord, record: SceneRecord, geoms: GeomTable) -> NightLight:
        """Computes the light of lamps in one view.

        Args:
            truth: depth and ids of the view; its colour is not used.
            camera: the camera that takes the picture.
            record: the scene, for its vehicles.
            geoms: label, object and surface of each geom.
        """
        kinds = {**self.lamps, "head": headlamps(record, self.vehicles)}
        share, glow = self._own(truth.geom_id, truth.depth_m, camera, record, geoms)
        streaks = np.zeros_like(glow) if self.wetness > 0 else None
        is_open = np.append(np.isin(geoms.label_code, OPEN_GROUND_CODES), False)[truth.geom_id]
        for kind, lamps in kinds.items():
            shine = LampGlare.of(lamps, camera, GLARE[kind], truth.depth_m)
            _add_colour(glow, shine.spots(is_open.shape), lamps.colour)
            if streaks is not None:
                image = shine.streaks(camera, record.ego.world_from_actor.position_m[2])
                image *= is_open * np.float32(STREAK_SHARE * self.wetness)
                _add_colour(streaks, image, lamps.colour)
        spots = self._spots(kinds, camera, record)
        for strip in strips_of(truth.depth_m, camera):
            rows = strip.rows
            part = np.float32(self.lit) * share[rows].astype(np.float32)
            self._add_lamps(strip, spots, part)
            share[rows] = self._shown(part)
            for light in (glow, streaks):
                if light is not None:
                    lit = self._shown(np.float32(self.lit) * light[rows].astype(np.float32))
                    light[rows] = lit * np.float32(LINEAR_FULL_SCALE)
        return NightLight(share=share, glow=glow, streaks=streaks)

    def _spots(
        self, kinds: Mapping[str, Lamps], camera: CameraRecord, record: SceneRecord
    ) -> list[tuple[LampsInView, dict[int, LampShadow]]]:
        """For each kind of lamp: the lamps in the view, and the shadows of the near ones by index."""
        found = []
        scene = self.shadows.scene(record) if self.shadows is not None else None
        for kind, lamps in kinds.items():
            spots = LampsInView.of(lamps, camera)
            shadows = {}
            if scene is not None:
                for index in spots.near(SHADOWED_WITHIN_M):
                    shadows[index] = LampShadow(
                        scene=scene, kind=kind, index=index, lamps=lamps, stands=kind in self.lamps
                    )
            found.append((spots, shadows))
        return found

    def _shown(self, light: FloatImage) -> FloatImage:
        return light ** np.float32(DISPLAY_POWER) if self.is_display else light

    def _add_lamps(
        self, strip: Strip, spots: Sequence[tuple[LampsInView, dict[int, LampShadow]]], share: FloatImage
    ) -> None:
        """Adds the factor k + E / A to some rows of `share`."""
        share += np.where(strip.is_seen, np.float32(self.level), np.float32(self.sky_level))[..., None]
        lit = [(spot.lamps.colour, spot.light(strip, shadows)) for spot, shadows in spots]
        above, aside, below = self.even.astype(np.float32)
        rise, sink = np.maximum(strip.normal[2], 0), np.maximum(-strip.normal[2], 0)
        for channel in range(3):
            even = aside[channel] + (above - aside)[channel] * rise + (below - aside)[channel] * sink
            for colour, light in lit:
                if light is not None:
                    share[..., channel] += np.float32(self.lit * colour[channel]) * light / even

    def _own(
        self, geom_id: IdImage, depth_m: FloatImage, camera: CameraRecord, record: SceneRecord, geoms: GeomTable
    ) -> tuple[HalfImage, HalfImage]:
        """For surfaces that emit light: (H, W, 3) factors on the frame and (H, W, 3) added light; zero elsewhere."""
        share = np.zeros((*geom_id.shape, 3), np.float16)
        glow = np.zeros_like(share)
        panes = self.windows.seen(geom_id, depth_m, camera)
        where = np.nonzero(panes >= 0)
        share[where], glow[where] = self.windows.gain[panes[where]], self.windows.light[panes[where]]
        share[np.append(self.is_signal, False)[geom_id]] = SIGNAL_GAIN
        lenses = np.append(self.is_lens, False)
        for where, gain, light in vehicle_lamp_light(lenses, geom_id, depth_m, camera, record, geoms, self.vehicles):
            share[where], glow[where] = gain, light
        inside = bus_interior_light(np.append(self.is_pane, False), geom_id, record, geoms, self.vehicles)
        share[inside] = np.array(INSIDE_LIGHT) / self.even[1]
        for where, lit in board_light(geom_id, depth_m, camera, record, geoms):
            share[where] = lit[:, None] / self.even[1].astype(np.float32)
        return share, glow


def _add_colour(total: HalfImage, light: FloatImage, colour: tuple[float, float, float]) -> None:
    """Adds (H, W) light of a colour to (H, W, 3), in place."""
    for rows in _bands(len(light)):
        total[rows] += light[rows, :, None] * np.array(colour, np.float32)


def _bands(height: int) -> Iterator[slice]:
    """Slices of a few rows each. Float arrays of whole pictures would take too much memory."""
    return (slice(top, min(top + STRIP_ROWS, height)) for top in range(0, height, STRIP_ROWS))


def _rounded(light: FloatImage, rows: slice) -> UInt16Image:
    """Some rows of light as uint16, dithered: a fixed pattern of 0..1 is added before rounding down."""
    grain = _grain()[np.arange(rows.start, rows.stop) % _GRAIN_PX]
    light += np.tile(grain, (1, -(-light.shape[1] // _GRAIN_PX)))[:, : light.shape[1], None]
    return np.minimum(light, LINEAR_FULL_SCALE, out=light).astype(np.uint16)


@cache
def _grain() -> FloatImage:
    return derive_rng(0, "night", "grain").random((_GRAIN_PX, _GRAIN_PX)).astype(np.float32)
