"""Measures the effect of an attack: the attack's objective with the optimised patches and with random patches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gear.contracts.attacks import Objective, Patch
from gear.contracts.models import Model
from gear.values.rng import derive_rng
from gear.values.serial import Json
from gear.verbs.attack.scenes import Scenes

MOST_SAMPLES = 8
"""Largest number of training samples for the comparison with random patches; more would hardly change the result."""


def random_patches(patches: Sequence[Patch], seed: int) -> tuple[Patch, ...]:
    """Makes the random patches with which an attack's result is compared; their values are drawn uniformly from 0..1.

    Args:
        patches: patches whose names and sizes are used.
        seed: seed of the draws.
    """
    rng = derive_rng(seed, "attack", "baseline")
    return tuple(Patch(name=one.name, rgb=rng.random(one.rgb.shape, dtype=np.float32)) for one in patches)


def compared(
    scenes: Scenes,
    network: Model,
    objective: Objective,
    patches: Sequence[Patch],
    seed: int,
    max_samples: int | None = None,
) -> Json:
    """Measures the mean objective over samples, once with random patches and once with the patches of the attack.

    Args:
        scenes: the samples, with the compositor that puts patches into them.
        network: the attacked model.
        objective: the objective that the attack maximises.
        patches: patches of the attack.
        seed: seed of the random patches.
        max_samples: largest number of samples, evenly spaced; None means all.

    Returns:
        A dict with `samples`, the number of samples, and the mean objectives `random` and `patch`; None for an
        objective that is not finite.
    """
    count = len(scenes.samples)
    chosen = np.unique(np.linspace(0, count - 1, min(count, max_samples or count)).round().astype(int)).tolist()
    values = {
        "random": scenes.harm(network, objective, random_patches(patches, seed), chosen),
        "patch": scenes.harm(network, objective, patches, chosen),
    }
    return {"samples": len(chosen)} | {name: plain(value) for name, value in values.items()}


def plain(value: float) -> float | None:
    """Rounds the number `value` to six significant digits for JSON; returns None if the number is not finite."""
    return float(f"{value:.6g}") if np.isfinite(value) else None
