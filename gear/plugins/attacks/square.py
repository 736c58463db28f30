"""A black-box attack by random search: squares of one colour, which stay in the patch if they increase the harm.

It is the Square attack (Andriushchenko et al., ECCV 2020) in the form of Sparse-RS for universal patches (Croce et al.,
AAAI 2022): every colour is a corner of the colour cube, and the squares shrink as queries are used up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from gear.contracts.attacks import Budget, Compositor, Monitor, Patch
from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model
from gear.contracts.specs import AttackSpec
from gear.values.errors import FieldError
from gear.values.rng import derive_rng

SCHEDULE = ((0.001, 1), (0.005, 2), (0.02, 4), (0.05, 8), (0.1, 16), (0.2, 32), (0.4, 64), (0.6, 128), (0.8, 256))
"""Pairs (share of used queries, divisor): up to that share, the first squares' area is divided by the divisor."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SquareConfig:
    """Options of the attack `square`.

    Attributes:
        height_px, width_px: size of every patch, pixels.
        area: area of the first squares, as a share of the patch's area.
        batch: number of samples per query.
        turns: number of times that the samples are drawn anew within the budget.
    """

    height_px: int = 150
    width_px: int = 300
    area: float = 0.3
    batch: int = 2
    turns: int = 10

    def __post_init__(self) -> None:
        for name in ("height_px", "width_px", "batch", "turns"):
            if not 1 <= getattr(self, name) <= 4096:
                raise FieldError(name, f"must be 1 to 4096, got {getattr(self, name)}")
        if not 0 < self.area <= 1:
            raise FieldError("area", f"must be above 0, up to 1, got {self.area:g}")


class Square:
    """The attack `square`: random search that changes one square of one colour at a time.

    Args:
        config: options of the attack.
    """

    def __init__(self, config: SquareConfig) -> None:
        self._config = config

    def optimise(
        self,
        model: Model,
        dataset: Sequence[Any],
        compositor: Compositor,
        *,
        budget: Budget,
        rng: np.random.Generator,
        monitor: Monitor | None = None,
    ) -> tuple[Patch, ...]:
        """Optimises one patch for each patch surface of the scene, within the budget.

        Args:
            model: the attacked network.
            dataset: samples on which the patches are optimised.
            compositor: renderer of patches into the pictures of these samples.
            budget: number of steps, and of queries for black-box attacks.
            rng: random generator of the attack.
            monitor: receives the progress and the patches of each step; None for no monitor.

        Returns:
            Patches named `patch_0`, `patch_1`, …, in the order of the scene's surfaces.
        """
        from gear.plugins.attacks.optimisation.checkpoint_state import check_saved
        from gear.plugins.attacks.optimisation.loop import batch_of
        from gear.plugins.attacks.optimisation.objectives import default_objective
        from gear.plugins.attacks.optimisation.queries import BlackBoxObjective, as_patches

        config, count = self._config, len(dataset[0].record.surfaces)
        objective = BlackBoxObjective(model, dataset, compositor, default_objective(dataset[0]), budget)
        saved = monitor.resume() if monitor is not None else None
        textures = self._first(rng, count)
        seed, done, best, whole = int(rng.integers(2**62)), 0, -math.inf, objective.left
        if saved is not None:
            number = np.array(0)
            check_saved(saved, {"textures": textures, "seed": number, "done": number, "best": np.array(0.0)})
            textures, seed, done = saved["textures"].copy(), int(saved["seed"]), int(saved["done"])
            best = float(saved["best"])
            objective.restore(saved)
        turn = max(1, min(budget.steps, whole // objective.cost(())) // config.turns)  # a step queries every model once
        while done < budget.steps:
            indices = batch_of(done // turn, len(dataset), config.batch, seed)
            if objective.left < objective.cost(indices):
                break
            if done % turn == 0:
                best = objective.harm(textures, indices)
            if objective.left >= objective.cost(indices):
                tried = self._with_square(textures, derive_rng(seed, "square", done), 1 - objective.left / whole)
                harm = objective.harm(tried, indices)
                if harm > best:
                    textures, best = tried, harm
            done += 1
            values = {"harm": best, "queries_left": float(objective.left)}
            state = {
                "textures": textures,
                "seed": np.int64(seed),
                "done": np.int64(done),
                "best": np.float64(best),
                **objective.state(),
            }
            if monitor is not None and monitor.step(done, values, partial(as_patches, textures), partial(dict, state)):
                break
        return as_patches(textures)

    def _first(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """The (S, 3, h, w) initial textures: vertical stripes, each in a random corner of the colour cube."""
        config = self._config
        stripes = rng.integers(0, 2, (count, 3, 1, config.width_px)).astype(np.float32)
        return np.ascontiguousarray(np.broadcast_to(stripes, (count, 3, config.height_px, config.width_px)))

    def _with_square(self, textures: np.ndarray, rng: np.random.Generator, spent: float) -> np.ndarray:
        config = self._config
        divisor = next((by for until, by in SCHEDULE if spent < until), 512)
        area_px = config.area / divisor * config.height_px * config.width_px
        side = max(1, min(round(math.sqrt(area_px)), config.height_px, config.width_px))
        top = int(rng.integers(0, config.height_px - side + 1))
        left = int(rng.integers(0, config.width_px - side + 1))
        tried = textures.copy()
        colour = rng.integers(0, 2, 3).astype(np.float32)
        tried[int(rng.integers(len(textures))), :, top : top + side, left : left + side] = colour[:, None, None]
        return tried


square: AttackSpec[SquareConfig] = AttackSpec(
    name="square",
    summary="Black-box attack: random search with squares of one colour; the budget is --queries.",
    config=SquareConfig,
    build=Square,
    needs_gradients=False,
)


@hookimpl
def gear_attacks() -> list[AttackSpec[SquareConfig]]:
    """Hook of the plugin system: returns the attack plugin that this module defines."""
    return [square]
