"""The task of stereo 3D object detection, with files in the layout of KITTI."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from gear.augment.geometry import Geometry, Window, box_area, clipped, cut_picture, flip_array, share_in_frame
from gear.augment.pinhole import cut_index_box, index_frame, mirrored_pinhole, windowed_pinhole
from gear.augment.registry import register
from gear.contracts.evaluation import Masks
from gear.contracts.hookspecs import hookimpl
from gear.contracts.legends import ColourNames, Legend
from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import Encoded, Evaluator, Indexes, Sample, Sidecar, SplitInfo
from gear.dataset.files import read_bytes
from gear.formats import results
from gear.formats.billboard_info import billboard_info
from gear.formats.jsontext import dump
from gear.formats.kitti_object import (
    WIRES,
    Calibration,
    KittiLabel,
    dont_care,
    format_calibration,
    format_labels,
    from_edge_pixels,
    label_corners,
    occlusion_level,
    parse_labels,
    split_lists,
    to_edge_pixels,
)
from gear.formats.png import encode_rgb
from gear.groundtruth.boxes import Box3d, box_in_camera, box_of, project_box
from gear.groundtruth.objects import observe_objects
from gear.groundtruth.regions import MOSTLY, least_share_inside, part_boxes
from gear.groundtruth.silhouettes import NEAR_M
from gear.groundtruth.visibility import Visibility, VisibilityLimits
from gear.metrics.kitti_ap import KittiEvaluator
from gear.metrics.kitti_match import NEIGHBOURS, is_in_place, picture_detections
from gear.metrics.kitti_reference import NearCars
from gear.plugins.tasks.common import (
    IGNORED_COLOUR,
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
from gear.values.geometry import Intrinsics, wrap_angle_rad
from gear.values.ground_truth import BoxPx, ObjectTruth
from gear.values.labels import KittiType
from gear.values.picture_objects import PictureObject, PictureObjects
from gear.values.rig import Rig
from gear.values.scene import SceneRecord
from gear.values.serial import Json, from_json, to_json

LEFT, RIGHT, LEAST_BASELINE_M, MOST_BASELINE_M = "left", "right", 0.01, 10.0
COLOURS = {"Car": (60, 220, 60), "Van": (60, 200, 200), "Truck": (80, 140, 255), "Pedestrian": (255, 80, 80)}
OTHER_COLOUR = (255, 200, 60)


@dataclass(frozen=True, slots=True, kw_only=True)
class Stereo3dConfig(CameraOptions):
    """Options of stereo 3D object detection. They include the options of `CameraOptions`.

    Attributes:
        baseline_m: distance from the left to the right camera.
        visibility: least visible part of an object that is labelled; an object that shows less is a `DontCare` region.
    """

    width_px: int = 1224
    height_px: int = 370
    baseline_m: float = 0.54
    visibility: Visibility = field(default_factory=lambda: Visibility(preset="kitti"))

    def __post_init__(self) -> None:
        CameraOptions.__post_init__(self)
        if not LEAST_BASELINE_M <= self.baseline_m <= MOST_BASELINE_M:
            limits = f"{LEAST_BASELINE_M:g} to {MOST_BASELINE_M:g} m"
            raise FieldError("baseline_m", f"must be {limits}, got {self.baseline_m:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Object3d:
    """One object of a stereo pair, measured in the left view.

    2D boxes are (left, top, right, bottom) in index pixels: the centre of the first pixel is (0, 0).

    Attributes:
        object_id: id of the object, the same in every sample of a sequence.
        kitti_type: KITTI's type of the whole object; a cyclist with bicycle is one object.
        is_ignored: whether it is a `DontCare` region, because too little of it is visible.
        box: 3D box in the frame of the left camera.
        box_px: tight box of the silhouette inside the picture, hidden parts included.
        amodal_box_px: tight box of the whole silhouette, which may exceed the picture.
        truncated: share of the silhouette outside the picture, 0..1.
        occluded: how much of the silhouette in the picture is visible: 0 for at least 80 %, 1 for at least 50 %, 2 for
            at least 10 %, 3 for less.
        visible_px: number of visible pixels of the object.
        occluded_fraction: covered share of the silhouette's part in the picture.
    """

    object_id: int
    kitti_type: KittiType
    is_ignored: bool
    box: Box3d
    box_px: BoxPx
    amodal_box_px: BoxPx
    truncated: float
    occluded: int
    visible_px: int
    occluded_fraction: float

    def label(self) -> KittiLabel:
        """The object's line in KITTI's label file; `DontCare` for ignored objects."""
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
    """A sample of stereo 3D object detection: a rectified picture pair with its objects.

    Attributes:
        calibration: calibration of the pair; the left camera is the reference frame.
        objects: labelled and ignored objects.
        ignored_px: boxes in the left picture, in index pixels; a detection in them that matches no object is neither
            right nor wrong. Samples of datasets have none; `Stereo3dTask.without` adds them.
    """

    calibration: Calibration
    objects: tuple[Object3d, ...]
    ignored_px: tuple[BoxPx, ...] = ()


class Stereo3dTask:
    """The task of stereo 3D object detection, with the options `config`; it writes KITTI's folders and lists."""

    def __init__(self, config: Stereo3dConfig) -> None:
        self.config = config

    def rig(self) -> Rig:
        """The camera rig of the task: two parallel cameras, `left` and `right`."""
        cameras = (self.config.mount(LEFT), self.config.mount(RIGHT, right_m=self.config.baseline_m))
        return Rig(cameras=cameras, follows_road=self.config.follows_road)

    def ground_truth(self, frame: Frame, record: SceneRecord) -> Stereo3dSample:
        """Makes the sample of the scene `record` from `frame`: its KITTI objects, measured in the left view."""
        view, limits = frame.views[LEFT], self.config.visibility.limits()
        found = []
        for truth in observe_objects(view, frame.geoms, frame.objects, by_label=False):
            thing = frame.objects[truth.object_id]
            if thing.kitti_type is not None and limits.mentions(truth):
                found.append(_measured(truth, thing, thing.kitti_type, view, limits))
        return Stereo3dSample(
            record=record,
            images=images_of(frame),
            surfaces=surfaces_of(frame, record),
            calibration=self._calibration(record),
            objects=tuple(found),
        )

    def _calibration(self, record: SceneRecord) -> Calibration:
        return Calibration(intrinsics=record.camera(LEFT).intrinsics, baseline_m=self.config.baseline_m)

    def encode(self, sample: Stereo3dSample, info: SplitInfo) -> Encoded:
        """Encodes a `sample` as files of the split in `info`: both pictures, the calibration and the label file."""
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
        """Makes a split's files from the metadata of all samples (`sidecars`): lists of ids, CARLA-GeAR's poses."""
        return self.extend({}, 0, sidecars, info)

    def extend(self, before: Indexes, start: int, sidecars: Sequence[Sidecar], info: SplitInfo) -> Indexes:
        """Makes the files that `finalise` makes, from those of the split's first `start` samples.

        `before` holds these files' bytes by path, `sidecars` the metadata of all samples, and `info` the split's names.
        """
        place = f"{info.split}/label_2/camera_billboard_info.json"
        records = (sidecars[index].record for index in range(start, len(sidecars)))
        poses = billboard_info(
            records, task="3dod", patch_label=info.patch_label, reference=LEFT, second=RIGHT, before=before.get(place)
        )
        return {**split_lists(info.split, [_name(index) for index in range(len(sidecars))]), place: dump(poses)}

    def decode(self, root: Path, sidecar: Sidecar, info: SplitInfo) -> Stereo3dSample:
        """Reads a sample: pictures from the dataset's folder `root`, unrounded objects from its metadata `sidecar`."""
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
        """Returns the labels of the `sample`'s objects that are not ignored, as a prediction with score 1."""
        return tuple(replace(thing.label(), score=1.0) for thing in sample.objects if not thing.is_ignored)

    def evaluator(self) -> Evaluator[Stereo3dSample, tuple[KittiLabel, ...]]:
        """A new evaluator of KITTI's average precisions."""
        return KittiEvaluator(_lines, _ignored)

    def reports(self) -> Mapping[str, Evaluator[Stereo3dSample, tuple[KittiLabel, ...]]]:
        """Further evaluators by name: `reference` evaluates cars below 40 m in bird's-eye view at IoU 0.5."""
        return {"reference": NearCars(_lines, _ignored)}

    def without(self, sample: Stereo3dSample, masks: Masks) -> Stereo3dSample:
        """Returns a copy of the sample in which what is inside the left mask is ignored, like DontCare regions.

        The box of each connected part of the mask is such a region, but for 2D, bird's-eye and 3D boxes. A detection
        that matches no object is ignored if more than a share of its box lies in it: 0.7 for cars, 0.5 for others, as
        in the benchmark. An object is ignored if more than half of its visible pixels must lie in the mask, as its box
        has too few others. `masks` holds (H, W) bool arrays by camera name.
        """
        mask = masks[LEFT]
        objects, regions = [], list(part_boxes(mask))
        for thing in sample.objects:
            is_inside = least_share_inside(to_edge_pixels(thing.box_px), thing.visible_px, mask) > MOSTLY
            objects.append(replace(thing, is_ignored=thing.is_ignored or is_inside))
            regions += [to_edge_pixels(thing.box_px)] if is_inside else []
        boxes = tuple(from_edge_pixels(box, sample.calibration.intrinsics) for box in regions)
        return replace(sample, objects=tuple(objects), ignored_px=(*sample.ignored_px, *boxes))

    def picture_objects(self, sample: Stereo3dSample, prediction: Sequence[KittiLabel]) -> PictureObjects:
        """Returns `sample`'s objects and `prediction`'s detections, to compare samples with and without a patch.

        Only cars, pedestrians and cyclists count; boxes of other types and ignored regions are returned as ignored
        regions.
        """
        pairs = list(zip(sample.objects, _lines(sample), strict=True))
        wanted = [(thing, line) for thing, line in pairs if line.type in NEIGHBOURS]
        found = [one for one in prediction if one.type in NEIGHBOURS]
        ignored = [*(line.box_px for _, line in pairs if line.type not in NEIGHBOURS), *sample.ignored_px]
        return PictureObjects(
            camera=LEFT,
            objects=tuple(
                PictureObject(
                    object_id=thing.object_id,
                    label=line.type,
                    box_px=to_edge_pixels(line.box_px),
                    position_m=thing.box.middle_m,
                )
                for thing, line in wanted
            ),
            detections=picture_detections(found),
            ignored_px=tuple(to_edge_pixels(box) for box in ignored),
            is_in_place=is_in_place([line for _, line in wanted], found),
        )

    def encode_prediction(self, sample: Stereo3dSample, prediction: Sequence[KittiLabel], info: SplitInfo) -> Encoded:
        """Encodes the detections (`prediction`) of one `sample` as KITTI's result file; `info` is not used."""
        lines = results.kitti_result_lines(prediction)
        return Encoded(files={results.kitti_object_path(sample.record.index): lines}, facts={})

    def decode_prediction(
        self, root: Path, sample: Stereo3dSample, facts: Json, info: SplitInfo
    ) -> tuple[KittiLabel, ...]:
        """Reads a `sample`'s detections from KITTI's result file in `root`; other parameters are not used."""
        return parse_labels(read_bytes(root / results.kitti_object_path(sample.record.index)).decode())

    def finalise_predictions(self, facts: Sequence[tuple[SceneRecord, Json]], info: SplitInfo) -> Mapping[str, bytes]:
        """Returns no files, because the samples' result files are complete; `facts` and `info` are not used."""
        return {}

    def preview(self, sample: Stereo3dSample) -> Mapping[str, UInt8Image]:
        """Returns pictures to look at: `left` with the `sample`'s 3D boxes and (dashed) ignored regions; `right`."""
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

    def legends(self) -> Mapping[str, Legend]:
        """The colours of the preview's boxes by KITTI type, and grey for `DontCare` regions."""
        named = (*COLOURS.items(), ("other types", OTHER_COLOUR), ("DontCare", IGNORED_COLOUR))
        return {LEFT: ColourNames(entries=named)}


def _measured(
    truth: ObjectTruth, thing: SceneObject, kind: KittiType, view: View, limits: VisibilityLimits
) -> Object3d:
    """Measures an object with at least one visible pixel, by KITTI's definitions."""
    box = box_in_camera(thing, view.camera)
    box_px = from_edge_pixels(truth.pictured_box or truth.amodal_box, view.camera.intrinsics)
    left, top, right, bottom = truth.amodal_box
    return Object3d(
        object_id=truth.object_id,
        kitti_type=kind,
        is_ignored=not limits.labels(truth, box_px, box.distance_m),
        box=box,
        box_px=box_px,
        amodal_box_px=(left - 0.5, top - 0.5, right - 0.5, bottom - 0.5),
        truncated=truth.truncated_fraction,
        occluded=occlusion_level(truth.uncovered_fraction),
        visible_px=truth.visible_px,
        occluded_fraction=truth.occluded_fraction,
    )


def _notes(config: Stereo3dConfig) -> tuple[str, ...]:
    """Notes for the user on the options: with a tilted camera, 3D boxes are approximate."""
    if config.is_level:
        return ()
    return (
        "the camera is tilted (options.pitch_deg, options.roll_deg, options.follows_road), and KITTI describes a 3D "
        "box by one angle about the camera's vertical axis: 3D boxes stand upright in the camera's frame and not on "
        "the road, while 2D boxes, truncation and occlusion are exact",
    )


def _lines(sample: Stereo3dSample) -> tuple[KittiLabel, ...]:
    """The labels of a sample as the devkit reads them: rounded to two decimals, which can change a difficulty."""
    return parse_labels(format_labels(thing.label() for thing in sample.objects).decode())


def _ignored(sample: Stereo3dSample) -> tuple[BoxPx, ...]:
    return sample.ignored_px


def _name(index: int) -> str:
    return f"{index:06d}"


def flip(sample: Stereo3dSample) -> Stereo3dSample:
    """Mirrors a stereo `sample` left to right: the right camera becomes the left one. Surfaces are removed.

    Occlusion is that of the left view. The silhouette in the right picture is not stored, so its box is estimated: each
    side moves between the pictures as far as the same side of the projected 3D box does. If the picture's border cuts
    an object, the other sides of its box are those of its part in the left picture. Ignored boxes are left out.
    """
    baseline_m, intrinsics = sample.calibration.baseline_m, sample.calibration.intrinsics
    moved = (_mirrored(thing, baseline_m, intrinsics) for thing in sample.objects)
    return replace(
        sample,
        images={LEFT: flip_array(sample.images[RIGHT]), RIGHT: flip_array(sample.images[LEFT])},
        surfaces=(),
        calibration=Calibration(intrinsics=mirrored_pinhole(intrinsics), baseline_m=baseline_m),
        objects=tuple(thing for thing in moved if thing is not None),
        ignored_px=(),
    )


def _mirrored(thing: Object3d, baseline_m: float, intrinsics: Intrinsics) -> Object3d | None:
    """An object in the view of the mirrored right camera; None if the object lies outside of its picture."""
    x, y, z = thing.box.bottom_m
    turned = wrap_angle_rad(math.pi - thing.box.rotation_y_rad)
    box = replace(thing.box, bottom_m=(baseline_m - x, y, z), rotation_y_rad=turned)
    before, after = (
        project_box(thing.box.corners_m, intrinsics),
        project_box(box.corners_m, mirrored_pinhole(intrinsics)),
    )
    if before is None or after is None:
        return None
    last = intrinsics.width_px - 1.0
    boxes = [(last - b[2], b[1], last - b[0], b[3]) for b in (before, thing.box_px, thing.amodal_box_px)]
    shift = np.subtract(after, boxes[0])
    tight, whole = np.add(boxes[1], shift), np.add(boxes[2], shift)
    # Where the border cut the box, more of the silhouette may lie in the other picture.
    was_cut = np.equal(boxes[1], (0.0, 0.0, last, intrinsics.height_px - 1.0))
    frame = index_frame(intrinsics.width_px, intrinsics.height_px)
    return _placed(thing, box, box_of(np.where(was_cut, whole, tight)), box_of(whole), frame, frame)


def cut(sample: Stereo3dSample, window: Window) -> Stereo3dSample:
    """Crops both pictures of a `sample` to a `window` around their centre and resizes them; surfaces are removed.

    The calibration is adapted: sizes and distances in metres do not change, but the focal length does. The share of a
    silhouette outside the window is estimated by its box.

    Raises:
        ValueError: the window's centre is not the picture's centre, where the principal point must be.
    """
    height, width = sample.images[LEFT].shape[:2]
    if 2 * window.left_px + window.width_px != width or 2 * window.top_px + window.height_px != height:
        raise ValueError(f"a window of a stereo pair must share the picture's centre, got {window}")
    before = sample.calibration.intrinsics
    intrinsics = windowed_pinhole(before, window)
    # The rest of the window is padding.
    frame = index_frame(width, height)
    shown = clipped(cut_index_box(frame, window), index_frame(window.out_width_px, window.out_height_px))
    boxes = (clipped(cut_index_box(box, window), shown) for box in sample.ignored_px)
    area = window.scale_x * window.scale_y
    moved = (
        _placed(
            replace(thing, visible_px=round(thing.visible_px * area)),
            thing.box,
            cut_index_box(thing.box_px, window),
            cut_index_box(thing.amodal_box_px, window),
            frame,
            shown,
        )
        for thing in sample.objects
    )
    return replace(
        sample,
        images={name: cut_picture(picture, window) for name, picture in sample.images.items()},
        surfaces=(),
        calibration=Calibration(intrinsics=intrinsics, baseline_m=sample.calibration.baseline_m),
        objects=tuple(thing for thing in moved if thing is not None),
        ignored_px=tuple(box for box in boxes if box_area(box) > 0),
    )


def _placed(
    thing: Object3d, box: Box3d, box_px: BoxPx, amodal_box_px: BoxPx, frame_px: BoxPx, shown_px: BoxPx
) -> Object3d | None:
    """An object in a new picture; None if its box lies outside the picture.

    Args:
        thing: the object as measured in the old picture.
        box: 3D box of the object in the frame of the new camera.
        box_px, amodal_box_px: boxes of the object in the new picture, not clipped; index pixels.
        frame_px, shown_px: outer borders of the part of the old picture, and of the new picture, that show the scene.
    """
    left, top, right, bottom = shown_px
    inside_px = clipped(box_px, (left + 0.5, top + 0.5, right - 0.5, bottom - 0.5))
    if inside_px[2] <= inside_px[0] or inside_px[3] <= inside_px[1]:
        return None
    before, after = share_in_frame(thing.amodal_box_px, frame_px), share_in_frame(amodal_box_px, shown_px)
    inside = min(1.0, (1.0 - thing.truncated) * after / before) if before > 0 else 1.0 - thing.truncated
    return replace(thing, box=box, box_px=inside_px, amodal_box_px=amodal_box_px, truncated=1.0 - inside)


register(Stereo3dSample, Geometry(flip=flip, cut=cut, is_centred=True))


stereo3d: TaskSpec[Stereo3dConfig] = TaskSpec(
    name="stereo3d",
    summary="Stereo 3D object detection: KITTI pictures, calibration and labels by KITTI's own definitions.",
    config=Stereo3dConfig,
    build=Stereo3dTask,
    views=(LEFT, RIGHT),
    layout="<split>/{image_2,image_3,calib,label_2}/%06d.{png,txt}, splits/<split>.txt, ImageSets/<split>.txt",
    original_name="3dod",
    metric="reference.car_bev_moderate_r40",
    notes=_notes,
)


@hookimpl
def gear_tasks() -> list[TaskSpec[Stereo3dConfig]]:
    """Hook of the plugin system: returns the task plugin that this module defines."""
    return [stereo3d]
