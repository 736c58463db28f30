"""COCO: categories, annotations from masks, and the annotation file of a split."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gear.formats.jsontext import dump
from gear.values.ground_truth import BoxPx
from gear.values.run_lengths import run_lengths
from gear.values.serial import Json

SUPERCATEGORIES: tuple[tuple[str, str], ...] = (
    ("person", "1 person"),
    (
        "vehicle",
        "2 bicycle, 3 car, 4 motorcycle, 5 airplane, 6 bus, 7 train, 8 truck, 9 boat",
    ),
    ("outdoor", "10 traffic light, 11 fire hydrant, 13 stop sign, 14 parking meter, 15 bench"),
    (
        "animal",
        "16 bird, 17 cat, 18 dog, 19 horse, 20 sheep, 21 cow, 22 elephant, 23 bear, 24 zebra, 25 giraffe",
    ),
    ("accessory", "27 backpack, 28 umbrella, 31 handbag, 32 tie, 33 suitcase"),
    (
        "sports",
        "34 frisbee, 35 skis, 36 snowboard, 37 sports ball, 38 kite, 39 baseball bat, 40 baseball glove, 41 skateboard,"
        " 42 surfboard, 43 tennis racket",
    ),
    ("kitchen", "44 bottle, 46 wine glass, 47 cup, 48 fork, 49 knife, 50 spoon, 51 bowl"),
    (
        "food",
        "52 banana, 53 apple, 54 sandwich, 55 orange, 56 broccoli, 57 carrot, 58 hot dog, 59 pizza, 60 donut, 61 cake",
    ),
    ("furniture", "62 chair, 63 couch, 64 potted plant, 65 bed, 67 dining table, 70 toilet"),
    ("electronic", "72 tv, 73 laptop, 74 mouse, 75 remote, 76 keyboard, 77 cell phone"),
    ("appliance", "78 microwave, 79 oven, 80 toaster, 81 sink, 82 refrigerator"),
    ("indoor", "84 book, 85 clock, 86 vase, 87 scissors, 88 teddy bear, 89 hair drier, 90 toothbrush"),
)


def _categories() -> tuple[Json, ...]:
    found = []
    for supercategory, text in SUPERCATEGORIES:
        for item in text.split(", "):
            number, name = item.strip().split(" ", 1)
            found.append({"id": int(number), "name": name, "supercategory": supercategory})
    return tuple(found)


CATEGORIES: tuple[Json, ...] = _categories()
"""The 80 categories of COCO. All of them are written into annotation files, so detections of every COCO category are
valid.
"""

CATEGORY_NAMES: dict[int, str] = {category["id"]: category["name"] for category in CATEGORIES}
"""Name of each COCO category, by category id."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Annotation:
    """The COCO annotation of one object in one picture.

    Attributes:
        category_id: COCO's category id, 1..90.
        box_xywh: left, top, width, height in edge pixels.
        area_px: number of pixels of the mask.
        rle: compressed run lengths of the visible mask.
        is_crowd: whether evaluations ignore the object.
        extras: values for which COCO has no field, such as the distance; written under the key `gear`.
        polygons: corners `x, y, x, y, ...` in edge pixels of each polygon of the mask. Without polygons, `rle` is
            written, and for ignored objects (`is_crowd`) its uncompressed run lengths.
    """

    category_id: int
    box_xywh: tuple[float, float, float, float]
    area_px: int
    rle: str
    is_crowd: bool
    extras: Json
    polygons: Sequence[Sequence[float]] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """One picture of a split with the annotations of its objects.

    Attributes:
        id: picture id, from 1.
        file_name: path relative to the folder of the split's pictures.
        height_px, width_px: size of the picture.
        annotations: annotations of its objects.
        ignored_px: boxes, in edge pixels, of regions in which the evaluation ignores detections that match no object;
            not written to annotation files.
    """

    id: int
    file_name: str
    height_px: int
    width_px: int
    annotations: tuple[Annotation, ...]
    ignored_px: tuple[BoxPx, ...] = ()


def dataset_json(pictures: Sequence[Picture], *, description: str, created: str) -> Json:
    """The JSON content of a COCO annotation file.

    Args:
        pictures: pictures in order of id. Annotation ids count from 1 over all pictures, because pycocotools takes the
            id 0 for "no match".
        description: one line that describes the split.
        created: ISO date.
    """
    annotations: list[Json] = []
    for picture in pictures:
        annotations += _annotation_entries(picture, len(annotations) + 1)
    return {
        **_head(description, created),
        "images": [_image_entry(picture, created) for picture in pictures],
        "annotations": annotations,
        "categories": list(CATEGORIES),
    }


BETWEEN = b'],"annotations":['
"""Bytes between the pictures and the annotations of an annotation file."""


class DatasetWriter:
    """Writes a COCO annotation file picture by picture, so that only its encoded bytes are in memory.

    The bytes equal `dump(dataset_json(...))` for all pictures.
    """

    def __init__(self, *, description: str, created: str, before: bytes | None = None) -> None:
        """Starts an annotation file without pictures, or continues one.

        Args:
            description: one line that describes the split.
            created: ISO date.
            before: bytes of a file that another writer made with the same description and date; None to start one.

        Raises:
            ValueError: `before` is no such file.
        """
        self._description, self._created = description, created
        self._images: list[bytes] = []
        self._annotations: list[bytes] = []
        self._count = 0
        if before is not None:
            self._resume(before)

    def _resume(self, data: bytes) -> None:
        """Takes over the pictures and annotations of a file."""
        head, tail = self._ends()
        if not (data.startswith(head) and data.endswith(tail)):
            raise ValueError("is not an annotation file of this split")
        images, found, annotations = data[len(head) : -len(tail)].partition(BETWEEN)
        if not found:
            raise ValueError("has no annotations")
        self._images = [images] if images else []
        self._annotations = [annotations] if annotations else []
        self._count = annotations.count(b',"iscrowd":')

    def _ends(self) -> tuple[bytes, bytes]:
        """The bytes before the first picture and after the last annotation."""
        head = dump(_head(self._description, self._created)).rstrip(b"\n")[:-1]
        categories = dump(list(CATEGORIES)).rstrip(b"\n")
        return head + b',"images":[', b'],"categories":' + categories + b"}\n"

    def add(self, picture: Picture) -> None:
        """Appends the next picture and its annotations to the file.

        Args:
            picture: the picture; pictures must be added in order of their ids.
        """
        self._images.append(dump(_image_entry(picture, self._created)).rstrip(b"\n"))
        entries = _annotation_entries(picture, self._count + 1)
        self._count += len(entries)
        if entries:
            self._annotations.append(dump(entries).rstrip(b"\n")[1:-1])

    def data(self) -> bytes:
        """The bytes of the complete annotation file with all pictures added so far."""
        head, tail = self._ends()
        return b"".join((head, b",".join(self._images), BETWEEN, b",".join(self._annotations), tail))


def _head(description: str, created: str) -> dict[str, Json]:
    return {
        "info": {
            "year": int(created[:4]),
            "version": "1.0",
            "description": description,
            "contributor": "gear",
            "url": "",
            "date_created": created.replace("-", "/"),
        },
        "licenses": [{"id": 1, "name": "unspecified", "url": ""}],
    }


def _image_entry(picture: Picture, created: str) -> Json:
    return {
        "id": picture.id,
        "width": picture.width_px,
        "height": picture.height_px,
        "file_name": picture.file_name,
        "license": 1,
        "flickr_url": "",
        "coco_url": "",
        "date_captured": f"{created} 00:00:00",
    }


def _annotation_entries(picture: Picture, first_id: int) -> list[Json]:
    return [
        {
            "id": number,
            "image_id": picture.id,
            "category_id": item.category_id,
            "bbox": list(item.box_xywh),
            "area": item.area_px,
            "segmentation": _segmentation(item, picture),
            "iscrowd": int(item.is_crowd),
            "gear": item.extras,
        }
        for number, item in enumerate(picture.annotations, first_id)
    ]


def _segmentation(item: Annotation, picture: Picture) -> Json:
    """The mask in COCO's form: polygons for single objects, uncompressed run lengths for crowds.

    Tools that convert every segmentation with `pycocotools.mask.frPyObjects`, such as DETR's processors, cannot read
    the compressed run lengths of a crowd.
    """
    if item.polygons and not item.is_crowd:
        return [list(polygon) for polygon in item.polygons]
    counts = run_lengths(item.rle).tolist() if item.is_crowd else item.rle
    return {"size": [picture.height_px, picture.width_px], "counts": counts}


@dataclass(frozen=True, slots=True, kw_only=True)
class Detection:
    """One detected object.

    Attributes:
        category_id: COCO's category id, 1..90.
        box_px: left, top, right, bottom in edge pixels.
        score: confidence; a higher score is more certain.
    """

    category_id: int
    box_px: BoxPx
    score: float


def results_json(image_id: int, detections: Sequence[Detection]) -> list[Json]:
    """The detections of one picture as entries of COCO's results file.

    Args:
        image_id: COCO's id of the picture, from 1.
        detections: the detections of the picture.

    Returns:
        One entry per detection, with `image_id`, `category_id`, `bbox` (left, top, width, height) and `score`.
    """
    return [
        {
            "image_id": image_id,
            "category_id": found.category_id,
            "bbox": [
                found.box_px[0],
                found.box_px[1],
                found.box_px[2] - found.box_px[0],
                found.box_px[3] - found.box_px[1],
            ],
            "score": found.score,
        }
        for found in detections
    ]
