"""Batches of samples in the form that models take: `model.forward(batch.views, batch.samples)`."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor
from torch.utils.data import DataLoader

from gear.readers.order import order
from gear.readers.torch_dataset import Item, TorchDataset

AHEAD = 2
"""Number of batches that each worker process reads in advance."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Batch:
    """Samples that go through a network together.

    Attributes:
        views: (B, 3, H, W) float32 sRGB pictures in 0..1, by camera name.
        samples: the B samples with their ground truth.
        indices: index of each sample in the split.
    """

    views: Mapping[str, Tensor]
    samples: tuple[Any, ...]
    indices: tuple[int, ...]


def batches(
    dataset: TorchDataset,
    *,
    size: int,
    seed: int | None = None,
    epoch: int = 0,
    start: int = 0,
    only_full: bool = False,
    workers: int = 0,
) -> Iterator[Batch]:
    """Reads all samples of a split once, in batches.

    Args:
        dataset: dataset whose pictures all have one size.
        size: number of samples per batch.
        seed: seed of the order; None keeps the order of the split.
        epoch: number of the epoch, on which the order and the augmentation depend.
        start: number of batches to skip at the beginning without reading them, to resume an interrupted epoch.
        only_full: whether a last batch with fewer samples is dropped.
        workers: number of processes that read batches in advance; 0 reads in this process. The batches are the same for
            any number.

    Raises:
        ValueError: `size` is below 1, `start` is negative, or the pictures of a batch differ in size.
        DatasetError: a sample cannot be read.
    """
    if size < 1:
        raise ValueError(f"size must be at least 1, got {size}")
    if start < 0:
        raise ValueError(f"start counts batches that are left out, 0 or more, got {start}")
    dataset = copy.copy(dataset)  # another pass over the same one may be under way
    dataset.epoch = epoch
    indices = order(len(dataset), seed=seed, epoch=epoch)
    groups = [indices[i : i + size] for i in range(0, len(indices), size)]
    chosen = [group for group in groups[start:] if len(group) == size or not only_full]
    reader: DataLoader[Item] = DataLoader(
        dataset,
        batch_sampler=chosen,
        num_workers=workers,
        collate_fn=stacked,
        prefetch_factor=AHEAD if workers else None,
        multiprocessing_context="spawn" if workers else None,
        generator=torch.Generator(),  # torch would draw from its global one
    )
    for items in reader:
        yield _finished(items)


def collate(items: Sequence[Item]) -> Batch:
    """Makes a batch of items, with float32 pictures in 0..1; the `collate_fn` for torch's own `DataLoader`.

    Raises:
        ValueError: the pictures differ in size.
    """
    return _finished(stacked(items))


def as_pictures(views: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Converts pictures from uint8 in 0..255 to float32 in 0..1.

    Args:
        views: pictures of any shape, by camera name.
    """
    return {name: tensor.float() / 255 for name, tensor in views.items()}


def stacked(items: Sequence[Item]) -> Batch:
    """Makes a batch whose pictures stay uint8 in 0..255.

    Such pictures need a quarter of the bytes of float32 pictures when they are sent between processes or to a GPU.

    Args:
        items: samples whose pictures are (3, H, W) uint8 by camera name; all have the same cameras.

    Raises:
        ValueError: the pictures differ in size.
    """
    views = [item.views for item in items]
    return Batch(
        views={name: _stack(name, [one[name] for one in views]) for name in views[0]},
        samples=tuple(item.sample for item in items),
        indices=tuple(item.index for item in items),
    )


def _stack(name: str, tensors: list[Tensor]) -> Tensor:
    sizes = {tuple(tensor.shape[1:]) for tensor in tensors}
    if len(sizes) > 1:
        raise ValueError(f"pictures {name!r} of a batch must have one size, got {sorted(sizes)}")
    return torch.stack(tensors)


def _finished(batch: Any) -> Batch:
    return Batch(views=as_pictures(batch.views), samples=batch.samples, indices=batch.indices)
