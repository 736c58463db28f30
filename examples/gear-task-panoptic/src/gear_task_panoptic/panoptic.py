"""The task: segments from the id buffer, files of COCO panoptic, panoptic quality."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from gear.contracts.evaluation import Masks
from gear.contracts.tasks import Encoded, Sample, Sidecar, SplitInfo
from gear.formats.cityscapes import INSTANCE_FACTOR, LABELS, colour_map
from gear.formats.png import encode_rgb
from gear.groundtruth.label_maps import instance_map
from gear.plugins.tasks.common import draw_surfaces, expect, images_of, read_rgb, surfaces_of
from gear.values.frames import Frame, UInt8Image
from gear.values.rig import Rig
from gear.values.scene import SceneRecord

from gear_task_panoptic.quality import VOID, IdMap, Panoptic, QualityEvaluator, Segment

if TYPE_CHECKING:
    from gear_task_panoptic import PanopticConfig

VIEW = "left"
THINGS = frozenset(label.id for label in LABELS if label.has_instances and label.is_evaluated)
EVALUATED = frozenset(label.id for label in LABELS if label.is_evaluated)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PanopticSample(Sample):
    """A picture with its segments.

    Attributes:
        panoptic: ids are Cityscapes instance ids: label id * 1000 + number, or the label id alone for stuff.
    """

    panoptic: Panoptic


class PanopticTask:
    """Pictures in `images`, id maps in `annotations/panoptic_<split>`, and COCO panoptic's JSON."""

    def __init__(self, config: PanopticConfig) -> None:
        self.config = config

    def rig(self) -> Rig:
        """One camera on the ego car."""
        return Rig(cameras=(self.config.mount(VIEW),), follows_road=self.config.follows_road)

    def ground_truth(self, frame: Frame, record: SceneRecord) -> PanopticSample:
        """Segments from the id buffer; classes that Cityscapes does not evaluate are void."""
        instances = instance_map(frame.views[VIEW].geom_id, frame.geoms, frame.objects)
        return PanopticSample(
            record=record,
            images=images_of(frame),
            surfaces=surfaces_of(frame, record),
            panoptic=as_panoptic(instances),
        )

    def encode(self, sample: PanopticSample, info: SplitInfo) -> Encoded:
        """The picture, and the id map as colours: R + 256 G + 65536 B."""
        image, labels = _paths(info.split, sample.record.index)
        files = {image: encode_rgb(sample.images[VIEW]), labels: encode_rgb(id_to_rgb(sample.panoptic.ids))}
        return Encoded(files=files, facts={"segments_info": segments_info(sample.panoptic)})

    def finalise(self, sidecars: Sequence[Sidecar], info: SplitInfo) -> Mapping[str, bytes]:
        """The index file of a split: COCO panoptic's JSON."""
        images, annotations = [], []
        for sidecar in sidecars:
            record = sidecar.record
            camera, name = record.camera(VIEW), f"{record.index:06d}.png"
            size = {"width": camera.width_px, "height": camera.height_px}
            images.append({"id": record.index + 1, "file_name": name, **size})
            infos = expect(sidecar.facts, "segments_info", place=Path(name))["segments_info"]
            annotations.append({"image_id": record.index + 1, "file_name": name, "segments_info": infos})
        categories = [
            {
                "id": label.id,
                "name": label.name,
                "supercategory": label.category,
                "isthing": int(label.id in THINGS),
                "color": list(label.rgb),
            }
            for label in LABELS
            if label.is_evaluated
        ]
        table = {"images": images, "annotations": annotations, "categories": categories}
        return {f"annotations/panoptic_{info.split}.json": (json.dumps(table, indent=1) + "\n").encode()}

    def decode(self, root: Path, sidecar: Sidecar, info: SplitInfo) -> PanopticSample:
        """Reads a sample back from its files."""
        image, labels = _paths(info.split, sidecar.record.index)
        infos = expect(sidecar.facts, "segments_info", place=root / labels)["segments_info"]
        segments = tuple(
            Segment(id=one["id"], category_id=one["category_id"], is_crowd=bool(one["iscrowd"])) for one in infos
        )
        return PanopticSample(
            record=sidecar.record,
            images={VIEW: read_rgb(root, image)},
            surfaces=sidecar.surfaces,
            panoptic=Panoptic(ids=rgb_to_id(read_rgb(root, labels)), segments=segments),
        )

    def as_prediction(self, sample: PanopticSample) -> Panoptic:
        """The ground-truth segments as a perfect prediction."""
        return sample.panoptic

    def evaluator(self) -> QualityEvaluator:
        """A fresh, empty evaluator of panoptic quality."""
        return QualityEvaluator(THINGS)

    def without(self, sample: PanopticSample, masks: Masks) -> PanopticSample:
        """The sample with void inside the mask; segments that lie inside completely are removed."""
        ids = np.where(masks[VIEW], np.int32(VOID), sample.panoptic.ids)
        left = set(np.unique(ids).tolist())
        segments = tuple(segment for segment in sample.panoptic.segments if segment.id in left)
        return replace(sample, panoptic=Panoptic(ids=ids, segments=segments))

    def encode_prediction(self, sample: PanopticSample, prediction: Panoptic, info: SplitInfo) -> Encoded:
        """The id map as colours; the facts keep the segments for the result file of the split."""
        segments = [[one.id, one.category_id, int(one.is_crowd)] for one in prediction.segments]
        path = f"panoptic/{sample.record.index:06d}.png"
        return Encoded(files={path: encode_rgb(id_to_rgb(prediction.ids))}, facts={"segments": segments})

    def decode_prediction(self, root: Path, sample: PanopticSample, facts: Any, info: SplitInfo) -> Panoptic:
        """Reads predicted segments back from their files."""
        ids = rgb_to_id(read_rgb(root, f"panoptic/{sample.record.index:06d}.png"))
        segments = tuple(Segment(id=i, category_id=c, is_crowd=bool(crowd)) for i, c, crowd in facts["segments"])
        return Panoptic(ids=ids, segments=segments)

    def finalise_predictions(self, facts: Sequence[tuple[SceneRecord, Any]], info: SplitInfo) -> Mapping[str, bytes]:
        """The result file of a split in the format of COCO panoptic."""
        annotations = [
            {
                "image_id": record.index + 1,
                "file_name": f"{record.index:06d}.png",
                "segments_info": [{"id": i, "category_id": category} for i, category, _ in one["segments"]],
            }
            for record, one in facts
        ]
        return {"panoptic.json": (json.dumps({"annotations": annotations}, indent=1) + "\n").encode()}

    def preview(self, sample: PanopticSample) -> Mapping[str, UInt8Image]:
        """The picture with class colours over it and white borders between segments: (H, W, 3) uint8."""
        ids = sample.panoptic.ids
        labels = np.where(ids >= INSTANCE_FACTOR, ids // INSTANCE_FACTOR, ids).astype(np.uint8)
        mixed = 0.45 * sample.images[VIEW] + 0.55 * colour_map(labels)[..., :3]
        picture: UInt8Image = np.rint(mixed).astype(np.uint8)
        edge = np.zeros(ids.shape, np.bool_)
        edge[:, 1:] |= ids[:, 1:] != ids[:, :-1]
        edge[1:] |= ids[1:] != ids[:-1]
        picture[edge] = 255
        draw_surfaces(picture, sample, VIEW)
        return {"segments": picture}


def as_panoptic(instances: npt.NDArray[np.uint16]) -> Panoptic:
    """Segments of a Cityscapes instance map."""
    ids: IdMap = instances.astype(np.int32)
    segments = []
    for value in np.unique(ids).tolist():
        label = value // INSTANCE_FACTOR if value >= INSTANCE_FACTOR else value
        if label in EVALUATED:
            is_crowd = label in THINGS and value < INSTANCE_FACTOR
            segments.append(Segment(id=value, category_id=label, is_crowd=is_crowd))
        else:
            ids[ids == value] = VOID
    return Panoptic(ids=ids, segments=tuple(segments))


def segments_info(panoptic: Panoptic) -> list[dict[str, Any]]:
    """As in COCO panoptic: id, category, area, box (left, top, width, height) and whether it is a crowd."""
    infos = []
    for segment in panoptic.segments:
        rows, columns = np.nonzero(panoptic.ids == segment.id)
        left, top = int(columns.min()), int(rows.min())
        box = [left, top, int(columns.max()) - left + 1, int(rows.max()) - top + 1]
        infos.append(
            {
                "id": segment.id,
                "category_id": segment.category_id,
                "area": len(rows),
                "bbox": box,
                "iscrowd": int(segment.is_crowd),
            }
        )
    return infos


def id_to_rgb(ids: IdMap) -> UInt8Image:
    """(H, W, 3) uint8 whose R + 256 G + 65536 B is the id."""
    return np.stack([ids & 255, ids >> 8 & 255, ids >> 16 & 255], axis=-1).astype(np.uint8)


def rgb_to_id(rgb: UInt8Image) -> IdMap:
    """(H, W) int32 ids from (H, W, 3) uint8 colours: R + 256 G + 65536 B."""
    wide = rgb.astype(np.int32)
    ids: IdMap = wide[..., 0] + (wide[..., 1] << 8) + (wide[..., 2] << 16)
    return ids


def _paths(split: str, index: int) -> tuple[str, str]:
    return f"images/{split}/{index:06d}.png", f"annotations/panoptic_{split}/{index:06d}.png"
