"""A baseline model: each connected component of a thing class in a semantic segmentation is one instance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from gear.config.overrides import with_overrides
from gear.contracts.models import Model
from gear.formats.cityscapes import INSTANCE_FACTOR
from gear.plugins.build import NO_OPTIONS, build, find
from gear.values.frames import UInt8Image
from scipy import ndimage

from gear_task_panoptic.panoptic import THINGS, as_panoptic
from gear_task_panoptic.quality import Panoptic

if TYPE_CHECKING:
    from torch import Tensor, nn

    from gear_task_panoptic import PartsConfig


class Parts:
    """A semantic segmentation network of gear as a model of the task `panoptic`."""

    def __init__(self, config: PartsConfig) -> None:
        settings = [f"weights={config.weights}"] if config.weights else []
        self.inner: Model = build(find("model", config.model), with_overrides(NO_OPTIONS, settings))
        self.least_px = config.least_px

    def predict(self, views: Mapping[str, UInt8Image]) -> Panoptic:
        """Segments made of the network's label ids."""
        return as_panoptic(in_parts(self.inner.predict(views), self.least_px))

    def forward(self, views: Mapping[str, Tensor], targets: Sequence[Any] | None = None) -> Mapping[str, Tensor]:
        """Outputs and losses of the semantic segmentation network."""
        return self.inner.forward(views, None if targets is None else [_labelled(one.panoptic) for one in targets])

    def taps(self) -> Mapping[str, nn.Module]:
        """No feature maps."""
        return {}


def in_parts(label_ids: npt.NDArray[np.uint8], least_px: int) -> npt.NDArray[np.uint16]:
    """(H, W) Cityscapes instance ids from label ids; components smaller than `least_px` are void."""
    instances = label_ids.astype(np.uint16)
    for label in THINGS & set(np.unique(label_ids).tolist()):
        parts, count = ndimage.label(label_ids == label)
        sizes = np.bincount(parts.reshape(-1), minlength=count + 1)
        numbers = np.zeros(count + 1, np.uint16)
        large = [part for part in np.argsort(-sizes[1:], kind="stable") + 1 if sizes[part] >= least_px]
        for number, part in enumerate(large[: INSTANCE_FACTOR - 1]):
            numbers[part] = label * INSTANCE_FACTOR + number
        instances = np.where(parts > 0, numbers[parts], instances)
    return instances


def _labelled(panoptic: Panoptic) -> SimpleNamespace:
    """What the losses of semantic segmentation read of a sample."""
    ids = panoptic.ids
    return SimpleNamespace(label_ids=np.where(ids >= INSTANCE_FACTOR, ids // INSTANCE_FACTOR, ids).astype(np.uint8))
