"""Surfaces that emit light at night: glasses of vehicle lamps, interiors of buses, and boards with lamps of
their own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import numpy.typing as npt

from gear.camera.lamps import Headlamps, drivers
from gear.values.frames import FloatImage, GeomTable, IdImage
from gear.values.geometry import Array
from gear.values.scene import CameraRecord, SceneRecord

Where = tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]

BOARD_LIGHT, BOARD_FALL = 0.33, 0.3
"""Light of a white board at its upper edge (1.0 is full scale), and the share of this light by which its lower edge is
darker.
"""

INSIDE_LIGHT = (0.62, 0.60, 0.54)
"""Light of a white surface inside a bus, for red, green and blue."""

FRONT_LIGHT, BACK_LIGHT = (0.9, 0.85, 0.75), (0.30, 0.008, 0.004)
BACK_GAIN = 0.35
ENDS = 0.6
"""Position from which lamps are on, as a share of the distance from a vehicle's middle to its front or back. Glass
nearer to the middle belongs to blue lights on the roof, which are off.
"""


def vehicle_lamp_light(
    lenses: npt.NDArray[np.bool_],
    geom_id: IdImage,
    depth_m: FloatImage,
    camera: CameraRecord,
    record: SceneRecord,
    geoms: GeomTable,
    vehicles: Mapping[str, Headlamps],
) -> Iterator[tuple[Where, float, tuple[float, float, float]]]:
    """The pixels that show lit lamps of vehicles, with the light that these lamps emit.

    Args:
        lenses: (ngeom + 1,) bool: whether a geom is a glass of a lamp; the last entry is for geom id -1.
        geom_id, depth_m: (H, W) ids and planar z of a view.
        camera: the camera that takes the picture.
        record: the scene.
        geoms: label and object of each geom.
        vehicles: positions of headlamps by asset name.

    Yields:
        For the front and for the back of each vehicle: rows and columns of the pixels, the factor on the frame's light
        at these pixels, and the (3,) light that is added.
    """
    rows, columns = np.nonzero(lenses[geom_id])
    if not len(rows):
        return
    at_m = world_positions(rows, columns, depth_m, camera)
    owner = geoms.object_id[geom_id[rows, columns]]
    for actor in drivers(record, vehicles):
        pose = actor.world_from_actor.transform("world", "actor")
        ahead_m = (at_m - pose.translation_m) @ pose.rotation[:, 0]
        end_m = ENDS * vehicles[actor.asset].front_m
        for chosen, gain, light in ((ahead_m > end_m, 0.0, FRONT_LIGHT), (ahead_m < -end_m, BACK_GAIN, BACK_LIGHT)):
            mine = chosen & (owner == actor.id)
            yield (rows[mine], columns[mine]), gain, light


def bus_interior_light(
    panes: npt.NDArray[np.bool_],
    geom_id: IdImage,
    record: SceneRecord,
    geoms: GeomTable,
    vehicles: Mapping[str, Headlamps],
) -> Where:
    """Rows and columns of the pixels that show windows of buses in traffic, whose interior is lit.

    Args:
        panes: (ngeom + 1,) bool: whether a geom is a window of a bus; the last entry is for geom id -1.
        geom_id: (H, W) ids of a view.
        record: the scene.
        geoms: label and object of each geom.
        vehicles: positions of headlamps by asset name.
    """
    rows, columns = np.nonzero(panes[geom_id])
    driving = [actor.id for actor in drivers(record, vehicles)]
    mine = np.isin(geoms.object_id[geom_id[rows, columns]], driving)
    return rows[mine], columns[mine]


def board_light(
    geom_id: IdImage, depth_m: FloatImage, camera: CameraRecord, record: SceneRecord, geoms: GeomTable
) -> Iterator[tuple[Where, FloatImage]]:
    """The pixels that show the faces of boards which stand on the ground, with the light of the boards' own lamps.

    Args:
        geom_id, depth_m: (H, W) ids and planar z of a view.
        camera: the camera that takes the picture.
        record: the scene.
        geoms: label, object and surface of each geom.

    Yields:
        For each board: rows and columns of its N pixels, and (N,) light of a white face at these pixels.
    """
    index = np.append(geoms.surface_index, -1)[geom_id]
    for number, surface in enumerate(record.surfaces):
        rows, columns = np.nonzero(index == number)
        if surface.actor_id is None and len(rows):
            world_from_surface = record.world_from_surface(surface)
            away_m = world_positions(rows, columns, depth_m, camera) - world_from_surface.translation_m
            down = np.clip(away_m @ world_from_surface.rotation[:, 1] / surface.height_m + 0.5, 0, 1)
            yield (rows, columns), (BOARD_LIGHT * (1 - BOARD_FALL * down)).astype(np.float32)


def world_positions(
    rows: npt.NDArray[np.intp], columns: npt.NDArray[np.intp], depth_m: FloatImage, camera: CameraRecord
) -> Array:
    """The (N, 3) world positions in metres of the surface points that N pixels show.

    Args:
        rows, columns: (N,) index pixels.
        depth_m: (H, W) planar z of the view.
        camera: the camera that takes the picture.
    """
    pose = camera.world_from_camera_transform
    z = depth_m[rows, columns].astype(np.float64)
    pinhole = camera.intrinsics
    x = (columns - pinhole.cx_px) / pinhole.fx_px * z
    y = (rows - pinhole.cy_px) / pinhole.fy_px * z
    return np.asarray(np.stack([x, y, z], axis=1) @ pose.rotation.T + pose.translation_m)
