"""From two heat maps to a mask and a score: Z-Mask's fusion block, eight numbers that are learnt."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

LEARNING_RATE, BATCH, CELLS = 0.01, 15, 4096
NUMBERS = 8

COVERED_FROM = 0.5
"""Mask from which a cell is covered."""

LEAST_GAIN, LEAST_IOU = 0.95, 0.05
"""A block that ends above this share of the constant answer's loss, or below this IoU, has learnt nothing."""


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
    shallow, deep, truth = _stacked(examples)
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """How well a block knows its own examples.

    Attributes:
        loss: mean cross-entropy with the true masks.
        constant_loss: that of the best constant answer, which knows nothing of the maps.
        iou: of the mask from 0.5 on with the true one, over all examples together.
        share: of the cells that show a patch.
    """

    loss: float
    constant_loss: float
    iou: float
    share: float

    @property
    def has_learnt(self) -> bool:
        """Whether the maps tell the block more than a constant, and it finds some of the patches."""
        return self.loss < LEAST_GAIN * self.constant_loss and self.iou >= LEAST_IOU


def fit_of(block: MaskBlock, examples: Sequence[Example]) -> Fit:
    """Measures a block on examples of one grid."""
    shallow, deep, truth = _stacked(examples)
    said = block.mask(shallow, deep)
    share = float(truth.double().mean())
    covered, is_patch = said > COVERED_FROM, truth > COVERED_FROM
    either = int((covered | is_patch).sum())
    entropy = -sum(p * math.log(p) for p in (share, 1 - share) if p > 0)
    return Fit(
        loss=float(functional.binary_cross_entropy(said, truth)),
        constant_loss=entropy,
        iou=int((covered & is_patch).sum()) / either if either else 0.0,
        share=share,
    )


def _stacked(examples: Sequence[Example]) -> tuple[Tensor, Tensor, Tensor]:
    """(examples, cells) shallow and deep heat maps, and truth."""
    shallow, deep, truth = (
        torch.stack([getattr(one, name).flatten() for one in examples]) for name in ("shallow", "deep", "truth")
    )
    return shallow, deep, truth
