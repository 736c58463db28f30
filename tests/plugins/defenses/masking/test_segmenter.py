"""The U-Net of SAC and its training."""

from __future__ import annotations

import numpy as np
import torch

from gear.plugins.defenses.masking.segmenter import CROP_PX, SegmenterNetwork, _crop, train


def test_the_logits_have_the_size_of_the_picture() -> None:
    network = SegmenterNetwork(4).eval()
    for size in ((16, 16), (33, 70), (72, 128)):
        assert network(torch.zeros(2, 3, *size)).shape == (2, *size)


def test_it_has_the_parameters_of_the_authors_u_net() -> None:
    """Counted from the published layers: double convolutions with batch normalisation, 16 to 128 channels."""
    sizes = [(3, 16, 16), (16, 32, 32), (32, 64, 64), (64, 128, 128), (128, 128, 128)]
    sizes += [(256, 128, 64), (128, 64, 32), (64, 32, 16), (32, 16, 16)]
    expected = sum(9 * a * b + 3 * b + 9 * b * c + 3 * c for a, b, c in sizes) + 17
    assert sum(one.numel() for one in SegmenterNetwork(16).parameters()) == expected


def test_crops_lie_in_the_picture_and_near_the_patch() -> None:
    truth = torch.zeros(60, 300)
    truth[5:20, 280:298] = 1
    rng = np.random.default_rng(1)
    for _ in range(30):
        rows, columns = _crop(truth, rng)
        assert (rows.start, rows.stop) == (0, 60)
        assert columns.start >= 0 and columns.stop <= 300 and columns.stop - columns.start == CROP_PX
        assert truth[rows, columns].any()


def test_training_again_gives_the_same_network_and_leaves_torchs_generator_alone() -> None:
    rng = np.random.default_rng(2)
    picture, truth = torch.from_numpy(rng.random((3, 40, 48), np.float32)), torch.zeros(40, 48)
    truth[10:20, 10:30] = 1
    state = torch.random.get_rng_state()
    first, second = (
        train([picture], [1 - picture], [truth], filters=2, steps=3, rng=np.random.default_rng(3)) for _ in range(2)
    )
    assert torch.equal(torch.random.get_rng_state(), state)
    assert all(torch.equal(a, b) for a, b in zip(first.parameters(), second.parameters(), strict=True))
    assert not first.training
