"""The attack `eot`, which does not use the scene: patches are pasted upright at random sizes and positions.

It is expectation over transformation (EOT; Athalye et al., ICML 2018) with the transforms of Nesti et al. (WACV 2022),
who compare their scene-specific attack with it: scale, shift, noise, brightness and contrast. The position of the
billboard in the scene, its light and its occluders are not used.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gear.contracts.attacks import Budget, Compositor, Monitor, Patch
from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model
from gear.contracts.specs import AttackSpec
from gear.plugins.attacks.optimisation.settings import Appearance, Settings
from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class EotAppearance(Appearance):
    """The random appearance changes of Nesti et al. (WACV 2022) as defaults; the options are those of
    `Appearance`.

    It is a class of its own so that a user can set one field in a config and keep the other defaults.
    """

    noise: float = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class EotConfig(Settings):
    """Options of the attack `eot`. They include the options of `Settings`.

    Attributes:
        share: width of a pasted patch before scaling, as a share of the picture's width.
        min_scale, max_scale: range of the random factor on that width.
        shift: largest shift of a patch from its regular position along each axis, as a share of the patch's size. The
            regular position of a single patch is the middle of the picture.
    """

    share: float = 0.15
    min_scale: float = 0.8
    max_scale: float = 1.2
    shift: float = 0.5
    appearance: EotAppearance = field(default_factory=EotAppearance)

    def __post_init__(self) -> None:
        Settings.__post_init__(self)
        if not 0.01 <= self.share <= 1:
            raise FieldError("share", f"must be 0.01 to 1, got {self.share:g}")
        if not 0 < self.min_scale <= self.max_scale <= 10:
            raise FieldError("min_scale", f"must be above 0 and at most max_scale, got {self.min_scale:g}")


class Eot:
    """The attack `eot`: optimises patches that are pasted at random positions, without the scene's compositor.

    Args:
        config: options of the attack.
    """

    def __init__(self, config: EotConfig) -> None:
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
        """Optimises one patch for each patch surface of the scene; all of the patches are pasted into every
        picture.

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
        from gear.plugins.attacks.optimisation.loop import Problem, optimise_textures, unit_gradients
        from gear.plugins.attacks.optimisation.objectives import default_objective
        from gear.plugins.attacks.optimisation.upright_pasting import Upright

        config = self._config
        seed = int(rng.integers(2**62))
        scenes = Upright(
            dataset,
            seed=seed,
            aspect=config.height_px / config.width_px,
            share=config.share,
            scales=(config.min_scale, config.max_scale),
            shift=config.shift,
        )
        problem = Problem(model=model, dataset=scenes, compositor=scenes, settings=config)
        ascend = unit_gradients(problem, default_objective(dataset[0]), config)
        return optimise_textures(problem, ascend, budget=budget, rng=rng, monitor=monitor, before=scenes.begin)


eot: AttackSpec[EotConfig] = AttackSpec(
    name="eot",
    summary="EOT baseline: patches pasted upright at random places and sizes, without the scene's geometry.",
    config=EotConfig,
    build=Eot,
    needs_probes=False,
)


@hookimpl
def gear_attacks() -> list[AttackSpec[EotConfig]]:
    """Hook of the plugin system: returns the attack plugin that this module defines."""
    return [eot]
