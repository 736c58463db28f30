"""What a network that was trained on photographs detects in gear's pictures: AP50 of people and of vehicles.

    python benchmarks/photographs.py WEIGHTS DATASET [DATASET ...]

WEIGHTS is the file that `gear weights convert nanodet_coco` writes, DATASET a dataset of task detect2d. Counted are
objects at least 48 px high of which at least half is visible; smaller or more hidden ones are neither hits nor false
alarms. Car, bus and truck count as one class. AP50 is pycocotools'.
"""

from __future__ import annotations

import argparse
import contextlib
import io
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

import gear
from gear.networks.detection.options import OfficialDetectorOptions
from gear.plugins.models.nanodet_coco import build

PEOPLE, VEHICLES = (1,), (3, 6, 8)
"""COCO's category ids of person; and of car, bus, truck."""

LEAST_HEIGHT_PX = 48
LEAST_VISIBLE = 0.5
LEAST_SCORE = 0.3
"""Score from which a detection counts for recall."""


def ground_truth_of(samples: Iterable[Any], categories: tuple[int, ...]) -> dict[str, Any]:
    """COCO's ground truth of one class that joins several categories; objects that do not count are ignored."""
    found: list[dict[str, Any]] = []
    pictures = []
    for number, sample in enumerate(samples, start=1):
        pictures.append({"id": number})
        for thing in sample.objects:
            left, top, right, bottom = thing.box_px
            if thing.category_id not in categories:
                continue
            counts = bottom - top >= LEAST_HEIGHT_PX and thing.visible_fraction >= LEAST_VISIBLE
            found.append(
                {
                    "id": len(found) + 1,
                    "image_id": number,
                    "category_id": 1,
                    "bbox": [left, top, right - left, bottom - top],
                    "area": (right - left) * (bottom - top),
                    "iscrowd": int(not counts or thing.is_ignored),
                }
            )
    return {"images": pictures, "annotations": found, "categories": [{"id": 1}], "info": {}}


def results_of(predictions: Iterable[Any], categories: tuple[int, ...]) -> list[dict[str, Any]]:
    """COCO's results of one class that joins several categories."""
    return [
        {
            "image_id": number,
            "category_id": 1,
            "bbox": [left, top, right - left, bottom - top],
            "score": each.score,
        }
        for number, found in enumerate(predictions, start=1)
        for each in found
        if each.category_id in categories
        for left, top, right, bottom in [each.box_px]
    ]


def ap50(truth: dict[str, Any], results: list[dict[str, Any]]) -> tuple[float, float, int]:
    """AP50, recall of detections from `LEAST_SCORE`, and the number of objects that count."""
    with contextlib.redirect_stdout(io.StringIO()):
        coco = COCO()
        coco.dataset = truth
        coco.createIndex()
        values = []
        for chosen in (results, [each for each in results if each["score"] >= LEAST_SCORE]):
            run = COCOeval(coco, coco.loadRes(chosen), "bbox")
            run.params.iouThrs = np.array([0.5])
            run.evaluate()
            run.accumulate()
            values.append((run.eval["precision"][0, :, 0, 0, -1].mean(), run.eval["recall"][0, 0, 0, -1]))
    count = sum(not each["iscrowd"] for each in truth["annotations"])
    return float(values[0][0]), float(values[1][1]), count


def main() -> None:
    """Prints one line for each dataset."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("weights", metavar="WEIGHTS")
    parser.add_argument("datasets", nargs="+", metavar="DATASET")
    args = parser.parse_args()
    model = build(OfficialDetectorOptions(weights=args.weights))
    print("dataset | people AP50 (n, recall) | vehicles AP50 (n, recall)")
    for root in args.datasets:
        dataset = gear.open_dataset(root)
        samples = [dataset[index] for index in range(len(dataset))]
        found = [model.predict(sample.images) for sample in samples]
        cells = []
        for categories in (PEOPLE, VEHICLES):
            value, recall, count = ap50(ground_truth_of(samples, categories), results_of(found, categories))
            cells.append(f"{value:.3f} ({count}, {recall:.2f})")
        print(f"{Path(root).name} | {cells[0]} | {cells[1]}", flush=True)


if __name__ == "__main__":
    main()
