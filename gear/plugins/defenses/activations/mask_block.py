"""From two heat maps to a mask and a score: Z-Mask's fusion block, eight numbers that are learnt."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

LEARNING_RATE, BATCH, CELLS = 0.01, 15, 4096
NUMBERS = 8


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Example:
    """What the block learns from; all (rows, columns).

    Attributes:
        shallow, deep: heat maps.
        truth: 1 where the patch is, 0 elsewhere.
    """

    shallow: Tensor
    deep: Tensor
    truth: Tensor


@dataclass(frozen=True, slots=True, eq=False)
class MaskBlock:
    """Attributes:
    numbers: (8,): weights and offsets of the gate, of the mask, and of the mask's own gate.
    """

    numbers: Tensor

    def mask(self, shallow: Tensor, deep: Tensor) -> Tensor:
        """Where the patch is believed to be, in 0..1; any shape.

        The deep map opens a gate for the shallow one: M = sigmoid(w tanh(w' (H_S G) + b') + b) with
        G = sigmoid(v tanh(v' H_D + c') + c).
        """
        gate_in, gate_in_offset, gate_out, gate_out_offset, mask_in, mask_in_offset, mask_out, mask_out_offset = (
            self.numbers
        )
        gate = torch.sigmoid(gate_out * torch.tanh(gate_in * deep + gate_in_offset) + gate_out_offset)
        inner = torch.tanh(mask_in * (shallow * gate) + mask_in_offset)
        return torch.sigmoid(mask_out * inner + mask_out_offset)

    def score(self, shallow: Tensor, deep: Tensor) -> float:
        """How much both maps agree on under the mask: sum(H_D H_S M) / (1 + sum M), 0 or more."""
        return float(self.score_tensor(shallow, deep))

    def score_tensor(self, shallow: Tensor, deep: Tensor) -> Tensor:
        """As `score`, with the gradient to both maps."""
        mask = self.mask(shallow, deep)
        return (deep * shallow * mask).sum() / (1 + mask.sum())


def learn(examples: Sequence[Example], steps: int, rng: np.random.Generator) -> MaskBlock:
    """Cross-entropy with the true masks, Adam, numbers drawn from U(0, 1) at first, as published.

    Steps see some of a picture's cells, drawn anew each time: eight numbers need no more, and it is ten times as fast.

    Args:
        examples: at least one, on one grid.
        steps: of 15 pictures each, or of all where there are fewer.
        rng: of the first numbers, and of what each step sees.
    """
    numbers = torch.tensor(rng.uniform(0, 1, NUMBERS), dtype=torch.float32, requires_grad=True)
    optimiser = torch.optim.Adam([numbers], lr=LEARNING_RATE)
    shallow, deep, truth = (
        torch.stack([getattr(one, name).flatten() for one in examples]) for name in ("shallow", "deep", "truth")
    )
    count, cells = shallow.shape
    with torch.enable_grad():
        for _ in range(steps):
            rows = torch.from_numpy(rng.permutation(count)[:BATCH])[:, None]
            columns = torch.from_numpy(rng.integers(0, cells, (len(rows), min(cells, CELLS))))
            said = MaskBlock(numbers).mask(shallow[rows, columns], deep[rows, columns])
            loss = functional.binary_cross_entropy(said, truth[rows, columns])
            optimiser.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            optimiser.step()
    return MaskBlock(numbers.detach())
