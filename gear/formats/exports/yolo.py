"""Export to the YOLO layout that Ultralytics reads: `data.yaml`, pictures, and one text file of labels per picture."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from gear.formats.coco import CATEGORIES
from gear.formats.exports.layout import ExportSplit, Layout, Read, Tree
from gear.formats.mask_polygons import joined_polygons, mask_polygons
from gear.formats.rle import decode_crop
from gear.values.errors import DatasetError
from gear.values.serial import Json

DIGITS = 6
"""Number of decimals of coordinates. Coordinates are shares of the picture's size, so the step is a thousandth of a
pixel in a picture of 1000 pixels.
"""

CLASS_OF = {category["id"]: number for number, category in enumerate(CATEGORIES)}
"""Class number by COCO's category id: 0 to 79 in COCO's order, as in the `coco.yaml` of Ultralytics."""


@dataclass(frozen=True, slots=True, kw_only=True)
class YoloOptions:
    """Options of the export to the YOLO layout.

    Attributes:
        labels: `boxes` for detection, or `polygons` of the masks for the `-seg` models.
    """

    labels: Literal["boxes", "polygons"] = "boxes"


def yolo_tree(splits: Sequence[ExportSplit], read: Read, options: YoloOptions) -> Tree:
    """The files of a detect2d dataset in the YOLO layout: `images/<split>/`, `labels/<split>/` and `data.yaml`.

    Objects that COCO's evaluation ignores (`iscrowd` 1) are left out, because the YOLO format cannot mark them. A
    picture without objects has an empty label file.

    Args:
        splits: the finished splits of the dataset.
        read: function that returns the bytes of a file of the dataset, by path relative to its root.
        options: options of this layout.

    Raises:
        DatasetError: an annotation belongs to no picture.
    """
    for split in splits:
        name = split.info.split
        index = f"annotations/instances_{name}.json"
        content = json.loads(read(index))
        lines: dict[int, list[str]] = {picture["id"]: [] for picture in content["images"]}
        sizes = {picture["id"]: (picture["width"], picture["height"]) for picture in content["images"]}
        for annotation in content["annotations"]:
            if not annotation["iscrowd"]:
                picture = annotation["image_id"]
                if picture not in lines:
                    problem = f"has an annotation of picture {picture!r}, which is not in its list `images`"
                    raise DatasetError(index, f"{problem}; collect the split again")
                lines[picture].append(_line(annotation, *sizes[picture], options))
        for picture in content["images"]:
            file = picture["file_name"]
            yield f"images/{name}/{file}", read(f"images/{name}/{file}")
            stem = file.rpartition(".")[0]
            yield f"labels/{name}/{stem}.txt", "".join(lines[picture["id"]]).encode()
    yield "data.yaml", _data_yaml([split.info.split for split in splits])


def _line(annotation: Json, width_px: int, height_px: int, options: YoloOptions) -> str:
    """One object: its class, then centre and size of its box, or the corners of its polygon, as shares of the picture.

    Several pieces of one object become one polygon, because a line is one object.
    """
    left, top, width, height = annotation["bbox"]
    if options.labels == "boxes":
        numbers = [(left + width / 2) / width_px, (top + height / 2) / height_px, width / width_px, height / height_px]
    else:
        sides = (width_px, height_px)
        corners = joined_polygons(_polygons(annotation, width_px, height_px))
        numbers = [value / sides[place % 2] for place, value in enumerate(corners)]
    text = " ".join(f"{number:.{DIGITS}f}" for number in numbers)
    return f"{CLASS_OF[annotation['category_id']]} {text}\n"


def _polygons(annotation: Json, width_px: int, height_px: int) -> list[list[int]]:
    """The polygons of a mask, also where the dataset has run lengths (`options.masks=rle`)."""
    segmentation = annotation["segmentation"]
    if isinstance(segmentation, list):
        return segmentation
    left, top, width, height = (round(side) for side in annotation["bbox"])
    mask = decode_crop(segmentation["counts"], height_px, width_px, (left, top, left + width, top + height))
    return mask_polygons(mask, left, top)


def _data_yaml(splits: Sequence[str]) -> bytes:
    """The file that Ultralytics is given. Paths are relative to the folder of the file.

    Ultralytics demands `train` and `val`; where the dataset lacks one of them, its first split stands there.
    """
    named = {"train": splits[0], "val": splits[0]} | {name: name for name in splits}
    lines = [f"{key}: images/{split}" for key, split in sorted(named.items())]
    names = [f"  {number}: {category['name']}" for number, category in enumerate(CATEGORIES)]
    return "\n".join([*lines, "names:", *names, ""]).encode()


LAYOUT = Layout(
    tasks=("detect2d",),
    summary="YOLO (Ultralytics): data.yaml, images/, labels/ with boxes or polygons",
    tree=yolo_tree,
    options=YoloOptions,
)
