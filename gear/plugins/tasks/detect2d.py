"""The task of 2D object detection, with files in the layout of COCO."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from gear.augment.geometry import (
    Geometry,
    Window,
    box_area,
    clipped,
    cut_box,
    cut_map,
    cut_picture,
    flip_array,
    flip_box,
)
from gear.augment.registry import register
from gear.contracts.evaluation import Masks
from gear.contracts.hookspecs import hookimpl
from gear.contracts.legends import ColourNames, Legend, Rgb
from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import Encoded, Evaluator, Indexes, Sample, Sidecar, SplitInfo
from gear.formats import coco, results, rle
from gear.formats.billboard_info import billboard_info
from gear.formats.jsontext import dump
from gear.formats.mask_polygons import with_polygons
from gear.formats.png import encode_rgb
from gear.groundtruth.boxes import box_in_camera, middle_in_camera
from gear.groundtruth.objects import observe_objects
from gear.groundtruth.regions import MOSTLY, part_boxes, share_inside
from gear.groundtruth.stray_pixels import without_strays
from gear.groundtruth.visibility import Visibility
from gear.metrics.coco_ap import CocoEvaluator
from gear.metrics.coco_reference import TallObjects
from gear.plugins.tasks.common import (
    IGNORED_COLOUR,
    CameraOptions,
    category_colour,
    check_objects,
    draw_box,
    draw_surfaces,
    expect,
    images_of,
    read_rgb,
    surfaces_of,
)
from gear.values.errors import FieldError
from gear.values.frames import Frame, UInt8Image
from gear.values.ground_truth import BoxPx
from gear.values.labels import LABELS
from gear.values.picture_objects import PictureDetection, PictureObject, PictureObjects
from gear.values.rig import Rig
from gear.values.scene import CameraRecord, SceneRecord
from gear.values.serial import Json, from_json, to_json

VIEW = "left"


@dataclass(frozen=True, slots=True, kw_only=True)
class Detect2dConfig(CameraOptions):
    """Options of 2D object detection. They include the options of `CameraOptions`.

    Attributes:
        visibility: least visible part of an object that is labelled; an object that shows less is annotated with
            `iscrowd` 1, which evaluations ignore.
        masks: how the annotation file describes single objects: `polygons` as COCO does, or run lengths (`rle`). Both
            give the same mask. Ignored objects have run lengths.
    """

    width_px: int = 1333
    height_px: int = 800
    visibility: Visibility = field(default_factory=lambda: Visibility(preset="coco"))
    masks: Literal["polygons", "rle"] = "polygons"


@dataclass(frozen=True, slots=True, kw_only=True)
class Object2d:
    """One labelled part of an object in a picture; a cyclist has two parts, a bicycle and a person.

    Boxes are (left, top, right, bottom) in edge pixels: the picture's top left corner is (0, 0).

    Attributes:
        object_id: id of the object, the same in every sample of a sequence.
        label: gear's name of the part's label.
        category_id: COCO's category id.
        is_ignored: whether too little of the object is visible for a label.
        box_px: tight box of the visible pixels. Stray pixels are left out, here and in the area and the mask.
        amodal_box_px: tight box of the whole silhouette; may exceed the picture.
        area_px: number of pixels of the mask.
        rle: run lengths of the mask for the whole picture.
        visible_fraction, occluded_fraction, truncated_fraction: visible share of the silhouette; covered share of its
            part in the picture; share outside the picture.
        distance_m: distance from the camera to the middle of the object's 3D box.
    """

    object_id: int
    label: str
    category_id: int
    is_ignored: bool
    box_px: BoxPx
    amodal_box_px: BoxPx
    area_px: int
    rle: str
    visible_fraction: float
    occluded_fraction: float
    truncated_fraction: float
    distance_m: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Detect2dSample(Sample):
    """A sample of 2D object detection: a picture with its labelled and ignored objects.

    Attributes:
        objects: labelled and ignored objects.
        ignored_px: boxes in edge pixels; a detection in them that matches no object is neither right nor wrong. Samples
            of datasets have none; `Detect2dTask.without` adds them.
    """

    objects: tuple[Object2d, ...]
    ignored_px: tuple[BoxPx, ...] = ()


class Detect2dTask:
    """The task of 2D object detection, with the options `config`; it writes `images/<split>` and `annotations`."""

    def __init__(self, config: Detect2dConfig) -> None:
        self.config = config

    def rig(self) -> Rig:
        """The camera rig of the task: one camera, `left`."""
        return Rig(cameras=(self.config.mount(VIEW),), follows_road=self.config.follows_road)

    def ground_truth(self, frame: Frame, record: SceneRecord) -> Detect2dSample:
        """Makes the sample of the scene `record` from its `frame`: all visible objects with a COCO category."""
        view, limits = frame.views[VIEW], self.config.visibility.limits()
        height, width = view.geom_id.shape
        found = []
        for truth in observe_objects(view, frame.geoms, frame.objects):
            label = LABELS[truth.label_code]
            if label.coco_id is None or truth.visible_box is None or not limits.mentions(truth):
                continue
            distance_m = box_in_camera(frame.objects[truth.object_id], view.camera).distance_m
            mask, x, y = without_strays(truth.mask)
            left, top = int(truth.visible_box[0]) + x, int(truth.visible_box[1]) + y
            rows, columns = mask.shape
            found.append(
                Object2d(
                    object_id=truth.object_id,
                    label=label.name,
                    category_id=label.coco_id,
                    is_ignored=not limits.labels(truth, truth.visible_box, distance_m),
                    box_px=(float(left), float(top), float(left + columns), float(top + rows)),
                    amodal_box_px=truth.amodal_box,
                    area_px=int(mask.sum()),
                    rle=rle.encode_crop(mask, left, top, height, width),
                    visible_fraction=round(truth.visible_fraction, 6),
                    occluded_fraction=round(truth.occluded_fraction, 6),
                    truncated_fraction=round(truth.truncated_fraction, 6),
                    distance_m=round(distance_m, 4),
                )
            )
        return Detect2dSample(
            record=record, images=images_of(frame), surfaces=surfaces_of(frame, record), objects=tuple(found)
        )

    def encode(self, sample: Detect2dSample, info: SplitInfo) -> Encoded:
        """Encodes the `sample`'s picture as a file of the split in `info`; its objects become metadata (`facts`)."""
        files = {f"images/{info.split}/{_name(sample.record.index)}": encode_rgb(sample.images[VIEW])}
        return Encoded(files=files, facts={"objects": to_json(sample.objects)})

    def finalise(self, sidecars: Sequence[Sidecar], info: SplitInfo) -> Mapping[str, bytes]:
        """Makes a split's annotation files from the metadata of all samples (`sidecars`), and poses for CARLA-GeAR."""
        return self.extend({}, 0, sidecars, info)

    def extend(self, before: Indexes, start: int, sidecars: Sequence[Sidecar], info: SplitInfo) -> Indexes:
        """Makes the files that `finalise` makes, from those of the split's first `start` samples.

        `before` holds these files' bytes by path, `sidecars` the metadata of all samples, and `info` the split's names.
        """
        place = f"annotations/{info.split}/camera_billboard_info.json"
        instances = f"annotations/instances_{info.split}.json"
        description = f"gear {info.town} {info.scene} {info.split}, patch: {info.patch_label}"
        writer = coco.DatasetWriter(description=description, created=info.created, before=before.get(instances))

        def records() -> Iterator[SceneRecord]:
            for sidecar in (sidecars[index] for index in range(start, len(sidecars))):
                writer.add(self._picture(sidecar))
                yield sidecar.record

        poses = billboard_info(
            records(), task="2dod", patch_label=info.patch_label, reference=VIEW, before=before.get(place)
        )
        annotations = writer.data()
        return {
            f"annotations/{info.split}/coco_annotations.json": annotations,
            instances: annotations,
            place: dump(poses),
        }

    def decode(self, root: Path, sidecar: Sidecar, info: SplitInfo) -> Detect2dSample:
        """Reads a sample from its metadata `sidecar` and from its picture in the dataset's folder `root`."""
        record = sidecar.record
        return Detect2dSample(
            record=record,
            images={VIEW: read_rgb(root, f"images/{info.split}/{_name(record.index)}", record, VIEW)},
            surfaces=sidecar.surfaces,
            objects=_objects(sidecar, root),
        )

    def as_prediction(self, sample: Detect2dSample) -> tuple[coco.Detection, ...]:
        """Returns the `sample`'s objects as a prediction: a detection of score 1 for each that is not ignored."""
        return tuple(
            coco.Detection(category_id=thing.category_id, box_px=thing.box_px, score=1.0)
            for thing in sample.objects
            if not thing.is_ignored
        )

    def evaluator(self) -> Evaluator[Detect2dSample, tuple[coco.Detection, ...]]:
        """A new evaluator of COCO's average precision."""
        return CocoEvaluator(self._as_shown)

    def reports(self) -> Mapping[str, Evaluator[Detect2dSample, tuple[coco.Detection, ...]]]:
        """Further evaluators by name: `reference` is the AP50 of traffic's categories for sufficiently tall objects."""
        return {"reference": TallObjects(self._as_shown)}

    def without(self, sample: Detect2dSample, masks: Masks) -> Detect2dSample:
        """Returns a copy of the sample in which what is inside the mask is ignored, as COCO ignores crowds.

        The box of each connected part of the mask is a crowd of every category: a detection that matches no object is
        ignored at a threshold t if at least the share t of its box lies in it. Objects with more than half of their
        visible pixels in the mask are ignored. `masks` holds (H, W) bool arrays by camera name.
        """
        mask = masks[VIEW]
        objects = tuple(
            replace(thing, is_ignored=thing.is_ignored or share_inside(thing.box_px, thing.rle, mask) > MOSTLY)
            for thing in sample.objects
        )
        return replace(sample, objects=objects, ignored_px=(*sample.ignored_px, *part_boxes(mask)))

    def picture_objects(self, sample: Detect2dSample, prediction: Sequence[coco.Detection]) -> PictureObjects:
        """Returns `sample`'s objects and `prediction`'s detections, to compare samples with and without a patch.

        Boxes of ignored objects are returned as regions in which no detection is a false alarm.
        """
        pinhole = sample.record.camera(VIEW).intrinsics
        return PictureObjects(
            camera=VIEW,
            objects=tuple(
                PictureObject(
                    object_id=thing.object_id,
                    label=coco.CATEGORY_NAMES[thing.category_id],
                    box_px=thing.box_px,
                    position_m=middle_in_camera(thing.amodal_box_px, thing.distance_m, pinhole),
                )
                for thing in sample.objects
                if not thing.is_ignored
            ),
            detections=tuple(
                PictureDetection(
                    label=coco.CATEGORY_NAMES[int(one.category_id)], box_px=one.box_px, score=float(one.score)
                )
                for one in prediction
            ),
            ignored_px=(*(thing.box_px for thing in sample.objects if thing.is_ignored), *sample.ignored_px),
        )

    def encode_prediction(
        self, sample: Detect2dSample, prediction: Sequence[coco.Detection], info: SplitInfo
    ) -> Encoded:
        """Returns a `sample`'s detections (`prediction`) as metadata, of which `finalise_predictions` makes a file."""
        plain = [
            coco.Detection(
                category_id=int(one.category_id),
                box_px=(float(one.box_px[0]), float(one.box_px[1]), float(one.box_px[2]), float(one.box_px[3])),
                score=float(one.score),
            )
            for one in prediction
        ]
        return Encoded(files={}, facts={"detections": to_json(plain)})

    def decode_prediction(
        self, root: Path, sample: Detect2dSample, facts: Json, info: SplitInfo
    ) -> tuple[coco.Detection, ...]:
        """Reads a sample's stored detections from the metadata `facts`; the other parameters are not used."""
        return from_json(tuple[coco.Detection, ...], facts["detections"], "detections")

    def finalise_predictions(self, facts: Sequence[tuple[SceneRecord, Json]], info: SplitInfo) -> Mapping[str, bytes]:
        """Makes COCO's results file of the split in `info`, from each sample's record and metadata (`facts`)."""
        lines = [
            line
            for record, one in facts
            for line in coco.results_json(
                _image_id(record), from_json(tuple[coco.Detection, ...], one["detections"], "detections")
            )
        ]
        return {results.coco_path(info.split): dump(lines)}

    def preview(self, sample: Detect2dSample) -> Mapping[str, UInt8Image]:
        """Returns the `sample`'s picture to look at, as `boxes`: with masks and boxes, ignored objects dashed."""
        picture = sample.images[VIEW].copy()
        height, width = picture.shape[:2]
        for thing in sample.objects:
            colour = _colour(thing)
            inside = rle.decode(thing.rle, height, width)
            picture[inside] = (picture[inside] * 0.6 + np.array(colour) * 0.4).astype(np.uint8)
            left, top, right, bottom = thing.box_px
            name = coco.CATEGORY_NAMES[thing.category_id]
            text = "" if thing.is_ignored else f"{name} {thing.visible_fraction:.0%}"
            draw_box(picture, (left, top, right - 1, bottom - 1), colour, text, dashed=thing.is_ignored)
        draw_surfaces(picture, sample, VIEW)
        return {"boxes": picture}

    def legends(self) -> Mapping[str, Legend]:
        """The colours of the preview: one for each category in gear's towns, and grey for ignored objects."""
        occurring = sorted({label.coco_id for label in LABELS if label.coco_id is not None})
        named = tuple((coco.CATEGORY_NAMES[one], category_colour(one)) for one in occurring)
        return {"boxes": ColourNames(entries=(*named, ("ignored", IGNORED_COLOUR)))}

    def _picture(self, sidecar: Sidecar) -> coco.Picture:
        picture = self._as_picture(sidecar.record, _objects(sidecar, Path()))
        if self.config.masks == "rle":
            return picture
        return replace(picture, annotations=tuple(with_polygons(one, picture) for one in picture.annotations))

    def _as_shown(self, sample: Detect2dSample) -> coco.Picture:
        """The COCO entry of a sample whose picture may be smaller than the rendered one."""
        height, width = sample.images[VIEW].shape[:2]
        picture = self._as_picture(sample.record, sample.objects)
        return replace(picture, height_px=height, width_px=width, ignored_px=sample.ignored_px)

    def _as_picture(self, record: SceneRecord, objects: tuple[Object2d, ...]) -> coco.Picture:
        camera = record.camera(VIEW)
        return coco.Picture(
            id=_image_id(record),
            file_name=_name(record.index),
            height_px=camera.height_px,
            width_px=camera.width_px,
            annotations=tuple(_annotation(thing, camera) for thing in objects),
        )


def _image_id(record: SceneRecord) -> int:
    """COCO's picture id of a sample, counted from 1, because some readers take 0 for "none"."""
    return record.index + 1


def _name(index: int) -> str:
    return f"rgb_{index:04d}.png"


def _objects(sidecar: Sidecar, root: Path) -> tuple[Object2d, ...]:
    facts = expect(sidecar.facts, "objects", place=root)
    objects = from_json(tuple[Object2d, ...], facts["objects"], "objects")
    check_objects(facts["objects"], (thing.box_px for thing in objects))
    camera = next((camera for camera in sidecar.record.cameras if camera.name == VIEW), None)
    if camera is None:
        raise FieldError("objects", f"are of camera {VIEW!r}, which the record has not")
    for place, thing in enumerate(objects):
        if thing.category_id not in coco.CATEGORY_NAMES:
            raise FieldError(f"objects[{place}].category_id", f"{thing.category_id} is no category of COCO")
        try:
            rle.check(thing.rle, camera.height_px, camera.width_px)
        except ValueError as error:
            raise FieldError(f"objects[{place}].rle", str(error)) from error
    return objects


def _annotation(thing: Object2d, camera: CameraRecord) -> coco.Annotation:
    left, top, right, bottom = thing.box_px
    x0, y0, x1, y1 = thing.amodal_box_px
    return coco.Annotation(
        category_id=thing.category_id,
        box_xywh=(left, top, right - left, bottom - top),
        area_px=thing.area_px,
        rle=thing.rle,
        is_crowd=thing.is_ignored,
        extras={
            "object_id": thing.object_id,
            "label": thing.label,
            "amodal_bbox": [x0, y0, x1 - x0, y1 - y0],
            "visible_fraction": thing.visible_fraction,
            "occluded_fraction": thing.occluded_fraction,
            "truncated_fraction": thing.truncated_fraction,
            "distance_m": thing.distance_m,
        },
    )


def _colour(thing: Object2d) -> Rgb:
    return IGNORED_COLOUR if thing.is_ignored else category_colour(thing.category_id)


LEAST_KEPT = 0.3
"""A cropped object with a smaller share of its visible pixels inside the window is ignored."""

LEAST_SIDE_PX = 4.0
"""A cropped object whose box in the window has a shorter side, in pixels, is ignored."""


def flip(sample: Detect2dSample) -> Detect2dSample:
    """Returns the `sample` mirrored left to right: picture, boxes and masks; surfaces are removed."""
    height, width = sample.images[VIEW].shape[:2]
    return replace(
        sample,
        images={name: flip_array(picture) for name, picture in sample.images.items()},
        surfaces=(),
        objects=tuple(_flipped(thing, height, width) for thing in sample.objects),
        ignored_px=tuple(flip_box(box, width) for box in sample.ignored_px),
    )


def _flipped(thing: Object2d, height: int, width: int) -> Object2d:
    left, top, right, bottom = (round(v) for v in thing.box_px)
    mask = rle.decode(thing.rle, height, width)[top:bottom, left:right]
    return replace(
        thing,
        box_px=flip_box(thing.box_px, width),
        amodal_box_px=flip_box(thing.amodal_box_px, width),
        rle=rle.encode_crop(flip_array(mask), width - right, top, height, width),
    )


def cut(sample: Detect2dSample, window: Window) -> Detect2dSample:
    """Crops a `sample` to a `window` and resizes it; surfaces are removed.

    Objects outside the window are left out; objects with a small part inside are ignored. Boxes are measured again on
    the cropped masks; the share of a silhouette outside the window is estimated by its box.
    """
    height, width = sample.images[VIEW].shape[:2]
    moved = (_cut(thing, window, height, width) for thing in sample.objects)
    boxes = (_inside(cut_box(box, window), window.out_height_px, window.out_width_px) for box in sample.ignored_px)
    return replace(
        sample,
        images={name: cut_picture(picture, window) for name, picture in sample.images.items()},
        surfaces=(),
        objects=tuple(thing for thing in moved if thing is not None),
        ignored_px=tuple(box for box in boxes if box_area(box) > 0),
    )


def _cut(thing: Object2d, window: Window, height: int, width: int) -> Object2d | None:
    out_height, out_width = window.out_height_px, window.out_width_px
    if box_area(_inside(cut_box(thing.box_px, window), out_height, out_width)) <= 0:
        return None
    mask = cut_map(rle.decode(thing.rle, height, width).astype(np.uint8), window, 0).astype(np.bool_)
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not rows.size:
        return None
    left, top, right, bottom = int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1
    area = int(mask.sum())
    # A window beyond the picture shows padding there, and nothing of the object's part outside the picture.
    in_picture = _inside(thing.amodal_box_px, height, width)
    pictured = box_area(in_picture) * window.scale_x * window.scale_y
    in_window = box_area(_inside(cut_box(in_picture, window), out_height, out_width))
    shown = min(1.0, in_window / pictured) if pictured > 0 else 0.0
    kept = min(1.0, area / (thing.area_px * window.scale_x * window.scale_y))
    visible, inside = thing.visible_fraction * kept, (1 - thing.truncated_fraction) * shown
    return replace(
        thing,
        is_ignored=thing.is_ignored or kept < LEAST_KEPT or min(right - left, bottom - top) < LEAST_SIDE_PX,
        box_px=(float(left), float(top), float(right), float(bottom)),
        amodal_box_px=cut_box(thing.amodal_box_px, window),
        area_px=area,
        rle=rle.encode_crop(mask[top:bottom, left:right], left, top, out_height, out_width),
        visible_fraction=visible,
        occluded_fraction=min(1.0, max(0.0, 1 - visible / inside)) if inside > 0 else 1.0,
        truncated_fraction=1 - inside,
    )


def _inside(box_px: BoxPx, height: int, width: int) -> BoxPx:
    return clipped(box_px, (0.0, 0.0, float(width), float(height)))


register(Detect2dSample, Geometry(flip=flip, cut=cut))


detect2d: TaskSpec[Detect2dConfig] = TaskSpec(
    name="detect2d",
    summary="2D object detection: COCO boxes and masks with how much of each object is seen.",
    config=Detect2dConfig,
    build=Detect2dTask,
    views=(VIEW,),
    layout="images/<split>/rgb_%04d.png, annotations/<split>/coco_annotations.json, annotations/instances_<split>.json",
    original_name="2dod",
    metric="ap50",
)


@hookimpl
def gear_tasks() -> list[TaskSpec[Detect2dConfig]]:
    """Hook of the plugin system: returns the task plugin that this module defines."""
    return [detect2d]
