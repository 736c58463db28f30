"""Stereo 3D object detection in the layout of KITTI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import Encoded, Evaluator, Sample, Sidecar, SplitInfo
from gear.dataset.files import read_bytes
from gear.formats import results
from gear.formats.billboard_info import billboard_info
from gear.formats.jsontext import dump
from gear.formats.kitti_object import (
    Calibration,
    KittiLabel,
    clip_box,
    dont_care,
    format_calibration,
    format_labels,
    label_corners,
    occlusion_level,
    parse_labels,
    split_lists,
    truncation,
)
from gear.formats.png import encode_rgb
from gear.groundtruth.boxes import Box3d, box_in_camera, project_box
from gear.groundtruth.objects import observe_objects
from gear.groundtruth.raster import NEAR_M
from gear.groundtruth.visibility import VisibilityLimits
from gear.metrics.kitti_ap import KittiEvaluator
from gear.metrics.kitti_reference import NearCars
from gear.plugins.tasks.common import (
    CameraOptions,
    check_objects,
    draw_box,
    draw_segments,
    draw_surfaces,
    expect,
    images_of,
    read_rgb,
    surfaces_of,
)
from gear.values.errors import FieldError
from gear.values.frames import Frame, SceneObject, UInt8Image, View
from gear.values.ground_truth import BoxPx, ObjectTruth
from gear.values.labels import KittiType
from gear.values.rig import Rig
from gear.values.scene import SceneRecord
from gear.values.serial import Json, from_json, to_json

LEFT, RIGHT = "left", "right"
LEAST_BASELINE_M, MOST_BASELINE_M = 0.01, 10.0
COLOURS = {"Car": (60, 220, 60), "Van": (60, 200, 200), "Truck": (80, 140, 255), "Pedestrian": (255, 80, 80)}
OTHER_COLOUR = (255, 200, 60)
IGNORED_COLOUR = (170, 170, 170)


@dataclass(frozen=True, slots=True, kw_only=True)
class Stereo3dConfig(CameraOptions):
    """Options of stereo 3D detection.

    Attributes:
        baseline_m: left camera to right camera.
        visibility: what an object must show to be labelled; where one shows less there is a `DontCare` region.
    """

    width_px: int = 1224
    height_px: int = 370
    baseline_m: float = 0.54
    visibility: VisibilityLimits = field(default_factory=VisibilityLimits)

    def __post_init__(self) -> None:
        CameraOptions.__post_init__(self)
        if not LEAST_BASELINE_M <= self.baseline_m <= MOST_BASELINE_M:
            limits = f"{LEAST_BASELINE_M:g} to {MOST_BASELINE_M:g} m"
            raise FieldError("baseline_m", f"must be {limits}, got {self.baseline_m:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Object3d:
    """One labelled object, seen by the left camera.

    Attributes:
        object_id: the same in every sample of a sequence.
        kitti_type: KITTI's type of the whole; a cyclist is one object.
        is_ignored: seen too little of to be looked for: a `DontCare` region.
        box: in the frame of the left camera.
        box_px: its projection, clipped to the picture; index pixels.
        truncated: share of the projection outside the picture.
        occluded: 0 for at least 80 % of the silhouette in the picture seen, 1 for at least 50 %, 2 for less.
        visible_px: pixels in the id buffer.
        occluded_fraction: covered share of the silhouette in the picture.
    """

    object_id: int
    kitti_type: KittiType
    is_ignored: bool
    box: Box3d
    box_px: BoxPx
    truncated: float
    occluded: int
    visible_px: int
    occluded_fraction: float

    def label(self) -> KittiLabel:
        """Its line in the label file."""
        if self.is_ignored:
            return dont_care(self.box_px)
        return KittiLabel(
            type=self.kitti_type,
            truncated=self.truncated,
            occluded=self.occluded,
            alpha_rad=self.box.alpha_rad,
            box_px=self.box_px,
            height_m=self.box.height_m,
            width_m=self.box.width_m,
            length_m=self.box.length_m,
            location_m=self.box.bottom_m,
            rotation_y_rad=self.box.rotation_y_rad,
        )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Stereo3dSample(Sample):
    """A rectified pair with its objects.

    Attributes:
        calibration: of the pair; the left camera is the reference frame.
        objects: labelled and ignored ones.
    """

    calibration: Calibration
    objects: tuple[Object3d, ...]


class Stereo3dTask:
    """`<split>/{image_2,image_3,calib,label_2}`, `splits`, `ImageSets`."""

    def __init__(self, config: Stereo3dConfig) -> None:
        self.config = config

    def rig(self) -> Rig:
        """Two parallel cameras."""
        cameras = (self.config.mount(LEFT), self.config.mount(RIGHT, right_m=self.config.baseline_m))
        return Rig(cameras=cameras, follows_road=self.config.follows_road)

    def ground_truth(self, frame: Frame, record: SceneRecord) -> Stereo3dSample:
        """Measures every object that KITTI has a type for, in the left view."""
        view = frame.views[LEFT]
        found = []
        for truth in observe_objects(view, frame.geoms, frame.objects, by_label=False):
            thing = frame.objects[truth.object_id]
            if thing.kitti_type is not None and self.config.visibility.mentions(truth):
                measured = self._measure(truth, thing, thing.kitti_type, view)
                if measured is not None:
                    found.append(measured)
        return Stereo3dSample(
            record=record,
            images=images_of(frame),
            surfaces=surfaces_of(frame, record),
            calibration=self._calibration(record),
            objects=tuple(found),
        )

    def _measure(self, truth: ObjectTruth, thing: SceneObject, kind: KittiType, view: View) -> Object3d | None:
        box = box_in_camera(thing, view.camera)
        projected = project_box(box.corners_m, view.camera.intrinsics)
        clipped = clip_box(projected, view.camera.intrinsics) if projected else None
        if projected is None or clipped is None:
            return None
        return Object3d(
            object_id=truth.object_id,
            kitti_type=kind,
            is_ignored=not self.config.visibility.labels(truth, box.distance_m),
            box=box,
            box_px=clipped,
            truncated=truncation(projected, clipped),
            occluded=occlusion_level(truth.occluded_fraction),
            visible_px=truth.visible_px,
            occluded_fraction=truth.occluded_fraction,
        )

    def _calibration(self, record: SceneRecord) -> Calibration:
        return Calibration(intrinsics=record.camera(LEFT).intrinsics, baseline_m=self.config.baseline_m)

    def encode(self, sample: Stereo3dSample, info: SplitInfo) -> Encoded:
        """Both pictures, calibration and labels."""
        name = _name(sample.record.index)
        files = {
            f"{info.split}/image_2/{name}.png": encode_rgb(sample.images[LEFT]),
            f"{info.split}/image_3/{name}.png": encode_rgb(sample.images[RIGHT]),
            f"{info.split}/calib/{name}.txt": format_calibration(sample.calibration),
            f"{info.split}/label_2/{name}.txt": format_labels(thing.label() for thing in sample.objects),
        }
        facts = {"baseline_m": sample.calibration.baseline_m, "objects": to_json(sample.objects)}
        return Encoded(files=files, facts=facts)

    def finalise(self, sidecars: Sequence[Sidecar], info: SplitInfo) -> Mapping[str, bytes]:
        """The lists of ids and the original's poses."""
        records = [sidecar.record for sidecar in sidecars]
        poses = billboard_info(records, task="3dod", patch_label=info.patch_label, reference=LEFT, second=RIGHT)
        lists = split_lists(info.split, [_name(record.index) for record in records])
        return {**lists, f"{info.split}/label_2/camera_billboard_info.json": dump(poses)}

    def decode(self, root: Path, sidecar: Sidecar, info: SplitInfo) -> Stereo3dSample:
        """Reads both pictures; the objects, unrounded, are in the sidecar."""
        record, name = sidecar.record, _name(sidecar.record.index)
        facts = expect(sidecar.facts, "baseline_m", "objects", place=root)
        baseline_m = from_json(float, facts["baseline_m"], "baseline_m")
        if not LEAST_BASELINE_M <= baseline_m <= MOST_BASELINE_M:
            raise FieldError("baseline_m", f"is {baseline_m:g} m")
        objects = from_json(tuple[Object3d, ...], facts["objects"], "objects")
        check_objects(facts["objects"], (thing.box_px for thing in objects))
        return Stereo3dSample(
            record=record,
            images={
                LEFT: read_rgb(root, f"{info.split}/image_2/{name}.png", record, LEFT),
                RIGHT: read_rgb(root, f"{info.split}/image_3/{name}.png", record, RIGHT),
            },
            surfaces=sidecar.surfaces,
            calibration=Calibration(intrinsics=record.camera(LEFT).intrinsics, baseline_m=baseline_m),
            objects=objects,
        )

    def as_prediction(self, sample: Stereo3dSample) -> tuple[KittiLabel, ...]:
        """Every labelled object, quite sure."""
        return tuple(replace(thing.label(), score=1.0) for thing in sample.objects if not thing.is_ignored)

    def evaluator(self) -> Evaluator[Stereo3dSample, tuple[KittiLabel, ...]]:
        """KITTI's average precisions."""
        return KittiEvaluator(_lines)

    def reports(self) -> Mapping[str, Evaluator[Stereo3dSample, tuple[KittiLabel, ...]]]:
        """`reference`: cars seen from above, at IoU 0.5, below 40 m."""
        return {"reference": NearCars(_lines)}

    def encode_prediction(self, sample: Stereo3dSample, prediction: Sequence[KittiLabel], info: SplitInfo) -> Encoded:
        """A result file."""
        lines = results.kitti_result_lines(prediction)
        return Encoded(files={results.kitti_object_path(sample.record.index): lines}, facts={})

    def decode_prediction(
        self, root: Path, sample: Stereo3dSample, facts: Json, info: SplitInfo
    ) -> tuple[KittiLabel, ...]:
        """Reads the result file."""
        return parse_labels(read_bytes(root / results.kitti_object_path(sample.record.index)).decode())

    def finalise_predictions(self, facts: Sequence[tuple[SceneRecord, Json]], info: SplitInfo) -> Mapping[str, bytes]:
        """The result files are all there is."""
        return {}

    def preview(self, sample: Stereo3dSample) -> Mapping[str, UInt8Image]:
        """3D boxes on the left picture, ignored regions dashed in grey, and the right picture."""
        left = sample.images[LEFT].copy()
        for thing in sample.objects:
            if thing.is_ignored:
                draw_box(left, thing.box_px, IGNORED_COLOUR, dashed=True)
                continue
            colour = COLOURS.get(thing.kitti_type, OTHER_COLOUR)
            corners_m = label_corners(thing.label())
            if corners_m[:, 2].min() >= NEAR_M:
                corners_px = sample.calibration.intrinsics.project(corners_m)
                draw_segments(left, [(corners_px[i], corners_px[j]) for i, j in WIRES], colour)
                draw_segments(left, [(corners_px[0], corners_px[5]), (corners_px[1], corners_px[4])], colour)
            text = f"{thing.kitti_type} {thing.box.distance_m:.0f} m o{thing.occluded} t{thing.truncated:.1f}"
            draw_box(left, thing.box_px, colour, text)
        right = sample.images[RIGHT].copy()
        draw_surfaces(left, sample, LEFT)
        draw_surfaces(right, sample, RIGHT)
        return {LEFT: left, RIGHT: right}


WIRES = tuple((i, (i + 1) % 4) for i in range(4)) + tuple((i + 4, (i + 1) % 4 + 4) for i in range(4)) + tuple(
    (i, i + 4) for i in range(4)
)  # fmt: skip
"""Edges of a box in the order of `label_corners`; its front is the face of corners 0, 1, 4, 5."""


def _lines(sample: Stereo3dSample) -> tuple[KittiLabel, ...]:
    """Its label file as the devkit reads it: two decimals decide which level a label at the border of one is of."""
    return parse_labels(format_labels(thing.label() for thing in sample.objects).decode())


def _name(index: int) -> str:
    return f"{index:06d}"


stereo3d: TaskSpec[Stereo3dConfig] = TaskSpec(
    name="stereo3d",
    summary="Stereo 3D object detection: KITTI pictures, calibration and labels by KITTI's own definitions.",
    config=Stereo3dConfig,
    build=Stereo3dTask,
    views=(LEFT, RIGHT),
    layout="<split>/{image_2,image_3,calib,label_2}/%06d.{png,txt}, splits/<split>.txt, ImageSets/<split>.txt",
    original_name="3dod",
    metric="reference.car_bev_moderate_r40",
)


@hookimpl
def gear_tasks() -> list[TaskSpec[Stereo3dConfig]]:
    """This task."""
    return [stereo3d]
