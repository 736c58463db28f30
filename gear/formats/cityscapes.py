"""Cityscapes: label ids, file names, label pictures and camera files."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.values.frames import UInt8Image
from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, RigidTransform
from gear.values.scene import CameraRecord
from gear.values.serial import Json

IGNORED_TRAIN_ID = 255

INSTANCE_FACTOR = 1000
"""An instance picture holds label id * 1000 + instance number for single instances, and the label id for all other
pixels.
"""


@dataclass(frozen=True, slots=True)
class CityscapesLabel:
    """One label of Cityscapes' table of labels.

    Attributes:
        id: label id, the value in label pictures.
        name: name in polygon files.
        train_id: 0..18, or 255 for labels that are not evaluated.
        category: one of Cityscapes' eight categories.
        has_instances: whether instance pictures number the instances of this label.
        rgb: colour of the label in colour pictures, 0..255.
    """

    id: int
    name: str
    train_id: int
    category: str
    has_instances: bool
    rgb: tuple[int, int, int]

    @property
    def is_evaluated(self) -> bool:
        """Whether the Cityscapes benchmark evaluates the label: its train id is not 255."""
        return self.train_id != IGNORED_TRAIN_ID


LABELS: tuple[CityscapesLabel, ...] = (
    CityscapesLabel(0, "unlabeled", 255, "void", False, (0, 0, 0)),
    CityscapesLabel(1, "ego vehicle", 255, "void", False, (0, 0, 0)),
    CityscapesLabel(2, "rectification border", 255, "void", False, (0, 0, 0)),
    CityscapesLabel(3, "out of roi", 255, "void", False, (0, 0, 0)),
    CityscapesLabel(4, "static", 255, "void", False, (0, 0, 0)),
    CityscapesLabel(5, "dynamic", 255, "void", False, (111, 74, 0)),
    CityscapesLabel(6, "ground", 255, "void", False, (81, 0, 81)),
    CityscapesLabel(7, "road", 0, "flat", False, (128, 64, 128)),
    CityscapesLabel(8, "sidewalk", 1, "flat", False, (244, 35, 232)),
    CityscapesLabel(9, "parking", 255, "flat", False, (250, 170, 160)),
    CityscapesLabel(10, "rail track", 255, "flat", False, (230, 150, 140)),
    CityscapesLabel(11, "building", 2, "construction", False, (70, 70, 70)),
    CityscapesLabel(12, "wall", 3, "construction", False, (102, 102, 156)),
    CityscapesLabel(13, "fence", 4, "construction", False, (190, 153, 153)),
    CityscapesLabel(14, "guard rail", 255, "construction", False, (180, 165, 180)),
    CityscapesLabel(15, "bridge", 255, "construction", False, (150, 100, 100)),
    CityscapesLabel(16, "tunnel", 255, "construction", False, (150, 120, 90)),
    CityscapesLabel(17, "pole", 5, "object", False, (153, 153, 153)),
    CityscapesLabel(18, "polegroup", 255, "object", False, (153, 153, 153)),
    CityscapesLabel(19, "traffic light", 6, "object", False, (250, 170, 30)),
    CityscapesLabel(20, "traffic sign", 7, "object", False, (220, 220, 0)),
    CityscapesLabel(21, "vegetation", 8, "nature", False, (107, 142, 35)),
    CityscapesLabel(22, "terrain", 9, "nature", False, (152, 251, 152)),
    CityscapesLabel(23, "sky", 10, "sky", False, (70, 130, 180)),
    CityscapesLabel(24, "person", 11, "human", True, (220, 20, 60)),
    CityscapesLabel(25, "rider", 12, "human", True, (255, 0, 0)),
    CityscapesLabel(26, "car", 13, "vehicle", True, (0, 0, 142)),
    CityscapesLabel(27, "truck", 14, "vehicle", True, (0, 0, 70)),
    CityscapesLabel(28, "bus", 15, "vehicle", True, (0, 60, 100)),
    CityscapesLabel(29, "caravan", 255, "vehicle", True, (0, 0, 90)),
    CityscapesLabel(30, "trailer", 255, "vehicle", True, (0, 0, 110)),
    CityscapesLabel(31, "train", 16, "vehicle", True, (0, 80, 100)),
    CityscapesLabel(32, "motorcycle", 17, "vehicle", True, (0, 0, 230)),
    CityscapesLabel(33, "bicycle", 18, "vehicle", True, (119, 11, 32)),
)
"""The 34 labels of Cityscapes, in the order of their ids."""

COLOURS: UInt8Image = np.array([label.rgb for label in LABELS], dtype=np.uint8)
"""(34, 3) uint8 RGB colour of each Cityscapes label, by label id."""

COLOURS_RGBA: UInt8Image = np.concatenate([COLOURS, np.full((len(COLOURS), 1), 255, dtype=np.uint8)], axis=1)
"""(34, 4) uint8 RGBA colour of each Cityscapes label, by label id; alpha is 255."""


def city_name(town: str) -> str:
    """The city name under which the pictures of a town are stored; it has no underscore and ends in `aachen`.

    The official tools split file names at underscores. CARLA-GeAR's loader recognises a Cityscapes folder by one of
    three names of real cities. With this ending, the loader, torchvision and the official tools read the same folder.

    Args:
        town: name of the town.
    """
    letters = re.sub(r"[^a-z0-9]", "", town.lower())
    return f"gear{letters}aachen"


def stem(town: str, sequence: int, frame: int) -> str:
    """The part `<city>_<sequence>_<frame>` with which the names of all files of one picture begin.

    Args:
        town: name of the town, from which the city's name is made.
        sequence: number of the driving sequence.
        frame: number of the picture in the sequence.
    """
    return f"{city_name(town)}_{sequence:06d}_{frame:06d}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Paths:
    """Paths of the six files that belong to one picture in the Cityscapes layout, relative to the dataset's root.

    Attributes:
        image: the picture, `leftImg8bit/...png`.
        label_ids: the label id of each pixel.
        instance_ids: the instance id of each pixel.
        colour: the colour of each pixel's label.
        polygons: outlines of the labels as JSON.
        camera: intrinsics and pose of the camera as JSON.
    """

    image: str
    label_ids: str
    instance_ids: str
    colour: str
    polygons: str
    camera: str


def paths(town: str, split: str, sequence: int, frame: int) -> Paths:
    """The paths of the files that belong to one picture in the Cityscapes layout, relative to the dataset's root.

    Args:
        town: name of the town, which Cityscapes calls the city.
        split: name of the split.
        sequence, frame: number of the sequence, and of the picture in it.
    """
    city, name = city_name(town), stem(town, sequence, frame)
    fine = f"gtFine/{split}/{city}/{name}_gtFine"
    return Paths(
        image=f"leftImg8bit/{split}/{city}/{name}_leftImg8bit.png",
        label_ids=f"{fine}_labelIds.png",
        instance_ids=f"{fine}_instanceIds.png",
        colour=f"{fine}_color.png",
        polygons=f"{fine}_polygons.json",
        camera=f"camera/{split}/{city}/{name}_camera.json",
    )


def colour_map(label_ids: npt.NDArray[np.uint8]) -> UInt8Image:
    """Colours an (H, W) label map; returns (H, W, 4) uint8 RGBA, opaque.

    Args:
        label_ids: (H, W) Cityscapes label ids.
    """
    # One gather of 32-bit pixels is five times as quick as one of four bytes each.
    packed = COLOURS_RGBA.view(np.uint32)[:, 0]
    return np.take(packed, label_ids).view(np.uint8).reshape(*label_ids.shape, 4)


def camera_json(camera: CameraRecord, world_from_vehicle: RigidTransform, baseline_m: float) -> Json:
    """The JSON content of a Cityscapes camera file: intrinsics in index pixels, and pose in the vehicle's frame (x
    forward, y left, z up).

    Args:
        camera: the left camera.
        world_from_vehicle: pose of the ego car; its origin is on the ground in the middle of the footprint.
        baseline_m: baseline of a stereo pair; 0 for a single camera.
    """
    vehicle_from_camera = world_from_vehicle.inverse().matrix @ camera.world_from_camera_transform.matrix
    # The benchmark's camera frame has the vehicle's axes.
    rotation = vehicle_from_camera[:3, :3] @ CAMERA_FROM_ACTOR_AXES
    x, y, z = (round(float(v), 6) + 0.0 for v in vehicle_from_camera[:3, 3])
    yaw = math.atan2(rotation[1, 0], rotation[0, 0])
    pitch = math.atan2(-rotation[2, 0], math.hypot(rotation[0, 0], rotation[1, 0]))
    roll = math.atan2(rotation[2, 1], rotation[2, 2])
    intrinsics = camera.intrinsics
    return {
        "extrinsic": {
            "baseline": baseline_m,
            "pitch": round(pitch, 9) + 0.0,
            "roll": round(roll, 9) + 0.0,
            "x": x,
            "y": y,
            "yaw": round(yaw, 9) + 0.0,
            "z": z,
        },
        "intrinsic": {
            "fx": intrinsics.fx_px,
            "fy": intrinsics.fy_px,
            "u0": intrinsics.cx_px,
            "v0": intrinsics.cy_px,
        },
    }
