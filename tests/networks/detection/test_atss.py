"""ATSS against a version with plain loops, written from the paper's algorithm."""

from __future__ import annotations

import pytest
import torch

from gear.networks import torchvision_import
from gear.networks.detection.atss import BACKGROUND, NEAREST, assigned

torchvision_import.need()

STRIDES = (8, 16, 32)
SIDE_PX = 96


def grid() -> tuple[torch.Tensor, list[int]]:
    anchors, counts = [], []
    for stride in STRIDES:
        steps = (torch.arange(SIDE_PX // stride) + 0.5) * stride
        y, x = torch.meshgrid(steps, steps, indexing="ij")
        centres = torch.stack((x.flatten(), y.flatten()), dim=1)
        anchors.append(torch.cat((centres - 4 * stride, centres + 4 * stride), dim=1))
        counts.append(len(centres))
    return torch.cat(anchors), counts


def iou(a: list[float], b: list[float]) -> float:
    width = max(0.0, min(a[2], b[2]) - max(a[0], b[0]))
    height = max(0.0, min(a[3], b[3]) - max(a[1], b[1]))
    shared = width * height
    area = (a[2] - a[0]) * (a[3] - a[1]) + (b[2] - b[0]) * (b[3] - b[1])
    return shared / (area - shared)


def by_loops(boxes: list[list[float]], anchors: list[list[float]], counts: list[int]) -> list[int]:
    best = [(0.0, BACKGROUND)] * len(anchors)
    centres = [((a[0] + a[2]) / 2, (a[1] + a[3]) / 2) for a in anchors]
    for number, box in enumerate(boxes):
        middle = ((box[0] + box[2]) / 2, (box[1] + box[3]) / 2)
        candidates, first = [], 0
        for count in counts:
            level = range(first, first + count)
            distance = {i: (centres[i][0] - middle[0]) ** 2 + (centres[i][1] - middle[1]) ** 2 for i in level}
            candidates += sorted(level, key=distance.__getitem__)[:NEAREST]
            first += count
        overlaps = [iou(box, anchors[i]) for i in candidates]
        mean = sum(overlaps) / len(overlaps)
        deviation = (sum((each - mean) ** 2 for each in overlaps) / (len(overlaps) - 1)) ** 0.5
        for i, overlap in zip(candidates, overlaps, strict=True):
            x, y = centres[i]
            is_inside = box[0] < x < box[2] and box[1] < y < box[3]
            if overlap >= mean + deviation and is_inside and overlap > best[i][0]:
                best[i] = (overlap, number)
    return [number for _, number in best]


@pytest.mark.parametrize("seed", range(8))
def test_cells_are_those_of_the_plain_algorithm(seed: int) -> None:
    generator = torch.Generator().manual_seed(seed)
    low = torch.rand((4, 2), generator=generator) * 60
    boxes = torch.cat((low, low + 8 + torch.rand((4, 2), generator=generator) * 30), dim=1)
    anchors, counts = grid()
    found = assigned(boxes, anchors, counts).tolist()
    assert found == by_loops(boxes.tolist(), anchors.tolist(), counts)
    assert max(found) >= 0


def test_without_objects_all_cells_are_background() -> None:
    anchors, counts = grid()
    assert set(assigned(torch.zeros(0, 4), anchors, counts).tolist()) == {BACKGROUND}
