"""Random numbers: a separate random generator for every purpose, derived from the seed of the split and the name
of the purpose.
"""

from __future__ import annotations

import hashlib
import json

import numpy as np

from gear.values.errors import GearError


def check_seed(seed: int) -> None:
    """Checks that a seed is not negative.

    Args:
        seed: the seed.

    Raises:
        GearError: the seed is negative.
    """
    if seed < 0:
        raise GearError(f"seed must not be negative, got {seed}")


def derive_rng(seed: int, *path: str | int) -> np.random.Generator:
    """An independent random generator for one named purpose, such as `derive_rng(7, "scene", 12)`.

    No generator is shared. Therefore a sample draws the same numbers when made alone, after resuming, or with any
    number of workers.

    Args:
        seed: the seed of the split.
        *path: names and numbers that identify the purpose.
    """
    digest = hashlib.blake2b(json.dumps([seed, *path]).encode(), digest_size=16).digest()
    return np.random.default_rng(int.from_bytes(digest, "little"))
