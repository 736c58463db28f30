"""Blocks of pictures, noise, and the training of NutNet's autoencoder."""

from __future__ import annotations

import pytest
import torch

from gear.plugins.defenses.masking.block_autoencoder import (
    BLOCK_PX,
    BlockAutoencoder,
    blocks_of,
    joined,
    noise_blocks,
    train,
)
from gear.values.rng import derive_rng


def test_the_autoencoder_is_the_size_of_the_authors() -> None:
    """3 x 8, 8 x 16 and 16 x 32 channels with kernels of 2 x 2, with biases, there and back."""
    network = BlockAutoencoder()
    weights = 2 * 4 * (3 * 8 + 8 * 16 + 16 * 32)
    assert sum(one.numel() for one in network.parameters()) == weights + (8 + 16 + 32) + (16 + 8 + 3)
    assert network(torch.zeros(2, 3, BLOCK_PX, BLOCK_PX)).shape == (2, 3, BLOCK_PX, BLOCK_PX)


@pytest.mark.parametrize(("height", "width"), [(13, 26), (20, 31), (1, 1)])
def test_blocks_join_to_the_picture_again(height: int, width: int) -> None:
    pictures = torch.arange(2 * 3 * height * width, dtype=torch.float32).reshape(2, 3, height, width)
    blocks = blocks_of(pictures)
    assert blocks.shape == (2 * -(-height // 13) * -(-width // 13), 3, 13, 13)
    assert torch.equal(joined(blocks[:, 1], 2, height, width), pictures[:, 1])


def test_noise_has_squares_of_one_colour() -> None:
    found = noise_blocks(40, derive_rng(0, "noise"))
    assert found.shape == (40, 3, 13, 13) and float(found.abs().max()) <= 1
    sides = {next(side for side in (4, 3, 2, 1) if (one[:, :side, :side] == one[:, :1, :1]).all()) for one in found}
    assert sides == {1, 2, 3, 4}


def test_training_restores_clean_blocks_and_not_noise() -> None:
    rows = torch.linspace(-0.8, 0.8, 40)[None, :, None].expand(3, 40, 60)
    network = train([rows.contiguous()], steps=300, rng=derive_rng(0, "train"))
    clean, noise = blocks_of(rows[None].contiguous()), noise_blocks(50, derive_rng(1, "noise"))
    with torch.no_grad():
        lost = [float((network(one) - one).square().mean()) for one in (clean, noise)]
    assert lost[0] < 0.05 and lost[1] > 0.2, lost
    again = train([rows.contiguous()], steps=5, rng=derive_rng(0, "train"))
    other = train([rows.contiguous()], steps=5, rng=derive_rng(0, "train"))
    assert all(torch.equal(a, b) for a, b in zip(again.parameters(), other.parameters(), strict=True))
    assert not any(one.requires_grad for one in again.parameters())
