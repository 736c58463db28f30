"""Supplies training batches endlessly; threads decode and augment samples while the network trains."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import torch

from gear.augment.apply import augment
from gear.readers import Batch, Change, Item, TorchDataset, as_pictures, order, stacked
from gear.values.errors import GearError
from gear.values.rng import derive_rng
from gear.verbs.train.config import TrainConfig

BATCHES_AHEAD = 3
"""Number of training batches that threads prepare in advance."""


@dataclass(frozen=True, slots=True)
class Position:
    """The position of a training in its data.

    Attributes:
        epoch: number of finished passes over the data.
        batch: number of finished batches of the current pass.
    """

    epoch: int = 0
    batch: int = 0

    def following(self, batches: int) -> Position:
        """Returns the position after one more batch; `batches` is the number of batches per pass."""
        return Position(self.epoch, self.batch + 1) if self.batch + 1 < batches else Position(self.epoch + 1, 0)


class Feed:
    """Supplies batches, starting at any position. A batch depends only on the seed, the position and the samples."""

    def __init__(
        self,
        samples: Sequence[Any],
        config: TrainConfig,
        views: Sequence[str],
        change: Change | None = None,
        *,
        device: torch.device | str = "cpu",
    ) -> None:
        """Prepares the supply; threads start with `from_position`.

        Args:
            samples: training samples.
            config: config with batch size, seed, crops, augmentation and number of threads.
            views: names of the cameras whose pictures the network uses.
            change: function that is applied to each sample before augmentation, such as `Adversary.change`.
            device: device of the batches. Pictures are copied to it as uint8 and converted to floats on it.

        Raises:
            GearError: there are no samples.
        """
        if not len(samples):
            raise GearError("there is no sample to train on")
        self._items = TorchDataset(samples, views=views, change=change, seed=config.seed)
        self._config = config
        self._device = torch.device(device)
        self._size = min(config.batch, len(samples))
        self.batches = len(samples) // self._size

    def from_position(self, position: Position) -> Generator[Batch]:
        """Yields the batches from a position on, without end. Closing the generator ends its threads."""
        pool = ThreadPoolExecutor(self._config.workers, thread_name_prefix="gear-train")
        joining = ThreadPoolExecutor(1, thread_name_prefix="gear-train-batch")
        ahead: deque[Future[Batch]] = deque()
        try:
            while True:
                while len(ahead) < BATCHES_AHEAD:
                    indices = self._indices(position)
                    made = [pool.submit(self._item, position.epoch, index) for index in indices]
                    ahead.append(joining.submit(self._batch, made))
                    position = position.following(self.batches)
                yield ahead.popleft().result()
        finally:
            for threads in (pool, joining):
                threads.shutdown(wait=True, cancel_futures=True)

    def _indices(self, position: Position) -> tuple[int, ...]:
        """Returns the sample indices of the batch at a position; an incomplete last batch of a pass is left out."""
        shuffled = order(len(self._items), seed=self._config.seed, epoch=position.epoch)
        start = position.batch * self._size
        return tuple(shuffled[start : start + self._size])

    def _item(self, epoch: int, index: int) -> Item:
        """Returns an augmented sample whose pictures are uint8 tensors."""
        item = self._items.item(index, epoch)
        rng = derive_rng(self._config.seed, "augment", epoch, index)
        shown = replace(item, sample=augment(item.sample, self._config.augmentation, self._config.framing, rng))
        _ = shown.views  # converts the pictures in this thread, because a single thread stacks batches
        return shown

    def _batch(self, making: Sequence[Future[Item]]) -> Batch:
        """Stacks samples to a batch and copies it to the network's device without blocking the training thread."""
        items = [future.result() for future in making]
        try:
            batch = stacked(items)
        except ValueError as error:
            raise GearError(f"{error}; say --set crop_px=[HEIGHT, WIDTH]") from error
        views = {name: self._there(pictures) for name, pictures in batch.views.items()}
        return replace(batch, views=as_pictures(views))

    def _there(self, pictures: torch.Tensor) -> torch.Tensor:
        if self._device.type == "cuda":
            pictures = pictures.pin_memory()
        return pictures.to(self._device, non_blocking=True)
