"""Moving samples of semantic segmentation."""

from __future__ import annotations

from dataclasses import replace

from gear.augment.geometry import Geometry, Window, cut_map, cut_picture, flip_array
from gear.plugins.tasks.semseg import SemsegSample

UNLABELLED = 0
"""Cityscapes' id of what has no label; beyond the picture nothing has."""


def flip(sample: SemsegSample) -> SemsegSample:
    """Picture, labels and instances in a mirror."""
    return replace(
        sample,
        images={name: flip_array(picture) for name, picture in sample.images.items()},
        surfaces=(),
        label_ids=flip_array(sample.label_ids),
        instance_ids=flip_array(sample.instance_ids),
    )


def cut(sample: SemsegSample, window: Window) -> SemsegSample:
    """What the window shows; labels are taken from the nearest pixel, never mixed."""
    return replace(
        sample,
        images={name: cut_picture(picture, window) for name, picture in sample.images.items()},
        surfaces=(),
        label_ids=cut_map(sample.label_ids, window, UNLABELLED),
        instance_ids=cut_map(sample.instance_ids, window, UNLABELLED),
    )


GEOMETRY: Geometry[SemsegSample] = Geometry(flip=flip, cut=cut)
