"""The samples of a split as a `torch.utils.data.Dataset`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gear.plugins.datasets import Dataset, open_dataset
from gear.values.errors import UnknownNameError
from gear.values.frames import UInt8Image
from gear.values.rng import derive_rng

Change = Callable[[Any, int, np.random.Generator], Any]
"""A function of (sample, index, random generator) that returns a changed sample, such as a crop with ground truth."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Item:
    """One sample with its index in the split.

    Attributes:
        index: index of the sample in the split.
        sample: the task's own object with pictures and ground truth.
        cameras: names of the cameras whose pictures are in `views`.
    """

    index: int
    sample: Any
    cameras: tuple[str, ...]

    @cached_property
    def views(self) -> dict[str, Tensor]:
        """The (3, H, W) uint8 sRGB pictures by camera name, converted on first access."""
        return {name: picture_tensor(self.sample.images[name]) for name in self.cameras}


class TorchDataset(torch.utils.data.Dataset[Item]):
    """Samples of any task as items, for torch's own `DataLoader`, `gear.readers.batches` or
    `gear.readers.read_ahead`.

    An item is not a tensor, so torch's own loader needs one of two arguments: `batch_size=None` yields single items,
    and `collate_fn=gear.readers.collate` makes a `Batch` of them.

    Item i depends only on (samples, seed, epoch, i), so the items are the same for any number of workers. A
    `TorchDataset` can be sent to worker processes.

    Attributes:
        samples: the opened split, or another sequence of samples.
        epoch: number of the epoch, on which the random draws of `change` depend; `batches` sets it.
    """

    def __init__(
        self,
        samples: Sequence[Any] | str | Path,
        split: str | None = None,
        *,
        views: Sequence[str] | None = None,
        change: Change | None = None,
        seed: int = 0,
    ) -> None:
        """Opens the samples; none is read.

        Args:
            samples: an opened split, the root folder of a dataset, or any sequence of samples, such as `Samples`.
            split: name of the split, for a root that holds several.
            views: names of the cameras to read; all cameras of the sample by default.
            change: function applied to every sample, such as an augmentation.
            seed: seed of the random draws of `change`.

        Raises:
            DatasetError: there is no such dataset or split, or it is not finished.
            UnknownNameError: the samples of an opened split have no such camera.
        """
        self.samples: Sequence[Any] = open_dataset(samples, split) if isinstance(samples, (str, Path)) else samples
        self.epoch = 0
        self._views = None if views is None else tuple(views)
        if isinstance(self.samples, Dataset):
            cameras = [camera.name for camera in self.samples.task.rig().cameras]
            for name in self._views or ():
                if name not in cameras:
                    raise UnknownNameError(f"camera in {self.samples.root}", name, cameras)
        self._change = change
        self._seed = seed

    def __len__(self) -> int:
        return len(self.samples)

    def __getitem__(self, index: int) -> Item:
        return self.item(index, self.epoch)

    def item(self, index: int, epoch: int) -> Item:
        """The item at an index for a given epoch; the attribute `epoch` is ignored."""
        number = range(len(self))[index]
        sample = self.samples[number]
        if self._change is not None:
            sample = self._change(sample, number, derive_rng(self._seed, "change", epoch, number))
        cameras = tuple(sample.images) if self._views is None else self._views
        return Item(index=number, sample=sample, cameras=cameras)


def picture_tensor(picture: UInt8Image) -> Tensor:
    """Copies a (H, W, 3) uint8 picture into a (3, H, W) uint8 tensor."""
    return torch.from_numpy(np.array(picture.transpose(2, 0, 1), order="C"))
