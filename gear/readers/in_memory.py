"""A cache of decoded samples with a memory limit."""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gear.values.lazy_sequence import LazySequence


class Kept(LazySequence[Any]):
    """Samples that stay in memory after their first access, until a limit of bytes is reached.

    A sample in memory is never replaced by another one. Every pass over the data, in any order, therefore finds the
    same number of samples in memory. Several threads may share the cache.
    """

    def __init__(self, samples: Sequence[Any], limit_bytes: float) -> None:
        """Prepares an empty cache.

        Args:
            samples: the samples, which are read from disk when they are indexed.
            limit_bytes: memory for the arrays of all kept samples together.
        """
        self._samples = samples
        self._left = limit_bytes
        self._kept: dict[int, Any] = {}
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return len(self._samples)

    def item(self, index: int) -> Any:
        """Returns the sample `index` from memory, or reads it and keeps it if there is room."""
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
    """The memory of all NumPy arrays of a sample, in bytes."""
    total = 0
    for field in dataclasses.fields(sample):
        value = getattr(sample, field.name)
        items = value.values() if isinstance(value, Mapping) else (value,)
        total += sum(item.nbytes for item in items if isinstance(item, np.ndarray))
    return total
