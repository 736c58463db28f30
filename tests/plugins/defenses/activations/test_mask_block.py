"""Z-Mask's fusion block: its formulas, and that it learns."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from gear.plugins.defenses.activations.mask_block import Example, MaskBlock, learn

PUBLISHED = MaskBlock(torch.tensor([0.858, 2.156, 4.479, 3.991, 9.673, -1.271, 4.402, -1.474]))
"""What the authors' demonstration comes with."""


def example(seed: int) -> Example:
    """Heat of about 0.1, and of about 0.5 where the patch is."""
    generator = torch.Generator().manual_seed(seed)
    truth = torch.zeros(20, 40)
    row, column = (int(torch.randint(0, high, (1,), generator=generator)) for high in (12, 24))
    truth[row : row + 8, column : column + 16] = 1
    heats = [0.1 * torch.rand(20, 40, generator=generator) + 0.4 * truth for _ in range(2)]
    return Example(shallow=heats[0], deep=heats[1], truth=truth)


def test_the_published_numbers_cut_where_they_do() -> None:
    """Their gate is open whatever the deep map says, and the mask is above a half from a shallow heat of 0.167 on."""
    deep = torch.tensor([0.0, 0.0, 5.0, 5.0])
    mask = PUBLISHED.mask(torch.tensor([0.160, 0.175, 0.160, 0.175]), deep)
    assert (mask > 0.5).tolist() == [False, True, False, True]


def test_a_shut_gate_hides_the_shallow_map() -> None:
    shut = MaskBlock(torch.tensor([1.0, 0.0, 40.0, -20.0, 10.0, -1.0, 5.0, 0.0]))
    hot, cold = torch.tensor([1.0, 1.0]), torch.tensor([0.0, 3.0])
    assert (shut.mask(hot, cold) > 0.5).tolist() == [False, True]


def test_the_score_is_what_both_maps_say_under_the_mask() -> None:
    shallow, deep = torch.tensor([[0.1, 0.4]]), torch.tensor([[0.2, 0.5]])
    mask = PUBLISHED.mask(shallow, deep)
    expected = (0.02 * mask[0, 0] + 0.2 * mask[0, 1]) / (1 + mask.sum())
    assert PUBLISHED.score(shallow, deep) == pytest.approx(float(expected), rel=1e-5)


def test_it_learns_where_patches_are() -> None:
    block = learn([example(seed) for seed in range(12)], steps=1000, rng=np.random.Generator(np.random.PCG64(3)))
    new = example(99)
    found = block.mask(new.shallow, new.deep) > 0.5
    both, either = (found & (new.truth > 0)).sum(), (found | (new.truth > 0)).sum()
    assert float(both / either) > 0.95
    clean = 0.1 * torch.rand(20, 40, generator=torch.Generator().manual_seed(5))
    assert block.score(new.shallow, new.deep) > 3 * block.score(clean, clean)


def test_every_training_step_is_reported() -> None:
    seen: list[tuple[int, int]] = []
    learn([example(1)], 3, np.random.Generator(np.random.PCG64(8)), lambda *step: seen.append(step))
    assert seen == [(1, 3), (2, 3), (3, 3)]


def test_the_same_generator_learns_the_same() -> None:
    blocks = [learn([example(1), example(2)], 5, np.random.Generator(np.random.PCG64(8))) for _ in range(2)]
    assert torch.equal(blocks[0].numbers, blocks[1].numbers)
