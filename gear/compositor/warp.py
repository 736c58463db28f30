"""Converts the texture samples of all pixels to one sparse matrix, which maps a patch's texels to pixels."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from gear.compositor.pyramid import Pyramid
from gear.compositor.sampling import Samples
from gear.values.geometry import Array


def warp_matrix(samples: Samples, pyramid: Pyramid) -> Any:
    """Returns the sparse matrix of weights with which pixels read a patch's texels: trilinear filtering, repeating
    texture.

    Args:
        samples: texture samples of N pixels.
        pyramid: mip levels for patches of one size, whose texels `Pyramid.spread` puts in one array.

    Returns:
        (N, `pyramid.size`) SciPy CSR matrix of float32, by which the texels of `Pyramid.spread` are multiplied; rows
        sum to 1.
    """
    count, each = samples.weight.shape
    pixel = np.repeat(np.arange(count), each)
    u, v, weight = (array.reshape(-1) for array in (samples.u, samples.v, samples.weight))
    level = np.clip(samples.level.reshape(-1), 0, pyramid.levels - 1)
    low = np.floor(level).astype(int)
    part = level - low
    total = sparse.csr_matrix((count, pyramid.size), dtype=np.float64)
    for number in range(int(low.min(initial=0)), int(low.max(initial=0)) + 2):
        share = weight * ((low == number) * (1 - part) + (low + 1 == number) * part)
        used = np.flatnonzero(share)
        if used.size:
            total = total + _level_matrix(pyramid, number, u[used], v[used], share[used], pixel[used], count)
    total.sum_duplicates()
    return total.astype(np.float32)


def _level_matrix(pyramid: Pyramid, level: int, u: Array, v: Array, weight: Array, pixel: Any, count: int) -> Any:
    height, width = pyramid.shape(level)
    rows, columns, stride = pyramid.reads(level)
    at_x, at_y = u * width - 0.5, v * height - 0.5
    low_x, low_y = np.floor(at_x).astype(int), np.floor(at_y).astype(int)
    part_x, part_y = at_x - low_x, at_y - low_y
    values, places, owners = [], [], []
    for dy in (0, 1):
        for dx in (0, 1):
            share = weight * (part_x if dx else 1 - part_x) * (part_y if dy else 1 - part_y)
            row, column = (low_y + dy) % height, (low_x + dx) % width
            for i in range(rows.index.shape[1]):
                for j in range(columns.index.shape[1]):
                    values.append(share * rows.weight[row, i] * columns.weight[column, j])
                    place = rows.index[row, i] * stride + columns.index[column, j]
                    places.append(place + pyramid.starts[level])
                    owners.append(pixel)
    entries = (np.concatenate(values), (np.concatenate(owners), np.concatenate(places)))
    return sparse.coo_matrix(entries, shape=(count, pyramid.size)).tocsr()
