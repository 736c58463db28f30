"""What networks say of pictures without a patch: asked once, because no patch changes it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import Tensor

from gear.contracts.models import Model


class CleanAnswers:
    """Keeps answers, or what an objective makes of them, by network and sample."""

    def __init__(self) -> None:
        self._kept: dict[tuple[int, int], Tensor] = {}

    def of(self, model: Model, samples: Sequence[Any], indexes: Sequence[int], ask: Callable[[Any], Tensor]) -> Tensor:
        """(B, ...) of a batch, in main memory.

        Args:
            model: whose answers these are.
            samples: the batch's samples.
            indexes: their numbers in the data set.
            ask: what there is to keep of a sample that was not asked about before; runs without gradients.
        """
        for sample, index in zip(samples, indexes, strict=True):
            if (id(model), index) not in self._kept:
                with torch.no_grad():
                    self._kept[id(model), index] = ask(sample).cpu()
        return torch.stack([self._kept[id(model), index] for index in indexes])
