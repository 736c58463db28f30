"""The order in which a pass over the data takes its samples."""

from __future__ import annotations

from gear.values.rng import derive_rng


def order(count: int, *, seed: int | None, epoch: int = 0) -> list[int]:
    """The indices 0 to `count` - 1 in the order of one pass over the data.

    Args:
        count: number of samples.
        seed: seed of the shuffling; None keeps the order.
        epoch: number of the pass; each pass is shuffled differently, and always the same for one seed.
    """
    if seed is None:
        return list(range(count))
    return [int(index) for index in derive_rng(seed, "order", epoch).permutation(count)]
