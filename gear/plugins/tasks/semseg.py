"""The task of semantic segmentation, with files in the layout of Cityscapes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from gear.augment.geometry import Geometry, Window, cut_map, cut_picture, flip_array
from gear.augment.registry import register
from gear.contracts.evaluation import Masks
from gear.contracts.hookspecs import hookimpl
from gear.contracts.legends import ColourNames, Legend
from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import Encoded, Evaluator, Indexes, Sample, Sidecar, SplitInfo
from gear.formats import cityscapes, results
from gear.formats.billboard_info import billboard_info
from gear.formats.cityscapes_polygons import polygons_json
from gear.formats.jsontext import dump
from gear.formats.label_png import encode_label_map, encode_painted
from gear.formats.pixel_runs import Runs
from gear.formats.png import encode_rgb
from gear.groundtruth.label_maps import coarsen, instance_map, label_map
from gear.metrics.critical_classes import CRITICAL, CriticalClasses
from gear.metrics.semantic import PresentClasses, SemanticEvaluator
from gear.plugins.tasks.common import (
    CameraOptions,
    draw_surfaces,
    images_of,
    read_map,
    read_plain,
    read_rgb,
    surfaces_of,
)
from gear.values.errors import FieldError
from gear.values.frames import Frame, UInt8Image
from gear.values.rig import Rig
from gear.values.scene import SceneRecord
from gear.values.serial import Json

VIEW = "left"


@dataclass(frozen=True, slots=True, kw_only=True)
class LabelOptions:
    """The option for how fine the labels are.

    Attributes:
        granularity: `fine` labels each pixel by what it shows. `coarse` imitates an annotator with a polygon tool: each
            pixel takes the most frequent label in a square around it, so thin poles, wires, single leaves and the sky
            between twigs take the label of their surroundings.
        coarse_window_px: side of that square, odd; objects thinner than about half of it vanish.
    """

    granularity: Literal["fine", "coarse"] = "fine"
    coarse_window_px: int = 9

    def __post_init__(self) -> None:
        if not 3 <= self.coarse_window_px <= 101 or self.coarse_window_px % 2 == 0:
            raise FieldError("coarse_window_px", f"must be odd and 3 to 101, got {self.coarse_window_px}")


@dataclass(frozen=True, slots=True, kw_only=True)
class SemsegConfig(CameraOptions):
    """Options of semantic segmentation. They include the options of `CameraOptions`.

    Attributes:
        labels: granularity of the labels.
        polygons: whether to write polygon files too (about two fifths of the task's own time).
    """

    width_px: int = 2048
    height_px: int = 1024
    labels: LabelOptions = field(default_factory=LabelOptions)
    polygons: bool = True


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SemsegSample(Sample):
    """A sample of semantic segmentation: a picture with its label map and instance map.

    Attributes:
        label_ids: (H, W) uint8, Cityscapes ids 0..33.
        instance_ids: (H, W) uint16: label id * 1000 + number for single instances, the label id for other pixels.
    """

    label_ids: npt.NDArray[np.uint8]
    instance_ids: npt.NDArray[np.uint16]


class SemsegTask:
    """The task of semantic segmentation; it writes Cityscapes' folders `leftImg8bit`, `gtFine` and `camera`.

    Args:
        config: options of the task.
    """

    def __init__(self, config: SemsegConfig) -> None:
        self.config = config

    def rig(self) -> Rig:
        """The camera rig of the task: one camera, `left`."""
        return Rig(cameras=(self.config.mount(VIEW),), follows_road=self.config.follows_road)

    def ground_truth(self, frame: Frame, record: SceneRecord) -> SemsegSample:
        """Makes a sample from a rendered frame: labels and instances come from the rendered geom ids.

        Args:
            frame: the rendered views of the scene, with geom ids.
            record: the scene.
        """
        instances = instance_map(frame.views[VIEW].geom_id, frame.geoms, frame.objects)
        if self.config.labels.granularity == "coarse":
            instances = coarsen(instances, self.config.labels.coarse_window_px)
        return SemsegSample(
            record=record,
            images=images_of(frame),
            surfaces=surfaces_of(frame, record),
            label_ids=label_map(instances),
            instance_ids=instances,
        )

    def encode(self, sample: SemsegSample, info: SplitInfo) -> Encoded:
        """Encodes picture, label map, instance map, colours, polygons (if the option is set) and camera.

        Args:
            sample: the sample with its ground truth.
            info: names of the split, town and scene, for paths.
        """
        record = sample.record
        paths = cityscapes.paths(info.town, info.split, record.sequence, record.frame)
        world_from_vehicle = record.ego.world_from_actor.transform("world", "ego")
        camera = cityscapes.camera_json(record.camera(VIEW), world_from_vehicle, baseline_m=0.0)
        files = {
            paths.image: encode_rgb(sample.images[VIEW]),
            paths.label_ids: encode_label_map(sample.label_ids),
            paths.instance_ids: encode_label_map(sample.instance_ids),
            paths.colour: encode_painted(sample.label_ids, cityscapes.COLOURS_RGBA),
            paths.camera: dump(camera),
        }
        if self.config.polygons:
            files[paths.polygons] = dump(polygons_json(sample.instance_ids))
        counts = Runs.of(sample.label_ids).counts(len(cityscapes.LABELS))
        present = {cityscapes.LABELS[i].name: int(counts[i]) for i in np.flatnonzero(counts)}
        return Encoded(files=files, facts={"label_px": present})

    def finalise(self, sidecars: Sequence[Sidecar], info: SplitInfo) -> Mapping[str, bytes]:
        """Makes the file of a whole split: the poses that CARLA-GeAR's loader reads.

        Args:
            sidecars: metadata of all samples of the split, in order.
            info: names of the split, town, scene and patch.
        """
        return self.extend({}, 0, sidecars, info)

    def extend(self, before: Indexes, start: int, sidecars: Sequence[Sidecar], info: SplitInfo) -> Indexes:
        """Makes the files of a whole split from those of its first samples; used when samples are added to a
        dataset.

        Args:
            before: contents of the split's files after the first `start` samples, by path; {} for none.
            start: number of samples that `before` contains.
            sidecars: metadata of all samples of the split, in order.
            info: names of the split, town, scene and patch.

        Returns:
            Contents of the files by path below the dataset's root.
        """
        place = f"gtFine/{info.split}/camera_billboard_info.json"
        records = (sidecars[index].record for index in range(start, len(sidecars)))
        poses = billboard_info(
            records, task="ss", patch_label=info.patch_label, reference=VIEW, before=before.get(place)
        )
        return {place: dump(poses)}

    def decode(self, root: Path, sidecar: Sidecar, info: SplitInfo) -> SemsegSample:
        """Reads a sample from its files: the picture, the label map and the instance map.

        Args:
            root: root folder of the dataset.
            sidecar: metadata of the sample.
            info: names of the split, town and scene, for paths.
        """
        record = sidecar.record
        paths = cityscapes.paths(info.town, info.split, record.sequence, record.frame)
        return SemsegSample(
            record=record,
            images={VIEW: read_rgb(root, paths.image, record, VIEW)},
            surfaces=sidecar.surfaces,
            label_ids=read_map(root, paths.label_ids, record, VIEW, np.uint8, len(cityscapes.LABELS) - 1),
            instance_ids=read_map(root, paths.instance_ids, record, VIEW, np.uint16),
        )

    def as_prediction(self, sample: SemsegSample) -> npt.NDArray[np.uint8]:
        """Returns the ground truth as a prediction: (H, W) uint8 label ids.

        Args:
            sample: the sample with its label map.
        """
        return sample.label_ids

    def evaluator(self) -> Evaluator[SemsegSample, npt.NDArray[np.uint8]]:
        """A new evaluator of mIoU and iIoU, as in Cityscapes."""
        return SemanticEvaluator()

    def reports(self) -> Mapping[str, Evaluator[SemsegSample, npt.NDArray[np.uint8]]]:
        """Further evaluators by name: `reference` is the mIoU over the classes that occur, without the class train;
        `critical` evaluates road users, traffic lights and signs.
        """
        return {"reference": PresentClasses(), CRITICAL: CriticalClasses()}

    def without(self, sample: SemsegSample, masks: Masks) -> SemsegSample:
        """Returns a copy of the sample whose pixels inside the mask are unlabelled, so no metric counts these
        pixels.

        Args:
            sample: the sample with its label and instance maps.
            masks: (H, W) bool by camera name.
        """
        silent = masks[VIEW]
        return replace(
            sample,
            label_ids=np.where(silent, np.uint8(0), sample.label_ids),
            instance_ids=np.where(silent, np.uint16(0), sample.instance_ids),
        )

    def encode_prediction(self, sample: SemsegSample, prediction: npt.NDArray[np.uint8], info: SplitInfo) -> Encoded:
        """Encodes predicted label ids as the picture that Cityscapes' evaluation script reads.

        Args:
            sample: the sample, which gives the file name.
            prediction: (H, W) uint8 predicted label ids.
            info: names of the split, town and scene, for the path.
        """
        path = results.cityscapes_path(info.town, sample.record.sequence, sample.record.frame)
        return Encoded(files={path: encode_label_map(prediction.astype(np.uint8))}, facts={})

    def decode_prediction(
        self, root: Path, sample: SemsegSample, facts: Json, info: SplitInfo
    ) -> npt.NDArray[np.uint8]:
        """Reads a stored prediction: (H, W) uint8 label ids.

        Args:
            root: folder of the stored predictions.
            sample: the sample, which gives the file name.
            facts: metadata stored with the prediction; not used.
            info: names of the split, town and scene, for the path.
        """
        return read_plain(root, results.cityscapes_path(info.town, sample.record.sequence, sample.record.frame))

    def finalise_predictions(self, facts: Sequence[tuple[SceneRecord, Json]], info: SplitInfo) -> Mapping[str, bytes]:
        """Returns no files, because the label pictures of the samples are complete results.

        Args:
            facts: scene record and stored metadata of each sample.
            info: names of the split, town and scene.
        """
        return {}

    def preview(self, sample: SemsegSample) -> Mapping[str, UInt8Image]:
        """Returns the pictures to look at: `image` with outlined surfaces, and `labels`, the map of the labels' colours
        with white borders between instances.

        Colours are not blended with the picture: the colours of a patch would show through, and no colour would be that
        of the legend.

        Args:
            sample: the sample with its label and instance maps.
        """
        picture = sample.images[VIEW].copy()
        draw_surfaces(picture, sample, VIEW)
        return {"image": picture, "labels": _drawn(sample)}

    def prediction_preview(self, sample: SemsegSample, prediction: npt.NDArray[np.uint8]) -> Mapping[str, UInt8Image]:
        """Returns the picture to look at, as `labels`: the map of the predicted labels' colours, without instances.

        Args:
            sample: the sample, for the outlines of its surfaces.
            prediction: (H, W) predicted label ids.
        """
        shown = prediction.astype(np.uint8)
        return {"labels": _drawn(replace(sample, label_ids=shown, instance_ids=shown.astype(np.uint16)))}

    def legends(self) -> Mapping[str, Legend]:
        """The colours of the classes that Cityscapes evaluates, and of the others that gear's towns have."""
        evaluated = [(one.name, one.rgb) for one in cityscapes.LABELS if one.is_evaluated]
        others = [(f"{one.name} (not evaluated)", one.rgb) for one in cityscapes.LABELS if one.name in SHOWN_OTHERS]
        return {"labels": ColourNames(entries=(*evaluated, *others))}


SHOWN_OTHERS = ("static", "dynamic", "ground", "parking")
"""Names of classes in the legend that Cityscapes does not evaluate. A billboard is `static`, which is black."""

UNLABELLED = 0
"""Cityscapes' id of pixels without a label, such as those beyond the picture."""


def _drawn(sample: SemsegSample) -> UInt8Image:
    """Draws the colours of a sample's label map, borders between its instances, and the outlines of its surfaces.

    Returns:
        (H, W, 3) uint8 RGB.
    """
    picture = np.ascontiguousarray(cityscapes.colour_map(sample.label_ids)[..., :3])
    instances = sample.instance_ids
    edge = np.zeros(instances.shape, dtype=np.bool_)
    edge[:, 1:] |= instances[:, 1:] != instances[:, :-1]
    edge[1:] |= instances[1:] != instances[:-1]
    picture[edge & (instances >= cityscapes.INSTANCE_FACTOR)] = 255
    draw_surfaces(picture, sample, VIEW)
    return picture


def flip(sample: SemsegSample) -> SemsegSample:
    """Returns a sample that is mirrored left to right: picture, label map and instance map; surfaces are removed.

    Args:
        sample: the sample; it is not changed.
    """
    return replace(
        sample,
        images={name: flip_array(picture) for name, picture in sample.images.items()},
        surfaces=(),
        label_ids=flip_array(sample.label_ids),
        instance_ids=flip_array(sample.instance_ids),
    )


def cut(sample: SemsegSample, window: Window) -> SemsegSample:
    """Crops a sample to a window and resizes it, label maps by nearest neighbour; surfaces are removed.

    Pixels beyond the picture are unlabelled.

    Args:
        sample: the sample; it is not changed.
        window: the part to crop, and the size after resizing.
    """
    return replace(
        sample,
        images={name: cut_picture(picture, window) for name, picture in sample.images.items()},
        surfaces=(),
        label_ids=cut_map(sample.label_ids, window, UNLABELLED),
        instance_ids=cut_map(sample.instance_ids, window, UNLABELLED),
    )


register(SemsegSample, Geometry(flip=flip, cut=cut))


semseg: TaskSpec[SemsegConfig] = TaskSpec(
    name="semseg",
    summary="Semantic segmentation: Cityscapes labels, instances, polygons and cameras.",
    config=SemsegConfig,
    build=SemsegTask,
    views=(VIEW,),
    layout="{leftImg8bit,gtFine,camera}/<split>/<city>/<city>_<sequence>_<frame>_*.{png,json}",
    original_name="ss",
    metric="miou",
)


@hookimpl
def gear_tasks() -> list[TaskSpec[SemsegConfig]]:
    """Hook of the plugin system: returns the task plugin that this module defines."""
    return [semseg]
