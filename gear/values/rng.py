"""Random numbers: every purpose derives its own generator from the one seed, by name."""

from __future__ import annotations

import hashlib
import json

import numpy as np

from gear.values.errors import GearError


def check_seed(seed: int) -> None:
    """Refuses negative seeds.

    Raises:
        GearError: the seed is negative.
    """
    if seed < 0:
        raise GearError(f"seed must not be negative, got {seed}")


def derive_rng(seed: int, *path: str | int) -> np.random.Generator:
    """An independent generator for one named purpose, such as `derive_rng(7, "scene", 12)`.

    A sample draws the same numbers alone, after resuming, or with any number of workers, since no generator is shared.

    Args:
        seed: the seed of the split.
        *path: names and numbers of the purpose.
    """
    digest = hashlib.blake2b(json.dumps([seed, *path]).encode(), digest_size=16).digest()
    return np.random.default_rng(int.from_bytes(digest, "little"))
