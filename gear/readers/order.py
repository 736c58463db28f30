"""In which order samples come."""

from __future__ import annotations

from gear.values.rng import derive_rng


def order(count: int, *, seed: int | None, epoch: int = 0) -> list[int]:
    """Indices 0 to `count` - 1 as a pass over the data takes them.

    Args:
        count: how many samples there are.
        seed: None keeps them as they are; a number shuffles, every epoch otherwise and always alike.
        epoch: number of the pass.
    """
    if seed is None:
        return list(range(count))
    return [int(index) for index in derive_rng(seed, "order", epoch).permutation(count)]
