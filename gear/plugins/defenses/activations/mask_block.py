"""Z-Mask's fusion block: computes a mask and a score from two heat maps, with eight calibrated parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from gear.values.progress import NO_CALLBACKS, Progress

LEARNING_RATE, BATCH, CELLS = 0.01, 15, 4096
NUMBERS = 8

COVERED_FROM = 0.5
"""Cells whose mask value is above this threshold are covered."""

LEAST_GAIN, LEAST_IOU = 0.95, 0.05
"""Limits for a successful training: the block's loss must be below the first number times the loss of the best
constant prediction, and its IoU must be at least the second number.
"""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Example:
    """A training example of the fusion block: two heat maps and the true mask of one picture, (rows, columns) each.

    Attributes:
        shallow, deep: heat maps of shallow and of deep layers.
        truth: 1 in cells that the patch covers, 0 elsewhere.
    """

    shallow: Tensor
    deep: Tensor
    truth: Tensor


@dataclass(frozen=True, slots=True, eq=False)
class MaskBlock:
    """Z-Mask's fusion block with its parameters.

    Attributes:
        numbers: (8,) parameters of the gate (v', c', v, c) and of the mask (w', b', w, b), as in the formula of `mask`.
    """

    numbers: Tensor

    def mask(self, shallow: Tensor, deep: Tensor) -> Tensor:
        """Returns the probability in 0..1 that each cell shows a patch, in the shape of the heat maps.

        The deep map opens a gate for the shallow map: M = sigmoid(w tanh(w' (H_S G) + b') + b) with G = sigmoid(v
        tanh(v' H_D + c') + c).

        Args:
            shallow, deep: heat maps H_S of the shallow and H_D of the deep layers, of any common shape.
        """
        gate_in, gate_in_offset, gate_out, gate_out_offset, mask_in, mask_in_offset, mask_out, mask_out_offset = (
            self.numbers
        )
        gate = torch.sigmoid(gate_out * torch.tanh(gate_in * deep + gate_in_offset) + gate_out_offset)
        inner = torch.tanh(mask_in * (shallow * gate) + mask_in_offset)
        return torch.sigmoid(mask_out * inner + mask_out_offset)

    def score(self, shallow: Tensor, deep: Tensor) -> float:
        """The raw score of an attack, 0 or more: sum(H_D H_S M) / (1 + sum M).

        It is high if the shallow heat map H_S and the deep heat map H_D are both high under the mask M.

        Args:
            shallow, deep: (rows, columns) heat maps of the shallow and of the deep layers.
        """
        return float(self.score_tensor(shallow, deep))

    def score_tensor(self, shallow: Tensor, deep: Tensor) -> Tensor:
        """The raw score of an attack, 0 or more, as a scalar tensor with gradients with respect to both heat maps.

        The formula is that of `score`.

        Args:
            shallow, deep: (rows, columns) heat maps of the shallow and of the deep layers.
        """
        mask = self.mask(shallow, deep)
        return (deep * shallow * mask).sum() / (1 + mask.sum())


def learn(
    examples: Sequence[Example], steps: int, rng: np.random.Generator, on_step: Progress = NO_CALLBACKS.on_progress
) -> MaskBlock:
    """Calibrates a fusion block with Adam on the cross-entropy with the true masks; initial parameters come from
    U(0, 1).

    Initialisation and loss are the published ones. Each step uses a random subset of each picture's cells, which is
    enough for eight parameters and ten times as fast.

    Args:
        examples: training examples, at least one, all on the same grid.
        steps: number of steps, each over 15 pictures, or over all if there are fewer.
        rng: random generator of the initial parameters and of the subsets.
        on_step: called with the numbers of finished and of all steps after every step.
    """
    numbers = torch.tensor(rng.uniform(0, 1, NUMBERS), dtype=torch.float32, requires_grad=True)
    optimiser = torch.optim.Adam([numbers], lr=LEARNING_RATE)
    shallow, deep, truth = _stacked(examples)
    count, cells = shallow.shape
    with torch.enable_grad():
        for step in range(steps):
            rows = torch.from_numpy(rng.permutation(count)[:BATCH])[:, None]
            columns = torch.from_numpy(rng.integers(0, cells, (len(rows), min(cells, CELLS))))
            said = MaskBlock(numbers).mask(shallow[rows, columns], deep[rows, columns])
            loss = functional.binary_cross_entropy(said, truth[rows, columns])
            optimiser.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            optimiser.step()
            on_step(step + 1, steps)
    return MaskBlock(numbers.detach())


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """The quality of a fusion block on its own training examples.

    Attributes:
        loss: mean cross-entropy with the true masks.
        constant_loss: loss of the best constant prediction, which does not use the heat maps.
        iou: IoU of the mask, thresholded at 0.5, with the true mask, over all examples together.
        share: share of the cells that show a patch.
    """

    loss: float
    constant_loss: float
    iou: float
    share: float

    @property
    def has_learnt(self) -> bool:
        """Returns whether the calibration succeeded: the loss is clearly below that of a constant prediction, and
        the mask overlaps some of the patches.
        """
        return self.loss < LEAST_GAIN * self.constant_loss and self.iou >= LEAST_IOU


def fit_of(block: MaskBlock, examples: Sequence[Example]) -> Fit:
    """Measures the quality of a fusion block on training examples.

    Args:
        block: the fusion block with its parameters.
        examples: examples that share one grid, at least one.
    """
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
    """The shallow heat maps, the deep heat maps and the true masks of all examples, (examples, cells) each."""
    shallow, deep, truth = (
        torch.stack([getattr(one, name).flatten() for one in examples]) for name in ("shallow", "deep", "truth")
    )
    return shallow, deep, truth
