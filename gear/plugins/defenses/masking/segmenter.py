"""The U-Net that segments patches, and its training (Liu et al., Segment and Complete, CVPR 2022, section 3.2)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

DEPTH = 4
"""Number of times that the U-Net halves the picture."""

LEARNING_RATE, BATCH, CROP_PX, CLEAN_SHARE = 1e-3, 4, 96, 0.3
"""Adam's learning rate, crops per step, side of the crops, and share of crops from clean pictures (the authors'
share).
"""


class SegmenterNetwork(nn.Module):
    """A U-Net with bilinear upsampling: RGB in 0..1 to one logit per pixel.

    Args:
        filters: number of channels at the picture's resolution; each halving doubles it.
    """

    def __init__(self, filters: int) -> None:
        super().__init__()
        sizes = [filters * 2**level for level in range(DEPTH)] + [filters * 2 ** (DEPTH - 1)]
        self.first = _double(3, sizes[0], sizes[0])
        self.down = nn.ModuleList(_double(before, after, after) for before, after in pairwise(sizes))
        ups = []
        for level in reversed(range(DEPTH)):
            joined, after = 2 * sizes[level], sizes[max(level - 1, 0)]
            ups.append(_double(joined, joined // 2, after))
        self.up = nn.ModuleList(ups)
        self.last = nn.Conv2d(sizes[0], 1, 1)

    def forward(self, pictures: Tensor) -> Tensor:
        """Returns (B, H, W) logits that a pixel shows a patch.

        Args:
            pictures: (B, 3, H, W) in 0..1, at least 16 pixels in each direction.
        """
        levels = [self.first(pictures)]
        for block in self.down:
            levels.append(block(functional.max_pool2d(levels[-1], 2)))
        features = levels.pop()
        for block in self.up:
            finer = levels.pop()
            size = finer.shape[2:]
            features = functional.interpolate(features, size=size, mode="bilinear", align_corners=True)
            features = block(torch.cat([finer, features], dim=1))
        logits: Tensor = self.last(features)
        return logits[:, 0]


def train(
    clean: Sequence[Tensor],
    patched: Sequence[Tensor],
    truths: Sequence[Tensor],
    *,
    filters: int,
    steps: int,
    rng: np.random.Generator,
) -> SegmenterNetwork:
    """Trains a segmenter on random crops with the binary cross-entropy, and returns it in evaluation mode.

    Seven in ten crops show a patch at least in part. The authors train on 55,000 pictures with patches that were
    optimised against a detector, with RMSprop and a learning rate of 1e-4, and then on patches that were optimised
    against the segmenter itself. A calibration has a few dozen pictures, so a few hundred steps of Adam must do.

    Args:
        clean, patched: (3, H, W) pictures in 0..1 without and with the patch.
        truths: (H, W) masks, 1 where a picture of `patched` shows the patch.
        filters: number of channels of the U-Net at the picture's resolution.
        steps: number of training steps.
        rng: random generator of initial weights and crops.
    """
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(int(rng.integers(2**31)))
        network = SegmenterNetwork(filters)
    network.train()
    optimiser = torch.optim.Adam(network.parameters(), lr=LEARNING_RATE)
    with torch.enable_grad():
        for _ in range(steps):
            crops, targets = [], []
            for _ in range(BATCH):
                number = int(rng.integers(len(patched)))
                is_clean = rng.random() < CLEAN_SHARE
                rows, columns = _crop(truths[number], rng)
                crops.append((clean if is_clean else patched)[number][:, rows, columns])
                truth = truths[number][rows, columns]
                targets.append(torch.zeros_like(truth) if is_clean else truth)
            loss = functional.binary_cross_entropy_with_logits(network(torch.stack(crops)), torch.stack(targets))
            optimiser.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            optimiser.step()
    return network.eval().requires_grad_(False)


def _crop(truth: Tensor, rng: np.random.Generator) -> tuple[slice, slice]:
    """A crop around a random pixel of the patch, moved by up to half a crop."""
    pixels = truth.nonzero()
    centre = pixels[int(rng.integers(len(pixels)))].tolist()
    found = []
    for at, size in zip(centre, truth.shape, strict=True):
        side = min(CROP_PX, size)
        start = int(np.clip(at - side // 2 + rng.integers(-side // 2, side // 2 + 1), 0, size - side))
        found.append(slice(start, start + side))
    return found[0], found[1]


def _double(before: int, between: int, after: int) -> nn.Sequential:
    """Two 3 x 3 convolutions, each with batch normalisation and ReLU."""
    layers: list[nn.Module] = []
    for source, target in ((before, between), (between, after)):
        layers += [nn.Conv2d(source, target, 3, padding=1), nn.BatchNorm2d(target), nn.ReLU()]
    return nn.Sequential(*layers)
