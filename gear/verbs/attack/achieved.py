"""What an attack achieved: the objective with its patches beside the objective with random ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gear.contracts.attacks import Objective, Patch
from gear.contracts.models import Model
from gear.values.rng import derive_rng
from gear.values.serial import Json
from gear.verbs.attack.scenes import Scenes

MOST_SAMPLES = 8
"""Training samples on which the objective is compared; more would take longer and say little more."""


def random_patches(patches: Sequence[Patch], seed: int) -> tuple[Patch, ...]:
    """Patches of the same sizes whose pixels are drawn evenly from 0..1."""
    rng = derive_rng(seed, "attack", "baseline")
    return tuple(Patch(name=one.name, rgb=rng.random(one.rgb.shape, dtype=np.float32)) for one in patches)


def compared(
    scenes: Scenes, network: Model, objective: Objective, patches: Sequence[Patch], seed: int, most: int | None = None
) -> Json:
    """The mean objective over samples with random patches and with these.

    Args:
        scenes: the samples.
        network: the attacked model.
        objective: what the attack makes large.
        patches: those of the attack.
        seed: of the random ones.
        most: number of samples, evenly spaced; all by default.

    Returns:
        `samples`, `random` and `patch`; a value is None where nothing can be measured.
    """
    count = len(scenes.samples)
    chosen = np.unique(np.linspace(0, count - 1, min(count, most or count)).round().astype(int)).tolist()
    values = {
        "random": scenes.harm(network, objective, random_patches(patches, seed), chosen),
        "patch": scenes.harm(network, objective, patches, chosen),
    }
    return {"samples": len(chosen)} | {name: plain(value) for name, value in values.items()}


def plain(value: float) -> float | None:
    """A number of six digits for JSON; None where it is not finite."""
    return float(f"{value:.6g}") if np.isfinite(value) else None
