"""The autoencoder that completes masks."""

from __future__ import annotations

import numpy as np

from gear.plugins.defenses.masking.shape_autoencoder import LEVEL, ShapeAutoencoder, to_grid, train


def rectangle(top: int, left: int) -> np.ndarray:
    mask = np.zeros((48, 96), np.bool_)
    mask[top : top + 12, left : left + 24] = True
    return mask


def iou(one: np.ndarray, other: np.ndarray) -> float:
    return float((one & other).sum() / (one | other).sum())


def test_a_damaged_mask_is_completed() -> None:
    found = train([rectangle(10, 30), rectangle(20, 40)], 12, 100, 100, 120, np.random.default_rng(1))
    true = rectangle(16, 50)
    damaged = true.copy()
    damaged[16:28:3] = False
    damaged[:, 50:74:5] = False
    assert iou(found.complete(damaged), true) > max(0.5, iou(damaged, true))
    assert not found.complete(np.zeros_like(true)).any()


def test_the_output_is_that_of_the_written_formula() -> None:
    rng = np.random.default_rng(2)
    weights = [rng.normal(0, 1, shape).astype(np.float32) for shape in ((3, 8), (3,), (8, 3), (8,))]
    network = ShapeAutoencoder(
        grid=(2, 4), encode=weights[0], encode_offset=weights[1], decode=weights[2], decode_offset=weights[3]
    )
    mask = np.array([[True, False, True, True], [False, True, False, False]])
    hidden = [1 / (1 + np.exp(-(weights[0][i] @ mask.ravel() + weights[1][i]))) for i in range(3)]
    expected = [1 / (1 + np.exp(-(weights[2][i] @ np.array(hidden) + weights[3][i]))) for i in range(8)]
    assert np.array_equal(network.complete(mask).ravel(), np.array(expected) > LEVEL)


def test_cells_hold_the_share_that_the_mask_covers() -> None:
    mask = np.zeros((4, 8), np.bool_)
    mask[:2, :1] = True
    assert np.allclose(to_grid(mask, (2, 4)), [[0.5, 0, 0, 0], [0, 0, 0, 0]])


def test_training_again_gives_the_same_network() -> None:
    first, second = (train([rectangle(10, 30)], 8, 10, 5, 20, np.random.default_rng(3)) for _ in range(2))
    assert np.array_equal(first.encode, second.encode)
