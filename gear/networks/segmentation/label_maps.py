"""Finds the most likely class of each pixel from small logit maps, without storing logits at the picture's size.

Logits at the size of a 2048 x 1024 picture take 160 MB. Writing and reading them took two fifths of the time of a fast
network. Here the small maps are interpolated in bands of rows that fit into the CPU's cache. The values equal the
values of `torch.nn.functional.interpolate`.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor
from torch.nn import functional

from gear.values.frames import UInt8Image

_BAND_PX = 16


def best_class_at(logits: Tensor, size_px: tuple[int, ...], *, align_corners: bool) -> UInt8Image:
    """Returns the (H, W) uint8 map of the class with the largest logit after bilinear interpolation; of equal
    logits the first class.

    Args:
        logits: (C, h, w) float32 on the CPU, usually smaller than the picture.
        size_px: height H and width W of the picture.
        align_corners: as in torch's interpolation.
    """
    height, width = size_px
    inner_height = int(logits.shape[1])
    wide = functional.interpolate(
        logits[None].contiguous(), size=(inner_height, width), mode="bilinear", align_corners=align_corners
    )[0]
    above, below, share = _rows(inner_height, height, align_corners)
    best = np.empty((height, width), np.uint8)
    for begin in range(0, height, _BAND_PX):
        band = slice(begin, begin + _BAND_PX)
        weight = torch.from_numpy(share[band])[:, None]
        rows = [wide.index_select(1, torch.from_numpy(source[band])) for source in (above, below)]
        best[band] = _first_of_largest(rows[0].mul_(1 - weight).add_(rows[1].mul_(weight)).numpy())
    return best


def best_class(logits: Tensor) -> UInt8Image:
    """Returns the (H, W) uint8 map of the class with the largest logit; of equal logits the first class.

    The result equals `argmax(0)`, which takes twenty times as long on a CPU because of the order in which it reads
    memory.

    Args:
        logits: (C, H, W) on any device.
    """
    return _first_of_largest(logits.float().numpy()) if logits.device.type == "cpu" else _on_device(logits)


def _on_device(logits: Tensor) -> UInt8Image:
    """`best_class` with operations that are fast on a GPU, whose own `argmax` may return any of several equal
    logits.
    """
    largest = logits.amax(0)
    best = torch.zeros(largest.shape, dtype=torch.uint8, device=logits.device)
    for index in reversed(range(len(logits))):
        best.masked_fill_(logits[index] == largest, index)
    return best.cpu().numpy()


def _first_of_largest(logits: npt.NDArray[np.float32]) -> UInt8Image:
    largest = logits[0].copy()
    best = np.zeros(largest.shape, np.uint8)
    for index, one in enumerate(logits[1:], start=1):
        exceeds = cv2.compare(one, largest, cv2.CMP_GT)
        cv2.max(best, cv2.bitwise_and(exceeds, float(index), dst=exceeds), dst=best)
        cv2.max(largest, one, dst=largest)
    return best


def _rows(
    inner: int, outer: int, align_corners: bool
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.float32]]:
    """For each row of the picture: the two rows of the map between which it lies, and the weight of the second one.

    The arithmetic is in float32, as in torch.
    """
    row = np.arange(outer, dtype=np.float32)
    half, one = np.float32(0.5), np.float32(1)
    if align_corners:
        place = row * (np.float32(inner - 1) / max(np.float32(outer - 1), one))
    else:
        place = np.maximum((row + half) * (np.float32(inner) / np.float32(outer)) - half, np.float32(0))
    first = np.minimum(place.astype(np.int64), inner - 1)
    return first, np.minimum(first + 1, inner - 1), np.clip(place - first.astype(np.float32), 0, one)
