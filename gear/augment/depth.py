"""Moving samples of monocular depth, and pasting depth into their pictures.

A window that shows everything `s` times as large also brings everything `s` times as near: the focal length stays what
the network has learnt it to be, so that the size of things goes on telling how far they are.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gear.augment.geometry import Geometry, Window, cut_map, cut_picture, flip_array
from gear.plugins.tasks.depth import DepthSample
from gear.values.frames import FloatImage, UInt8Image

WHITE_FROM_M = 80.0
"""Depth that CutDepth paints white."""


def flip(sample: DepthSample) -> DepthSample:
    """Picture and depth in a mirror."""
    return replace(
        sample,
        images={name: flip_array(picture) for name, picture in sample.images.items()},
        surfaces=(),
        depth_m=flip_array(sample.depth_m),
    )


def cut(sample: DepthSample, window: Window) -> DepthSample:
    """What the window shows, nearer by as much as it is larger; unknown beyond the picture."""
    depth_m = cut_map(sample.depth_m, window, np.nan) / np.float32(window.scale)
    return replace(
        sample,
        images={name: cut_picture(picture, window) for name, picture in sample.images.items()},
        surfaces=(),
        depth_m=depth_m.astype(np.float32),
    )


def shrink(sample: DepthSample, window: Window) -> DepthSample:
    """What the window shows, as far away as it was: the same lens before fewer pixels."""
    return replace(
        sample,
        images={name: cut_picture(picture, window) for name, picture in sample.images.items()},
        surfaces=(),
        depth_m=cut_map(sample.depth_m, window, np.nan),
    )


def cut_depth(sample: DepthSample, rng: np.random.Generator) -> DepthSample:
    """Vertical CutDepth: the true depth, as grey, in place of a band of columns of the picture.

    Kim et al., "Global-Local Path Networks for Monocular Depth Estimation with Vertical CutDepth", 2022, §3.3: the
    band reaches from top to bottom, because depth changes most along columns. At most three quarters of the width.
    """
    width = sample.depth_m.shape[1]
    left = int(rng.integers(0, width))
    right = left + max(1, int((width - left) * 0.75 * rng.random()))
    images = {name: _with_band(picture, sample.depth_m, left, right) for name, picture in sample.images.items()}
    return replace(sample, images=images)


def _with_band(picture: UInt8Image, depth_m: FloatImage, left: int, right: int) -> UInt8Image:
    band_m = depth_m[:, left:right]
    grey = np.clip(np.where(np.isfinite(band_m), band_m, WHITE_FROM_M) / WHITE_FROM_M, 0, 1) * 255
    painted = picture.copy()
    painted[:, left:right] = np.rint(grey).astype(np.uint8)[..., None]
    return painted


GEOMETRY: Geometry[DepthSample] = Geometry(flip=flip, cut=cut, shrink=shrink)
