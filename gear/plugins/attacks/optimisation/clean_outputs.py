"""A cache of network outputs on pictures without a patch; these outputs stay the same during an attack."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import Tensor

from gear.contracts.models import Model


class CleanOutputs:
    """A cache of values that an objective computes on pictures without a patch, by network and sample."""

    def __init__(self) -> None:
        self._kept: dict[tuple[int, int], Tensor] = {}

    def of(self, model: Model, samples: Sequence[Any], indices: Sequence[int], ask: Callable[[Any], Tensor]) -> Tensor:
        """Returns the values of a batch, (B, ...) in main memory; missing values are computed and stored.

        Args:
            model: network on whose outputs the values depend.
            samples: samples of the batch.
            indices: indices of the samples in the dataset, under which the values are stored.
            ask: function that computes the value of one sample; it runs without gradients.
        """
        for sample, index in zip(samples, indices, strict=True):
            if (id(model), index) not in self._kept:
                with torch.no_grad():
                    self._kept[id(model), index] = ask(sample).cpu()
        return torch.stack([self._kept[id(model), index] for index in indices])
