"""Randomness: one seed enters, every purpose derives its own generator by name."""

from __future__ import annotations

import hashlib
import json

import numpy as np

from gear.values.errors import GearError


def check_seed(seed: int) -> None:
    """Seeds count from 0, in configs and wherever else one is given.

    Raises:
        GearError: this one is below.
    """
    if seed < 0:
        raise GearError(f"seed must not be negative, got {seed}")


def derive_rng(seed: int, *path: str | int) -> np.random.Generator:
    """An independent generator for one named purpose, e.g. `derive_rng(7, "scene", 12)`.

    Sample 12 draws the same numbers alone, resumed, or on eight workers, because nothing is shared.
    """
    digest = hashlib.blake2b(json.dumps([seed, *path]).encode(), digest_size=16).digest()
    return np.random.default_rng(int.from_bytes(digest, "little"))
