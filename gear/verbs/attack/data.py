"""What an attack sees: several datasets as one, samples kept in memory, one compositor for all."""

from __future__ import annotations

import dataclasses
from collections import OrderedDict
from collections.abc import Sequence
from typing import Any, overload

import numpy as np
import torch
from torch import Tensor

from gear.contracts.attacks import Compositor
from gear.contracts.tasks import CONTROLS
from gear.dataset.reading import Dataset
from gear.values.errors import DatasetError

KEPT_BYTES = 2 << 30


class Joined(Sequence[Any]):
    """Samples of several datasets behind each other; as many decoded ones stay in memory as fit."""

    def __init__(self, datasets: Sequence[Dataset[Any]], kept_bytes: int = KEPT_BYTES) -> None:
        self.datasets = tuple(datasets)
        self.places = [(d, i) for d, dataset in enumerate(datasets) for i in range(len(dataset))]
        self._kept: OrderedDict[int, tuple[Any, int]] = OrderedDict()
        self._left = kept_bytes

    def __len__(self) -> int:
        return len(self.places)

    @overload
    def __getitem__(self, index: int) -> Any: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Any]: ...
    def __getitem__(self, index: int | slice) -> Any:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        index = range(len(self))[index]
        if index in self._kept:
            self._kept.move_to_end(index)
            return self._kept[index][0]
        dataset, place = self.places[index]
        sample = self.datasets[dataset][place]
        size = bytes_of(sample)
        self._kept[index] = (sample, size)
        self._left -= size
        while self._left < 0 and len(self._kept) > 1:
            self._left += self._kept.popitem(last=False)[1][1]
        return sample


def bytes_of(sample: Any) -> int:
    """Memory of a sample's arrays."""
    values = [getattr(sample, field.name) for field in dataclasses.fields(sample)]
    arrays = [value for value in values if isinstance(value, np.ndarray)] + list(sample.images.values())
    return sum(array.nbytes for array in arrays)


class JoinedCompositor:
    """The compositors of several datasets, by the indices of `Joined`."""

    def __init__(self, joined: Joined, compositors: Sequence[Compositor]) -> None:
        self._joined, self._compositors = joined, tuple(compositors)

    def compose(self, patches: Sequence[Tensor], samples: Sequence[int], view: str) -> Tensor:
        """(B, 3, H, W) pictures in 0..1; patches (3, h, w) for all samples, or (B, 3, h, w) with one each."""
        places = [self._joined.places[index] for index in samples]
        if len({dataset for dataset, _ in places}) == 1:
            return self._compositors[places[0][0]].compose(patches, [place for _, place in places], view)
        pictures = []
        for number, (dataset, place) in enumerate(places):
            mine = [patch if patch.ndim == 3 else patch[number] for patch in patches]
            pictures.append(self._compositors[dataset].compose(mine, [place], view))
        return torch.cat(pictures)


def check_joined(datasets: Sequence[Dataset[Any]]) -> None:
    """Whether one set of patches fits them all.

    Raises:
        DatasetError: they are of different tasks or pictures, or differ in their number of surfaces, or have none, or
            one shows patches already: what networks say of it is no clean answer to begin with.
    """
    first = datasets[0]
    facts = [_facts(dataset) for dataset in datasets]
    for dataset, found in zip(datasets, facts, strict=True):
        if not found["patch surfaces"]:
            raise DatasetError(dataset.root, "has no patch surface; attack a scene with a billboard or the truck")
        if (label := dataset.plan.patch["label"]) not in CONTROLS:
            problem = f"shows the patch {label} itself; collect the scene with --patch none or random, and name that"
            raise DatasetError(dataset.root, problem)
        for name, value in found.items():
            if value != facts[0][name]:
                raise DatasetError(dataset.root, f"has {name} {value}, but {first.root} has {facts[0][name]}")


def _facts(dataset: Dataset[Any]) -> dict[str, Any]:
    record = dataset.sidecar(0).record
    return {
        "task": dataset.plan.task["name"],
        "patch surfaces": len(record.surfaces),
        "pictures of": [(camera.name, camera.width_px, camera.height_px) for camera in record.cameras],
    }
