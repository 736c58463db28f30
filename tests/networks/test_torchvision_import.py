"""The operators against brute force in NumPy, and against what torchvision itself has in plain torch."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from gear.networks import torchvision_import
from gear.networks.torchvision_ops import nms, roi_align
from gear.values.rng import derive_rng

MODES = [(ratio, aligned) for ratio in (-1, 1, 2) for aligned in (False, True)]


def reference_nms(boxes: Any, scores: Any, threshold: float) -> list[int]:
    kept: list[int] = []
    for index in sorted(range(len(boxes)), key=lambda i: -scores[i]):
        if all(iou(boxes[index], boxes[other]) <= threshold for other in kept):
            kept.append(index)
    return kept


def iou(one: Any, two: Any) -> float:
    width = min(one[2], two[2]) - max(one[0], two[0])
    height = min(one[3], two[3]) - max(one[1], two[1])
    shared = max(width, 0) * max(height, 0)
    return float(shared / ((one[2] - one[0]) * (one[3] - one[1]) + (two[2] - two[0]) * (two[3] - two[1]) - shared))


def sample(picture: Any, y: float, x: float) -> Any:
    """Bilinear value of a (C, H, W) picture; the border holds for one pixel, beyond it is nothing."""
    height, width = picture.shape[1:]
    if not (-1 <= y <= height and -1 <= x <= width):
        return np.zeros(len(picture))
    y, x = min(max(y, 0), height - 1), min(max(x, 0), width - 1)
    top, left = int(y), int(x)
    down, right = min(top + 1, height - 1), min(left + 1, width - 1)
    upper = picture[:, top, left] * (1 - (x - left)) + picture[:, top, right] * (x - left)
    lower = picture[:, down, left] * (1 - (x - left)) + picture[:, down, right] * (x - left)
    return upper * (1 - (y - top)) + lower * (y - top)


def reference_roi_align(
    features: Any, rois: Any, scale: float, height: int, width: int, ratio: int, aligned: bool
) -> Any:
    answer = np.zeros((len(rois), features.shape[1], height, width))
    for number, (picture, *box) in enumerate(rois):
        left, top, right, bottom = (edge * scale - (0.5 if aligned else 0) for edge in box)
        across, down = right - left, bottom - top
        if not aligned:
            across, down = max(across, 1), max(down, 1)
        columns = ratio if ratio > 0 else math.ceil(across / width)
        rows = ratio if ratio > 0 else math.ceil(down / height)
        for i in range(height):
            for j in range(width):
                total = np.zeros(features.shape[1])
                for row in range(rows):
                    for column in range(columns):
                        y = top + (i + (row + 0.5) / rows) * down / height
                        x = left + (j + (column + 0.5) / columns) * across / width
                        total += sample(features[int(picture)], y, x)
                answer[number, :, i, j] = total / max(rows * columns, 1)
    return answer


def some_boxes(count: int, size: float, name: str) -> Any:
    rng = derive_rng(1, name)
    low = rng.uniform(-0.1 * size, 0.9 * size, (count, 2))
    return np.concatenate([low, low + rng.uniform(0.02 * size, 0.5 * size, (count, 2))], axis=1)


@pytest.mark.parametrize("threshold", [0.0, 0.3, 0.7])
def test_nms_is_that_of_brute_force(threshold: float) -> None:
    boxes = some_boxes(300, 100.0, "nms").astype(np.float32)
    scores = derive_rng(2, "scores").integers(0, 40, 300) / 40  # with many equal ones
    kept = nms(torch.from_numpy(boxes), torch.from_numpy(scores), threshold)
    assert kept.dtype == torch.int64
    assert kept.tolist() == reference_nms(boxes.astype(np.float64), scores, threshold)
    assert 1 < len(kept) < 300


def test_nms_of_nothing_and_of_nothings() -> None:
    assert nms(torch.zeros(0, 4), torch.zeros(0), 0.5).shape == (0,)
    points = torch.tensor([[1.0, 1, 1, 1], [1, 1, 1, 1]])
    assert nms(points, torch.tensor([0.1, 0.2]), 0.5).tolist() == [1, 0]
    assert nms(points.bfloat16(), torch.tensor([0.1, 0.2]).bfloat16(), 0.5).tolist() == [1, 0]


@pytest.mark.parametrize(("ratio", "aligned"), MODES)
def test_roi_align_is_that_of_brute_force(ratio: int, aligned: bool) -> None:
    features = derive_rng(3, "features").normal(size=(3, 2, 9, 13))
    boxes = np.concatenate([some_boxes(12, 40.0, "rois"), [[3.0, 3, 3, 3], [-90, -90, -60, -60]]])
    rois = np.concatenate([derive_rng(4, "pictures").integers(0, 3, (len(boxes), 1)), boxes], axis=1)
    found = roi_align(torch.from_numpy(features), torch.from_numpy(rois), 0.25, 3, 2, ratio, aligned)
    wanted = reference_roi_align(features, rois, 0.25, 3, 2, ratio, aligned)
    assert np.abs(wanted).max() > 0.5
    np.testing.assert_allclose(found.numpy(), wanted, atol=1e-9)


def test_roi_align_of_one_row_and_of_no_regions() -> None:
    features = torch.arange(4.0).reshape(1, 1, 1, 4).requires_grad_()
    roi = torch.tensor([[0.0, 0, 0, 3, 1]])
    assert torch.allclose(roi_align(features, roi, 1.0, 1, 3, 1, False), torch.tensor([0.5, 1.5, 2.5]))
    none = roi_align(features, roi[:0], 1.0, 2, 3, 2, True)
    assert none.shape == (0, 1, 2, 3) and none.requires_grad
    half = roi_align(features.detach().bfloat16(), roi.bfloat16(), 1.0, 1, 3, 1, False)
    assert half.dtype == torch.bfloat16 and half.flatten().tolist() == [0.5, 1.5, 2.5]


@pytest.mark.parametrize(("ratio", "aligned"), MODES)
def test_gradients_of_roi_align(ratio: int, aligned: bool) -> None:
    features = torch.from_numpy(derive_rng(5, "features").normal(size=(2, 1, 3, 4))).requires_grad_()
    boxes = some_boxes(3, 15.0, "gradients")
    rois = torch.from_numpy(np.concatenate([[[0], [1], [1]], boxes], axis=1))
    assert torch.autograd.gradcheck(lambda x: roi_align(x, rois, 0.25, 2, 1, ratio, aligned), (features,))


def test_torchvision_works() -> None:
    assert torchvision_import.prepare()
    torchvision_import.need()
    import torchvision
    from torchvision.ops import batched_nms
    from torchvision.ops import roi_align as called

    python_version = sys.modules["torchvision.ops.roi_align"]._roi_align.__wrapped__  # not compiled
    features = torch.from_numpy(derive_rng(6, "features").normal(size=(2, 3, 12, 16))).float().requires_grad_()
    rois = torch.from_numpy(np.concatenate([[[0]] * 3 + [[1]] * 4, 4 + some_boxes(7, 40.0, "rois")], axis=1)).float()
    rois[:, 1:].clamp_(0, 46)  # theirs does not know that far outside there is nothing
    for ratio, aligned in MODES:
        ours = called(features, rois, (3, 4), 0.25, ratio, aligned)
        theirs = python_version(features, rois, 0.25, 3, 4, ratio, aligned)
        torch.testing.assert_close(ours, theirs, atol=1e-5, rtol=1e-5)
        weights = torch.linspace(-1, 1, ours.numel()).reshape(ours.shape)
        gradients = [torch.autograd.grad((each * weights).sum(), features)[0] for each in (ours, theirs)]
        torch.testing.assert_close(*gradients, atol=1e-5, rtol=1e-4)
    boxes = torch.tensor([[0.0, 0, 9, 9], [0, 0, 9, 8], [0, 0, 9, 9]])
    assert batched_nms(boxes, torch.tensor([0.2, 0.9, 0.1]), torch.tensor([0, 0, 1]), 0.5).tolist() == [1, 2]
    assert torchvision.ops.nms(boxes, torch.tensor([0.2, 0.9, 0.1]), 0.5).tolist() == [1]


def test_a_pair_that_works_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "torchvision.py").write_text("")
    code = (
        "import torch; from gear.networks import torchvision_import\n"
        "assert torchvision_import.prepare() and not torchvision_import._libraries"
        " and not hasattr(torch.ops.torchvision, 'nms')"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_without_torchvision_one_line_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torchvision_import, "NAME", "torchvision_that_nobody_has")
    monkeypatch.setattr(torchvision_import, "prepare", torchvision_import.prepare.__wrapped__)
    assert not torchvision_import.prepare()
    with pytest.raises(torchvision_import.GearError, match="pip install"):
        torchvision_import.need()
