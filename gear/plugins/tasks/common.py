"""Shared parts of the built-in tasks: camera options, checks and drawing."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from gear.contracts.legends import Rgb
from gear.contracts.tasks import Sample
from gear.dataset.checks.sidecar_validation import check_numbers
from gear.dataset.files import inside
from gear.formats.png import decode_plain, decode_rgb
from gear.groundtruth.surfaces import observe_surfaces
from gear.values.errors import DatasetError, FieldError
from gear.values.frames import Frame, UInt8Image
from gear.values.ground_truth import BoxPx, SurfaceTruth
from gear.values.regular_file import read_regular
from gear.values.rig import CameraMount
from gear.values.scene import SceneRecord, Vec3
from gear.values.serial import Json

REPAIR = "`gear verify DIR --repair` makes it again"
"""Advice in errors about files that are missing or damaged."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraOptions:
    """The options of a task's camera, which is mounted on the ego car.

    Attributes:
        width_px, height_px: size of the picture.
        hfov_deg: horizontal field of view, 1 to 170; not used if `focal_px` is set.
        position_m: in the ego frame: x forward, y left, z up, the origin on the ground.
        pitch_deg: downward rotation, -90 to 90.
        roll_deg: clockwise rotation as seen from behind the camera, -180 to 180.
        follows_road: False keeps the camera level, as the loaders of CARLA-GeAR require; True gives it the car's pitch
            and roll.
        focal_px: horizontal focal length, instead of `hfov_deg`.
        focal_y_px: vertical focal length; the same as the horizontal one by default.
        principal_px: principal point (column, row), where the centre of the first pixel is (0, 0); the middle of the
            picture by default.
    """

    width_px: int
    height_px: int
    hfov_deg: float = 90.0
    position_m: Vec3 = (1.5, 0.0, 1.65)
    pitch_deg: float = 0.0
    roll_deg: float = 0.0
    follows_road: bool = False
    focal_px: float | None = None
    focal_y_px: float | None = None
    principal_px: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        self.mount("left")
        if self.position_m[2] <= 0:
            raise FieldError(
                "position_m",
                f"puts the camera under the ground: the third number is its height, got {self.position_m[2]:g} m",
            )
        if not all(math.isfinite(v) and abs(v) < 100 for v in self.position_m):
            raise FieldError("position_m", f"must lie within 100 m of the car, got {self.position_m}")

    @property
    def is_level(self) -> bool:
        """Whether the camera is level in every sample: no pitch, no roll, and `follows_road` is False."""
        return self.pitch_deg == 0 and self.roll_deg == 0 and not self.follows_road

    def mount(self, name: str, right_m: float = 0.0) -> CameraMount:
        """Makes the mount of a camera with these options on the ego car.

        Args:
            name: name of the camera.
            right_m: distance by which the camera is moved to the right along the picture's horizontal axis, metres.
        """
        return CameraMount(
            name=name,
            width_px=self.width_px,
            height_px=self.height_px,
            hfov_deg=self.hfov_deg,
            position_m=self._moved_right(right_m),
            pitch_deg=self.pitch_deg,
            roll_deg=self.roll_deg,
            focal_px=self.focal_px,
            focal_y_px=self.focal_y_px,
            principal_px=self.principal_px,
        )

    def _moved_right(self, right_m: float) -> Vec3:
        """The camera's position after a move along the picture's horizontal axis, which roll tilts and pitch does
        not.
        """
        x, y, z = self.position_m
        pitch_rad, roll_rad = math.radians(self.pitch_deg), math.radians(self.roll_deg)
        down_m = right_m * math.sin(roll_rad)
        aside_m = right_m * math.cos(roll_rad)
        return (x - down_m * math.sin(pitch_rad), y - aside_m, z - down_m * math.cos(pitch_rad))


def surfaces_of(frame: Frame, record: SceneRecord) -> tuple[SurfaceTruth, ...]:
    """Returns the ground truth of every patch surface in every view, ordered by the record's cameras.

    Args:
        frame: the rendered views of the scene.
        record: the scene, for its cameras and surfaces.
    """
    return tuple(
        truth for camera in record.cameras for truth in observe_surfaces(frame.views[camera.name], frame.geoms, record)
    )


def images_of(frame: Frame) -> dict[str, UInt8Image]:
    """Returns the (H, W, 3) uint8 pictures of all views, by camera name.

    Args:
        frame: the rendered views of the scene.
    """
    return {name: view.rgb for name, view in frame.views.items()}


def read_rgb(root: Path, relative: str, record: SceneRecord | None = None, view: str = "") -> UInt8Image:
    """Reads a colour picture of a dataset, (H, W, 3) uint8; with a record and a view, its size is checked.

    Args:
        root: root folder of the dataset.
        relative: path of the file in the dataset.
        record: scene record of the sample; None for no check of the size.
        view: name of the camera; used only with a record.

    Raises:
        DatasetError: the file is missing, outside of the dataset, damaged, or of another size than the view.
    """
    picture = _read(root, relative, decode_rgb)
    if record is not None:
        _check_size(root / relative, picture, record, view)
    return picture


def read_map(
    root: Path, relative: str, record: SceneRecord, view: str, dtype: npt.DTypeLike, max_value: int | None = None
) -> npt.NDArray[Any]:
    """Reads the (H, W) label or depth map of one view of a sample, without conversion.

    Args:
        root: root of the dataset.
        relative: path of the file below the root.
        record: scene record of the sample, for the size of the view.
        view: name of the camera.
        dtype: dtype that the map must have.
        max_value: largest allowed value; None for no limit.

    Raises:
        DatasetError: the file is missing or damaged, or has another size than the view, another dtype or larger values.
    """
    values = read_plain(root, relative)
    _check_size(root / relative, values, record, view)
    if values.ndim != 2 or values.dtype != dtype or (max_value is not None and int(values.max()) > max_value):
        limit = "" if max_value is None else f" of 0 to {max_value}"
        raise DatasetError(root / relative, f"is no map of one {np.dtype(dtype).name}{limit} a pixel; {REPAIR}")
    return values


def read_plain(root: Path, relative: str) -> npt.NDArray[Any]:
    """Reads a label or depth map of any size and dtype, without conversion.

    Args:
        root: root folder of the dataset.
        relative: path of the file in the dataset.

    Raises:
        DatasetError: the file is missing, outside of the dataset, or damaged.
    """
    return _read(root, relative, decode_plain)


def _check_size(path: Path, picture: npt.NDArray[Any], record: SceneRecord, view: str) -> None:
    sizes = {camera.name: (camera.width_px, camera.height_px) for camera in record.cameras}
    height, width = picture.shape[:2]
    if sizes.get(view) != (width, height):
        raise DatasetError(path, f"is {width} x {height} px, its sidecar says {sizes.get(view)} of {view}; {REPAIR}")


def _read(root: Path, relative: str, decode: Callable[[bytes], npt.NDArray[Any]]) -> npt.NDArray[Any]:
    path = inside(root, relative)
    try:
        return decode(read_regular(path))
    except FileNotFoundError as error:
        raise DatasetError(path, f"is gone; {REPAIR}") from error
    except OSError as error:
        raise DatasetError(path, error.strerror or str(error)) from error
    except ValueError as error:
        raise DatasetError(path, f"{error}; {REPAIR}") from error


IGNORED_COLOUR = (170, 170, 170)
"""Colour of objects and regions that evaluations ignore, RGB."""


def category_colour(category_id: int) -> Rgb:
    """Returns the colour of a COCO category in previews, RGB bytes; neighbouring categories differ in hue.

    Args:
        category_id: COCO's category id, or any integer of 0 or more.
    """
    hue = np.array([[[category_id * 47 % 180, 200, 255]]], dtype=np.uint8)
    red, green, blue = (int(v) for v in cv2.cvtColor(hue, cv2.COLOR_HSV2RGB)[0, 0])
    return (red, green, blue)


def draw_surfaces(picture: UInt8Image, sample: Sample, camera: str) -> None:
    """Draws the outlines of the patch surfaces in one view onto a picture in magenta, in place.

    Args:
        picture: (H, W, 3) uint8 picture of the view.
        sample: the sample with its surfaces.
        camera: name of the view.
    """
    for truth in sample.surfaces:
        if truth.camera == camera and truth.corners_px is not None:
            draw_polygon(picture, truth.corners_px, (255, 0, 255))


def draw_polygon(picture: UInt8Image, points_px: Sequence[Sequence[float]], rgb: tuple[int, int, int]) -> None:
    """Draws a closed polygon onto a picture, in place; its corners (x, y) are in index pixels.

    The centre of the first pixel is (0, 0) in index pixels.

    Args:
        picture: (H, W, 3) uint8 picture.
        points_px: corners (x, y) in order.
        rgb: colour, 0..255.
    """
    draw_segments(picture, list(zip(points_px, [*points_px[1:], points_px[0]], strict=True)), rgb)


FAR_PX = 4 * 8192
"""Largest distance of a drawn point from the picture in pixels, because OpenCV computes with 32 bits."""


def draw_segments(
    picture: UInt8Image, segments_px: Iterable[tuple[Sequence[float], Sequence[float]]], rgb: tuple[int, int, int]
) -> None:
    """Draws straight lines onto a picture, in place; their ends (x, y), in index pixels, may be far outside.

    The centre of the first pixel is (0, 0) in index pixels.

    Args:
        picture: (H, W, 3) uint8 picture.
        segments_px: both ends (x, y) of each line.
        rgb: colour, 0..255.
    """
    for ends in segments_px:
        (x0, y0), (x1, y1) = (np.round(np.clip(end, -FAR_PX, FAR_PX) * 16).astype(int).tolist() for end in ends)
        cv2.line(picture, (x0, y0), (x1, y1), rgb, 1, cv2.LINE_AA, 4)


def draw_box(
    picture: UInt8Image, box: Sequence[float], rgb: tuple[int, int, int], text: str = "", *, dashed: bool = False
) -> None:
    """Draws a box and a text onto a picture, in place.

    Args:
        picture: (H, W, 3) uint8 picture.
        box: left, top, right and bottom in index pixels; the box may exceed the picture.
        rgb: colour, 0..255.
        text: text on the colour above the box; "" for none.
        dashed: whether the lines are dashed, which marks ignored objects.
    """
    left, top, right, bottom = (round(min(max(float(v), -FAR_PX), FAR_PX)) for v in box)
    if dashed:
        for x in range(left, right, 8):
            for y in (top, bottom):
                cv2.line(picture, (x, y), (min(x + 4, right), y), rgb, 1)
        for y in range(top, bottom, 8):
            for x in (left, right):
                cv2.line(picture, (x, y), (x, min(y + 4, bottom)), rgb, 1)
    else:
        cv2.rectangle(picture, (left, top), (right, bottom), rgb, 1)
    if text:
        size, _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.4, 1)
        base = max(top - 3, size[1] + 2)
        cv2.rectangle(picture, (left, base - size[1] - 2), (left + size[0] + 2, base + 2), rgb, -1)
        cv2.putText(picture, text, (left + 1, base), cv2.FONT_HERSHEY_SIMPLEX, 0.4, (0, 0, 0), 1, cv2.LINE_AA)


def expect(facts: Any, *keys: str, place: Path) -> Mapping[str, Any]:
    """Returns the metadata in a sample's JSON file (sidecar) after checking that the keys that a task needs exist.

    Args:
        facts: content of the sidecar that the task wrote.
        place: path of the sidecar or dataset, for the message.
        keys: names of the keys that must exist.

    Raises:
        DatasetError: a key is missing, because the sidecar is that of another task or damaged.
    """
    missing = [key for key in keys if not isinstance(facts, dict) or key not in facts]
    if missing:
        raise DatasetError(place, f"its sidecars do not say {', '.join(missing)}; was it collected for another task?")
    return facts  # type: ignore[no-any-return]


def check_objects(content: Json, boxes_px: Iterable[BoxPx]) -> None:
    """Checks the numbers and boxes of the objects in a sample's JSON file (sidecar), for tasks with objects.

    Args:
        content: the objects as they are stored.
        boxes_px: (left, top, right, bottom) of each object in the picture.

    Raises:
        FieldError: a number is out of range, a box's right is left of its left, or its bottom is above its top; the
            error names the object.
    """
    check_numbers(content, "objects")
    for place, (left, top, right, bottom) in enumerate(boxes_px):
        if right < left or bottom < top:
            raise FieldError(f"objects[{place}].box_px", "ends before it begins")
