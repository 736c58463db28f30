"""Rendered frames: pixel-aligned colour, depth and geom ids of the cameras of one sample, and tables that describe
geoms and objects.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from gear.values.geometry import RigidTransform
from gear.values.labels import KittiType
from gear.values.scene import CameraRecord, Vec3

UInt8Image = npt.NDArray[np.uint8]
UInt16Image = npt.NDArray[np.uint16]
FloatImage = npt.NDArray[np.float32]
IdImage = npt.NDArray[np.int32]

LINEAR_FULL_SCALE = 1020
"""Largest value of linear colour, 1020: the sum of four 8-bit samples, so 2 x 2 supersampling keeps ten bits."""

STATIC_OBJECT_BASE = 1000
"""First object id of the town's countable objects, such as traffic lights; actors (vehicles, people) have smaller
ids.
"""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class View:
    """One camera's picture with pixel-aligned depth and ids. Arrays are read-only.

    Attributes:
        camera: size, pinhole, lens and pose.
        linear_rgb: (H, W, 3) uint16, linear in scene light, 0..`LINEAR_FULL_SCALE`.
        rgb: (H, W, 3) uint8, sRGB after gear's camera, row 0 at the top.
        depth_m: (H, W) float32, planar z, NaN where nothing was hit; sampled at pixel centres, no anti-aliasing.
        geom_id: (H, W) int32, -1 where nothing was hit; sampled at the same points as `depth_m`.
    """

    camera: CameraRecord
    linear_rgb: UInt16Image
    rgb: UInt8Image
    depth_m: FloatImage
    geom_id: IdImage

    def __post_init__(self) -> None:
        size = (self.camera.height_px, self.camera.width_px)
        for name, shape in (("linear_rgb", (*size, 3)), ("rgb", (*size, 3)), ("depth_m", size), ("geom_id", size)):
            got = getattr(self, name).shape
            if got != shape:
                raise ValueError(f"{name} must have shape {shape}, got {got}")
            getattr(self, name).setflags(write=False)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class GeomTable:
    """Label, object and surface of each geom of the render model; arrays are indexed by geom id.

    Attributes:
        label_code: (ngeom,) uint8, codes of `gear.values.labels`; 255 for geoms that are never rendered.
        object_id: (ngeom,) int32, the actor's id, `STATIC_OBJECT_BASE` + n for countable objects of the town, -1 for
            all other geoms.
        surface_index: (ngeom,) int16, index into `SceneRecord.surfaces` for the face that shows the patch, otherwise
            -1.
    """

    label_code: npt.NDArray[np.uint8]
    object_id: npt.NDArray[np.int32]
    surface_index: npt.NDArray[np.int16]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Shape:
    """The visible triangles of an asset, such as a car, in the asset's frame.

    Attributes:
        vertices_m: (N, 3) float64 vertices, metres.
        faces: (M, 3) int32 vertex indices of the triangles.
        face_label_code: (M,) uint8 label code of each triangle.
        box_centre_m: (3,) centre of the tight box along the frame's axes.
        box_size_m: (3,) length (x), width (y), height (z) of that box.
    """

    vertices_m: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int32]
    face_label_code: npt.NDArray[np.uint8]
    box_centre_m: npt.NDArray[np.float64]
    box_size_m: npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SceneObject:
    """A countable object: an actor (vehicle, pedestrian), or an object of the town such as a traffic light or a
    bench.

    Attributes:
        id: object id, as in `GeomTable.object_id`.
        asset: name of the object's MJCF; for objects of the town the body's name.
        label_code: label of the main part: a cyclist is a bicycle that has geoms of a rider.
        kitti_type: KITTI's type of the whole object, or None.
        is_ego: whether the object is the ego car, which carries the cameras and is never labelled.
        world_from_object: pose.
        shape: visible triangles.
        key_points: named points in the object's frame, metres, such as a person's `left_knee`; empty for assets that
            name none. `key_points_m` returns them in the world frame.
    """

    id: int
    asset: str
    label_code: int
    kitti_type: KittiType | None
    is_ego: bool
    world_from_object: RigidTransform
    shape: Shape
    key_points: Mapping[str, Vec3] = field(default_factory=dict)

    @property
    def key_points_m(self) -> dict[str, Vec3]:
        """The object's key points by name, such as a person's `left_knee`, in the world frame, metres."""
        if not self.key_points:
            return {}
        placed = self.world_from_object.apply(list(self.key_points.values()))
        return {name: (float(x), float(y), float(z)) for name, (x, y, z) in zip(self.key_points, placed, strict=True)}


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Frame:
    """All views of one sample, with the tables that describe their geom ids and objects.

    Attributes:
        views: views by camera name.
        geoms: label, object and surface of each geom.
        objects: countable objects by object id, visible or not.
    """

    views: Mapping[str, View]
    geoms: GeomTable
    objects: Mapping[int, SceneObject] = field(default_factory=dict)
