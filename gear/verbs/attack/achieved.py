"""The effect of an attack: its objective with the optimised patches, compared with random patches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gear.contracts.attacks import Objective, Patch
from gear.contracts.models import Model
from gear.values.rng import derive_rng
from gear.values.serial import Json
from gear.verbs.attack.scenes import Scenes

MOST_SAMPLES = 8
"""Largest number of training samples on which the objectives are compared; more would hardly change the result."""


def random_patches(patches: Sequence[Patch], seed: int) -> tuple[Patch, ...]:
    """Patches of the same sizes whose values are drawn uniformly from 0..1."""
    rng = derive_rng(seed, "attack", "baseline")
    return tuple(Patch(name=one.name, rgb=rng.random(one.rgb.shape, dtype=np.float32)) for one in patches)


def compared(
    scenes: Scenes, network: Model, objective: Objective, patches: Sequence[Patch], seed: int, most: int | None = None
) -> Json:
    """Mean objective over samples with random patches, and with the given patches.

    Args:
        scenes: the samples.
        network: the attacked model.
        objective: the objective that the attack maximises.
        patches: patches of the attack.
        seed: seed of the random patches.
        most: number of samples, evenly spaced; all by default.

    Returns:
        `samples`, the number of samples, and the objectives `random` and `patch`, which are None if they cannot be
        measured.
    """
    count = len(scenes.samples)
    chosen = np.unique(np.linspace(0, count - 1, min(count, most or count)).round().astype(int)).tolist()
    values = {
        "random": scenes.harm(network, objective, random_patches(patches, seed), chosen),
        "patch": scenes.harm(network, objective, patches, chosen),
    }
    return {"samples": len(chosen)} | {name: plain(value) for name, value in values.items()}


def plain(value: float) -> float | None:
    """A number rounded to six digits for JSON; None if it is not finite."""
    return float(f"{value:.6g}") if np.isfinite(value) else None
