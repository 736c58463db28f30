"""A black-box attack that estimates gradients from differences of the objective: NES (Ilyas et al., 2018) or SPSA.

The gradient is estimated on a coarse grid, and each cell of the grid becomes a square of the patch. Far fewer values
than pixels must therefore be estimated. NES was published at ICML 2018.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np

from gear.contracts.attacks import Budget, Compositor, Monitor, Patch
from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model
from gear.contracts.specs import AttackSpec
from gear.values.errors import FieldError
from gear.values.rng import derive_rng


@dataclass(frozen=True, slots=True, kw_only=True)
class NesConfig:
    """Options of the attack `nes`.

    Attributes:
        height_px, width_px: size of every patch, pixels.
        grid_px: side of a cell of the coarse grid, in patch pixels.
        draws: kind of random perturbations: normally distributed (`nes`), or random signs (`spsa`).
        pairs: number of query pairs per step; each pair is a perturbation and its negative.
        spread: size of the perturbations, on values in 0..1.
        step: size of the step of every value, on values in 0..1.
        batch: number of samples per query.
    """

    height_px: int = 150
    width_px: int = 300
    grid_px: int = 10
    draws: Literal["nes", "spsa"] = "nes"
    pairs: int = 10
    spread: float = 0.1
    step: float = 0.05
    batch: int = 2

    def __post_init__(self) -> None:
        for name in ("height_px", "width_px", "grid_px", "pairs", "batch"):
            if not 1 <= getattr(self, name) <= 4096:
                raise FieldError(name, f"must be 1 to 4096, got {getattr(self, name)}")
        for name in ("spread", "step"):
            if not 0 < getattr(self, name) <= 1:
                raise FieldError(name, f"must be above 0, up to 1, got {getattr(self, name):g}")


class Nes:
    """The attack `nes`: in each step every value changes by `step` along the sign of its estimated gradient.

    Args:
        config: options of the attack.
    """

    def __init__(self, config: NesConfig) -> None:
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
        rows, columns = -(-config.height_px // config.grid_px), -(-config.width_px // config.grid_px)
        saved = monitor.resume() if monitor is not None else None
        grid = rng.uniform(0, 1, (count, 3, rows, columns)).astype(np.float32)
        seed, done = int(rng.integers(2**62)), 0
        if saved is not None:
            check_saved(saved, {"grid": grid, "seed": np.array(0), "done": np.array(0)})
            grid, seed, done = saved["grid"].copy(), int(saved["seed"]), int(saved["done"])
            objective.restore(saved)
        while done < budget.steps:
            draws = derive_rng(seed, "draws", done)
            indices = batch_of(done, len(dataset), config.batch, seed)
            slope, seen = np.zeros_like(grid), list[float]()
            for _ in range(config.pairs):
                if objective.left < objective.cost(indices) + objective.cost(
                    ()
                ):  # outputs on clean pictures are queried only once
                    break
                change = self._change(draws, grid.shape)
                ahead = objective.harm(self._spread_out(np.clip(grid + change, 0, 1)), indices)
                behind = objective.harm(self._spread_out(np.clip(grid - change, 0, 1)), indices)
                slope += (ahead - behind) * change
                seen += [ahead, behind]
            if not seen:
                break
            grid = np.clip(grid + config.step * np.sign(slope), 0, 1).astype(np.float32)
            done += 1
            values = {"harm": float(np.mean(seen)), "queries_left": float(objective.left)}
            state = {"grid": grid, "seed": np.int64(seed), "done": np.int64(done), **objective.state()}
            made = partial(as_patches, self._spread_out(grid))
            if monitor is not None and monitor.step(done, values, made, partial(dict, state)):
                break
        return as_patches(self._spread_out(grid))

    def _change(self, draws: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
        if self._config.draws == "nes":
            return (self._config.spread * draws.standard_normal(shape)).astype(np.float32)
        return (self._config.spread * draws.choice([-1.0, 1.0], shape)).astype(np.float32)

    def _spread_out(self, grid: np.ndarray) -> np.ndarray:
        config = self._config
        wide = grid.repeat(config.grid_px, axis=2).repeat(config.grid_px, axis=3)
        return np.ascontiguousarray(wide[:, :, : config.height_px, : config.width_px])


nes: AttackSpec[NesConfig] = AttackSpec(
    name="nes",
    summary="Black-box attack: gradients estimated from queries by NES or SPSA; the budget is --queries.",
    config=NesConfig,
    build=Nes,
    needs_gradients=False,
)


@hookimpl
def gear_attacks() -> list[AttackSpec[NesConfig]]:
    """Hook of the plugin system: returns the attack plugin that this module defines."""
    return [nes]
