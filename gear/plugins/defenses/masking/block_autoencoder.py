"""The autoencoder of NutNet (Lin et al., CCS 2024) for small blocks of pictures, and its training."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

BLOCK_PX = 13
"""Side of a block: the authors divide pictures of 416 pixels into 32 blocks in each direction."""

LEARNING_RATE, BATCH = 2e-3, 128
"""Adam's learning rate, and the number of clean blocks, and of noise blocks, of a training step."""

BANK = 8192
"""Number of clean blocks, and of noise blocks, from which training steps draw."""

CELLS_PX = (1, 2, 3, 4)
"""Sides of the squares of one colour in noise blocks."""


class BlockAutoencoder(nn.Module):
    """The authors' autoencoder for blocks of 13 x 13 pixels: three convolutions, mirrored, 5,395 parameters."""

    def __init__(self) -> None:
        super().__init__()
        self.encoder = nn.Sequential(
            nn.Conv2d(3, 8, 2, stride=1, padding=1), nn.ReLU(),
            nn.Conv2d(8, 16, 2, stride=2, padding=1), nn.ReLU(),
            nn.Conv2d(16, 32, 2, stride=2, padding=1), nn.ReLU(),
        )  # fmt: skip
        self.decoder = nn.Sequential(
            nn.ConvTranspose2d(32, 16, 2, stride=2, padding=1), nn.ReLU(),
            nn.ConvTranspose2d(16, 8, 2, stride=2, padding=1), nn.ReLU(),
            nn.ConvTranspose2d(8, 3, 2, stride=1, padding=1), nn.Tanh(),
        )  # fmt: skip

    def forward(self, blocks: Tensor) -> Tensor:
        """Returns the (N, 3, 13, 13) reconstruction in -1..1.

        Args:
            blocks: (N, 3, 13, 13) in -1..1.
        """
        found: Tensor = self.decoder(self.encoder(blocks))
        return found


def blocks_of(pictures: Tensor) -> Tensor:
    """Returns the blocks of pictures, (B * rows * columns, 3, 13, 13), row by row.

    The last row and column of blocks are completed with the pixels at the border of the picture.

    Args:
        pictures: (B, 3, H, W), at least one pixel.
    """
    height, width = pictures.shape[2:]
    padded = functional.pad(pictures, (0, -width % BLOCK_PX, 0, -height % BLOCK_PX), mode="replicate")
    tiles = padded.unfold(2, BLOCK_PX, BLOCK_PX).unfold(3, BLOCK_PX, BLOCK_PX)
    return tiles.permute(0, 2, 3, 1, 4, 5).reshape(-1, pictures.shape[1], BLOCK_PX, BLOCK_PX)


def joined(blocks: Tensor, batch: int, height: int, width: int) -> Tensor:
    """Returns (B, H, W) maps from the blocks of `blocks_of`.

    Args:
        blocks: (B * rows * columns, 13, 13) values.
        batch, height, width: number and size of the pictures.
    """
    rows, columns = -(-height // BLOCK_PX), -(-width // BLOCK_PX)
    tiles = blocks.reshape(batch, rows, columns, BLOCK_PX, BLOCK_PX).permute(0, 1, 3, 2, 4)
    return tiles.reshape(batch, rows * BLOCK_PX, columns * BLOCK_PX)[:, :height, :width]


def noise_blocks(count: int, rng: np.random.Generator) -> Tensor:
    """Returns (N, 3, 13, 13) blocks of random colours in -1..1, in squares of 1 to 4 pixels.

    Args:
        count: number of blocks.
        rng: random generator.
    """
    colours = torch.from_numpy(rng.uniform(-1, 1, (count, 3, BLOCK_PX, BLOCK_PX)).astype(np.float32))
    sides, places = rng.choice(CELLS_PX, count), torch.arange(BLOCK_PX)
    for side in CELLS_PX:
        cells = places // side
        chosen = torch.from_numpy(sides == side)
        colours[chosen] = colours[chosen][:, :, cells][:, :, :, cells]
    return colours


def random_blocks(pictures: Sequence[Tensor], count: int, rng: np.random.Generator) -> Tensor:
    """Returns (N, 3, 13, 13) blocks at random places of the pictures, equally many of each, at least `count`.

    Args:
        pictures: (3, H, W) each, at least 13 pixels in each direction.
        count: least number of blocks.
        rng: random generator.
    """
    found = []
    for picture in pictures:
        windows = picture.unfold(1, BLOCK_PX, 1).unfold(2, BLOCK_PX, 1)
        size = -(-count // len(pictures))
        rows, columns = (torch.from_numpy(rng.integers(windows.shape[axis], size=size)) for axis in (1, 2))
        found.append(windows[:, rows, columns].transpose(0, 1))
    return torch.cat(found)


def train(pictures: Sequence[Tensor], *, steps: int, rng: np.random.Generator) -> BlockAutoencoder:
    """Trains an autoencoder on blocks at random places of clean pictures, and returns it in evaluation mode.

    Clean blocks are to be reconstructed. Blocks of random colours are to become grey, so that the autoencoder learns
    not to reconstruct what it does not know. This stands for the authors' "destructive training", whose recipe is not
    in their published code.

    Args:
        pictures: (3, H, W) clean pictures in -1..1, at least 13 pixels in each direction.
        steps: number of training steps.
        rng: random generator of initial weights, places and noise.
    """
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(int(rng.integers(2**31)))
        network = BlockAutoencoder()
    network.train()
    clean, noise = random_blocks(pictures, BANK, rng), noise_blocks(BANK, rng)
    optimiser = torch.optim.Adam(network.parameters(), lr=LEARNING_RATE)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
    with torch.enable_grad():
        for _ in range(steps):
            known, unknown = (one[torch.from_numpy(rng.integers(len(one), size=BATCH))] for one in (clean, noise))
            wanted = torch.cat([known, torch.zeros_like(unknown)])
            loss = functional.mse_loss(network(torch.cat([known, unknown])), wanted)
            optimiser.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            optimiser.step()
            schedule.step()
    return network.eval().requires_grad_(False)
