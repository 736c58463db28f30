"""Samples as a torch dataset."""

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
"""Makes a sample of a given number another one, such as a crop of it, ground truth and pictures alike; draws from the
generator."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Item:
    """One sample.

    Attributes:
        index: its number among the samples.
        sample: the task's own object, with its ground truth.
        cameras: whose pictures are views.
    """

    index: int
    sample: Any
    cameras: tuple[str, ...]

    @cached_property
    def views(self) -> dict[str, Tensor]:
        """(3, H, W) uint8 sRGB pictures by camera name, made when they are first asked for."""
        return {name: picture_tensor(self.sample.images[name]) for name in self.cameras}


class TorchDataset(torch.utils.data.Dataset[Item]):
    """Samples of any task, one by one, for torch's own `DataLoader`, for `gear.readers.batches` or for `read_ahead`.

    Items are not tensors, so torch's own loader is to be told how a batch is made of them: `batch_size=None` leaves
    them as they are, `collate_fn=gear.readers.collate` makes a `Batch`.

    Item i depends on (samples, seed, epoch, i) alone, whoever reads it. It can be sent to worker processes.

    Attributes:
        samples: the opened split, or whatever else gives samples.
        epoch: number of the pass over the data, from which `change` draws; `batches` sets it.
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
        """Args:
            samples: an opened split, its root, or any sequence of samples, such as `Samples` of several splits.
            split: of a root that holds several.
            views: names of the cameras to read; all of the sample's by default.
            change: applied to every sample, such as an augmentation.
            seed: of what `change` draws.

        Raises:
            DatasetError: there is no such dataset or split, or it is not finished.
            UnknownNameError: an opened split's samples have no such camera.
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
        """The item as a pass sees it, whatever pass is under way."""
        number = range(len(self))[index]
        sample = self.samples[number]
        if self._change is not None:
            sample = self._change(sample, number, derive_rng(self._seed, "change", epoch, number))
        cameras = tuple(sample.images) if self._views is None else self._views
        return Item(index=number, sample=sample, cameras=cameras)


def picture_tensor(picture: UInt8Image) -> Tensor:
    """(H, W, 3) to (3, H, W) uint8, its own memory."""
    return torch.from_numpy(np.array(picture.transpose(2, 0, 1), order="C"))
