"""Batches without end: decoded once where memory allows, augmented beside the network's own work."""

from __future__ import annotations

import dataclasses
import threading
from collections import deque
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from gear.augment.apply import augment
from gear.readers import Batch, as_pictures, order, picture_tensor
from gear.values.errors import GearError
from gear.values.rng import derive_rng
from gear.verbs.train.config import TrainConfig

BATCHES_AHEAD = 3
"""Made while the network is busy with an earlier one."""

Change = Callable[[Any, int, np.random.Generator], Any]
"""Changes a decoded sample of a given number before it is augmented, such as by putting a patch into its pictures."""


class Cache(Sequence[Any]):
    """Samples that stay in memory once they were decoded, up to a limit. Threads may share it."""

    def __init__(self, samples: Sequence[Any], limit_bytes: float) -> None:
        self._samples = samples
        self._left = limit_bytes
        self._kept: dict[int, Any] = {}
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return len(self._samples)

    def __getitem__(self, index: Any) -> Any:
        kept = self._kept.get(index)
        if kept is not None:
            return kept
        sample = self._samples[index]
        size = bytes_of(sample)
        with self._lock:
            if size <= self._left and index not in self._kept:
                self._kept[index] = sample
                self._left -= size
        return sample


def bytes_of(sample: Any) -> int:
    """Memory of the arrays of a sample."""
    total = 0
    for field in dataclasses.fields(sample):
        value = getattr(sample, field.name)
        items = value.values() if isinstance(value, Mapping) else (value,)
        total += sum(item.nbytes for item in items if isinstance(item, np.ndarray))
    return total


@dataclass(frozen=True, slots=True)
class Position:
    """Where a training stands in its data.

    Attributes:
        epoch: passes that are over.
        batch: batches of this pass that are over.
    """

    epoch: int = 0
    batch: int = 0

    def following(self, batches: int) -> Position:
        """After one more batch, with so many in a pass."""
        return Position(self.epoch, self.batch + 1) if self.batch + 1 < batches else Position(self.epoch + 1, 0)


class Feed:
    """Batches from a position on. What a batch holds follows from the seed, the position and the samples alone."""

    def __init__(
        self,
        samples: Sequence[Any],
        config: TrainConfig,
        views: Sequence[str],
        change: Change | None = None,
        *,
        device: torch.device | str = "cpu",
    ) -> None:
        """Args:
        samples: to train on.
        config: batch size, seed, framing, augmentation, threads.
        views: cameras that the network looks at.
        change: applied before augmentation.
        device: where pictures are to be: they go there as bytes and become numbers there.

        Raises:
            GearError: there is not even one sample.
        """
        if not len(samples):
            raise GearError("there is no sample to train on")
        self._samples, self._config, self._views, self._change = samples, config, tuple(views), change
        self._device = torch.device(device)
        self._size = min(config.batch, len(samples))
        self.batches = len(samples) // self._size

    def from_position(self, position: Position) -> Generator[Batch]:
        """Batches of this pass and all that follow; close the iterator to end its threads."""
        pool = ThreadPoolExecutor(self._config.workers, thread_name_prefix="gear-train")
        joining = ThreadPoolExecutor(1, thread_name_prefix="gear-train-batch")
        ahead: deque[Future[Batch]] = deque()
        try:
            while True:
                while len(ahead) < BATCHES_AHEAD:
                    indices = self._indices(position)
                    made = [pool.submit(self._sample, position.epoch, index) for index in indices]
                    ahead.append(joining.submit(self._batch, indices, made))
                    position = position.following(self.batches)
                yield ahead.popleft().result()
        finally:
            for threads in (pool, joining):
                threads.shutdown(wait=True, cancel_futures=True)

    def _indices(self, position: Position) -> tuple[int, ...]:
        """A last batch that would not be full is left out."""
        shuffled = order(len(self._samples), seed=self._config.seed, epoch=position.epoch)
        start = position.batch * self._size
        return tuple(shuffled[start : start + self._size])

    def _sample(self, epoch: int, index: int) -> tuple[Any, dict[str, torch.Tensor]]:
        """An augmented sample, and its pictures as tensors of uint8."""
        sample = self._samples[index]
        if self._change is not None:
            sample = self._change(sample, index, derive_rng(self._config.seed, "change", epoch, index))
        rng = derive_rng(self._config.seed, "augment", epoch, index)
        shown = augment(sample, self._config.augmentation, self._config.framing, rng)
        return shown, {name: picture_tensor(shown.images[name]) for name in self._views}

    def _batch(self, indices: tuple[int, ...], making: Sequence[Future[tuple[Any, dict[str, torch.Tensor]]]]) -> Batch:
        """A whole batch, where the network is; the thread that steps does not wait for a copy to a GPU."""
        made = [future.result() for future in making]
        tensors = {}
        for name in self._views:
            pictures = [views[name] for _, views in made]
            sizes = sorted({tuple(picture.shape[1:]) for picture in pictures})
            if len(sizes) > 1:
                raise GearError(f"training pictures differ in size ({sizes}); say --set crop_px=[HEIGHT, WIDTH]")
            stacked = torch.stack(pictures)
            if self._device.type == "cuda":
                stacked = stacked.pin_memory()
            tensors[name] = stacked.to(self._device, non_blocking=True)
        return Batch(views=as_pictures(tensors), samples=tuple(sample for sample, _ in made), indices=indices)
