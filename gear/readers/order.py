"""The order of the samples in one epoch."""

from __future__ import annotations

from gear.values.rng import derive_rng


def order(count: int, *, seed: int | None, epoch: int = 0) -> list[int]:
    """The indices 0 to `count` - 1 in the order of one epoch.

    Args:
        count: number of samples.
        seed: seed of the shuffling; None returns the indices in ascending order.
        epoch: number of the epoch; each epoch is shuffled differently, and reproducibly for one seed.
    """
    if seed is None:
        return list(range(count))
    return [int(index) for index in derive_rng(seed, "order", epoch).permutation(count)]
