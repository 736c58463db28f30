"""A sparse autoencoder that completes masks of patches, as Jedi trains it (Tarchoun et al., CVPR 2023, section 4.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

Bool = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float32]

WEIGHT_DECAY, SPARSITY, ACTIVE_SHARE = 0.004, 4.0, 0.15
"""Weight of the squared weights, weight of the sparsity, and desired mean activation of a hidden unit
(autoencoder_train.m).
"""

LEVEL = 0.33
"""Output above which a cell belongs to the completed mask (jedi.m)."""

AUTHORS_PIXELS = 224 * 224
"""Pixels of the authors' masks. The summed error of a coarser grid is multiplied accordingly, so that the weights above
mean the same.
"""

SCALES = (0.5, 1.5)
"""Range of random resizing of the training masks."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ShapeAutoencoder:
    """An autoencoder of masks with one hidden layer: sigmoid(decode sigmoid(encode x + b) + c).

    Attributes:
        grid: rows and columns to which masks are resized.
        encode, encode_offset: (hidden, cells) weights and (hidden,) offsets of the hidden layer.
        decode, decode_offset: (cells, hidden) weights and (cells,) offsets of the output.
    """

    grid: tuple[int, int]
    encode: Floats
    encode_offset: Floats
    decode: Floats
    decode_offset: Floats

    def complete(self, mask: Bool) -> Bool:
        """Returns the completed mask, (H, W) bool; an empty mask stays empty.

        Args:
            mask: (H, W) bool.
        """
        if not mask.any():
            return mask.copy()
        hidden = _sigmoid(self.encode @ to_grid(mask, self.grid).reshape(-1) + self.encode_offset)
        cells = _sigmoid(self.decode @ hidden + self.decode_offset).reshape(self.grid)
        size = mask.shape[::-1]
        return np.asarray(cv2.resize(cells.astype(np.float32), size, interpolation=cv2.INTER_LINEAR)) > LEVEL


def to_grid(mask: Bool, grid: tuple[int, int]) -> Floats:
    """Returns the share of each cell of a grid that a mask covers, (rows, columns) float32.

    Args:
        mask: (H, W) bool.
        grid: rows and columns of the grid.
    """
    return np.asarray(cv2.resize(mask.astype(np.float32), (grid[1], grid[0]), interpolation=cv2.INTER_AREA), np.float32)


def train(
    masks: Sequence[Bool], rows: int, hidden: int, epochs: int, draws: int, rng: np.random.Generator
) -> ShapeAutoencoder:
    """Trains an autoencoder on true masks of patches that are moved and resized at random.

    The loss is that of MATLAB's `trainAutoencoder`, as the authors use it: the mean over the masks of the summed
    squared error, plus half the squared weights, plus the Kullback-Leibler divergence of each hidden unit's mean
    activation from the desired one. The optimiser is L-BFGS on all masks at once; theirs is scaled conjugate gradients,
    also on all masks at once. The authors train on thousands of masks; a calibration has a few dozen of one scene, so
    each is drawn several times, at a random place and in a random size.

    Args:
        masks: (H, W) bool masks, at least one, all with some pixels.
        rows: rows of the grid; its columns follow from the shape of the first mask.
        hidden: number of hidden units.
        epochs: number of optimisation steps.
        draws: number of training masks that are drawn.
        rng: random generator of draws and initial weights.
    """
    import torch

    height, width = masks[0].shape
    grid = (rows, max(1, round(rows * width / height)))
    drawn = np.stack([_moved(to_grid(masks[i % len(masks)], grid), rng).reshape(-1) for i in range(draws)])
    target = torch.from_numpy(drawn)
    cells = target.shape[1]
    bound = float(np.sqrt(6 / (cells + hidden)))
    start = [rng.uniform(-bound, bound, shape) for shape in ((hidden, cells), (cells, hidden))]
    encode, decode = (torch.tensor(one, dtype=torch.float32, requires_grad=True) for one in start)
    offsets = [torch.zeros(size, requires_grad=True) for size in (hidden, cells)]
    optimiser = torch.optim.LBFGS(
        [encode, decode, *offsets], max_iter=epochs, history_size=10, line_search_fn="strong_wolfe"
    )

    def loss() -> torch.Tensor:
        optimiser.zero_grad()
        active = torch.sigmoid(target @ encode.T + offsets[0])
        said = torch.sigmoid(active @ decode.T + offsets[1])
        mean = active.mean(dim=0).clamp(1e-6, 1 - 1e-6)
        divergence = (
            ACTIVE_SHARE * (ACTIVE_SHARE / mean).log() + (1 - ACTIVE_SHARE) * ((1 - ACTIVE_SHARE) / (1 - mean)).log()
        ).sum()
        weights = 0.5 * (encode.square().sum() + decode.square().sum())
        error = AUTHORS_PIXELS * (said - target).square().mean()
        total = error + WEIGHT_DECAY * weights + SPARSITY * divergence
        total.backward()  # type: ignore[no-untyped-call]
        return total

    with torch.enable_grad():
        optimiser.step(loss)  # type: ignore[no-untyped-call]
    return ShapeAutoencoder(
        grid=grid,
        encode=encode.detach().numpy(),
        encode_offset=offsets[0].detach().numpy(),
        decode=decode.detach().numpy(),
        decode_offset=offsets[1].detach().numpy(),
    )


def _moved(cells: Floats, rng: np.random.Generator) -> Floats:
    """The mask in a random size, with its centre at a random place of the grid."""
    rows, columns = cells.shape
    y, x = np.nonzero(cells > 0)
    centre = (float(x.mean()), float(y.mean()))
    scale = float(rng.uniform(*SCALES))
    to_x, to_y = float(rng.uniform(0, columns - 1)), float(rng.uniform(0, rows - 1))
    affine = np.array([[scale, 0, to_x - scale * centre[0]], [0, scale, to_y - scale * centre[1]]])
    return np.asarray(cv2.warpAffine(cells, affine, (columns, rows), flags=cv2.INTER_LINEAR), np.float32)


def _sigmoid(values: Floats) -> Floats:
    return np.asarray(1 / (1 + np.exp(-np.clip(values, -60, 60))), np.float32)
