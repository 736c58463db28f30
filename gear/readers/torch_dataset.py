"""A split as a torch dataset."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gear.contracts.tasks import Sample
from gear.opening import Dataset, open_dataset
from gear.values.errors import UnknownNameError
from gear.values.frames import UInt8Image
from gear.values.rng import derive_rng

Change = Callable[[Any, np.random.Generator], Any]
"""Makes a sample another one, such as a crop of it, ground truth and pictures alike; draws from the generator."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Item:
    """One sample.

    Attributes:
        index: its number in the split.
        views: (3, H, W) uint8 sRGB pictures by camera name.
        sample: the task's own object, with its ground truth.
    """

    index: int
    views: Mapping[str, Tensor]
    sample: Any


class TorchDataset(torch.utils.data.Dataset[Item]):
    """One finished split of any task, sample by sample, for torch's own `DataLoader` or for `gear.readers.batches`.

    Items are not tensors, so torch's own loader is to be told how a batch is made of them: `batch_size=None` leaves
    them as they are, `collate_fn=gear.readers.collate` makes a `Batch`.

    Item i depends on (split, seed, epoch, i) alone, whoever reads it. It can be sent to worker processes.

    Attributes:
        dataset: the opened split.
        epoch: number of the pass over the data, from which `change` draws; `batches` sets it.
    """

    def __init__(
        self,
        dataset: Dataset[Any] | str | Path,
        split: str | None = None,
        *,
        views: Sequence[str] | None = None,
        change: Change | None = None,
        seed: int = 0,
    ) -> None:
        """Args:
            dataset: an opened one, or its root.
            split: of a root that holds several.
            views: names of the cameras to read; all of the sample's by default.
            change: applied to every sample, such as an augmentation.
            seed: of what `change` draws.

        Raises:
            DatasetError: there is no such dataset or split, or it is not finished.
            UnknownNameError: its samples have no such camera.
        """
        self.dataset = dataset if isinstance(dataset, Dataset) else open_dataset(dataset, split)
        self.epoch = 0
        self._views = None if views is None else tuple(views)
        cameras = [camera.name for camera in self.dataset.task.rig().cameras]
        for name in self._views or ():
            if name not in cameras:
                raise UnknownNameError(f"camera in {self.dataset.root}", name, cameras)
        self._change = change
        self._seed = seed

    def __len__(self) -> int:
        return len(self.dataset)

    def __getitem__(self, index: int) -> Item:
        sample: Sample = self.dataset[index]
        number = index % len(self)
        if self._change is not None:
            sample = self._change(sample, derive_rng(self._seed, "change", self.epoch, number))
        names = tuple(sample.images) if self._views is None else self._views
        return Item(index=number, views={name: picture_tensor(sample.images[name]) for name in names}, sample=sample)


def picture_tensor(picture: UInt8Image) -> Tensor:
    """(H, W, 3) to (3, H, W) uint8, its own memory."""
    return torch.from_numpy(np.array(picture.transpose(2, 0, 1), order="C"))
