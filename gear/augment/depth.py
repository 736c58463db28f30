"""Moving samples of monocular depth, and pasting depth into their pictures.

A window that shows everything `s` times as large also brings everything `s` times as near: the focal length stays what
the network has learnt it to be, so that the size of things goes on telling how far they are.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gear.augment.geometry import Geometry, Window, cut_map, cut_picture, flip_array
from gear.nn.depth_cutdepth import vertical_cutdepth
from gear.plugins.tasks.depth import DepthSample


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


def cut_depth(sample: DepthSample, rng: np.random.Generator) -> DepthSample:
    """Vertical CutDepth: a band of columns of the picture becomes its depth. See `vertical_cutdepth`."""
    images = {
        name: vertical_cutdepth(picture, sample.depth_m, rng, probability=1.0)
        for name, picture in sample.images.items()
    }
    return replace(sample, images=images)


GEOMETRY: Geometry[DepthSample] = Geometry(flip=flip, cut=cut)
