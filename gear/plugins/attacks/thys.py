"""The objectness attack of Thys et al. (CVPR workshops 2019) on a billboard: the detector shall detect nothing.

Loss = mean over pictures of the highest objectness + 0.01 NPS + max(2.5 TV, 0.1), as published, where NPS is the
non-printability score and TV the total variation. Adam starts from uniform noise in 0..1 with learning rate 0.03.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from gear.contracts.attacks import Budget, Compositor, Monitor, Patch
from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model
from gear.contracts.specs import AttackSpec
from gear.plugins.attacks.optimisation.settings import Appearance, TextureSettings
from gear.values.errors import GearError

if TYPE_CHECKING:
    from torch import Tensor

    from gear.contracts.attacks import Objective, Term
    from gear.plugins.attacks.optimisation.loop import PatchedBatch

SCORES = ("objectness", "cls_logits")
"""Names of detectors' raw outputs (logits) from which scores are computed by a sigmoid."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ThysAppearance(Appearance):
    """The uniform ranges of appearance changes that Thys et al. published, as standard deviations; the options are
    those of `Appearance`.

    It is a class of its own so that a user can set one field in a config and keep the other defaults.
    """

    noise: float = 0.06
    brightness: float = 0.06
    contrast: float = 0.12


@dataclass(frozen=True, slots=True, kw_only=True)
class ThysConfig(TextureSettings):
    """Options of the attack `thys`; the defaults are the published constants. They include the options of
    `TextureSettings`.

    Attributes:
        printability_weight: weight of the non-printability score, a sum over pixels divided by the number of values.
        variation_weight: weight of the total variation, a sum over values divided by their number.
        least_variation: the total variation, times its weight, is not penalised further below this value.
    """

    learning_rate: float | tuple[float, float, float] = 0.03
    printability_weight: float = 0.01
    variation_weight: float = 2.5
    least_variation: float = 0.1
    appearance: ThysAppearance = field(default_factory=ThysAppearance)


class Thys:
    """The attack `thys`: minimises the score of the most confident detection in every picture.

    Args:
        config: options of the attack.
    """

    def __init__(self, config: ThysConfig) -> None:
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

        Raises:
            GearError: the detector has no raw output of objectness or class scores.
        """
        from gear.plugins.attacks.optimisation.loop import Problem, one_gradient, optimise_textures

        problem = Problem(model=model, dataset=dataset, compositor=compositor, settings=self._config)
        objective = self.objective(dataset[0])

        def harm(_: Tensor, batch: PatchedBatch) -> Mapping[str, Tensor]:
            return self._harm(problem.model, objective, batch)

        return optimise_textures(problem, one_gradient(harm, self._penalties), budget=budget, rng=rng, monitor=monitor)

    def objective(self, sample: Any) -> Objective:
        """Returns the objective of the attack: it grows as the score of the most confident detection falls.

        Args:
            sample: not used; the attack is for detectors only.
        """
        return MaxScoreObjective()

    def _harm(self, model: Model, objective: Objective, seen: PatchedBatch) -> Mapping[str, Tensor]:
        import torch

        from gear.plugins.attacks.optimisation.objectives import weighted

        harm = weighted(objective, model, seen.views, seen.samples, seen.indices)
        return {"objectness": torch.stack(harm).sum()}

    def _penalties(self, textures: Tensor) -> Mapping[str, Tensor]:
        import torch

        from gear.plugins.attacks.optimisation.regularisers import non_printability

        config = self._config
        down = (textures[:, :, 1:] - textures[:, :, :-1]).abs().sum()
        right = (textures[:, :, :, 1:] - textures[:, :, :, :-1]).abs().sum()
        variation = config.variation_weight * (down + right) / textures.numel()
        return {
            "printability": -config.printability_weight
            * torch.stack([non_printability(t) for t in textures]).sum()
            / textures.numel(),  # the published code divides both penalties by all values, not by pixels
            "variation": -variation.clamp_min(config.least_variation),
        }


class MaxScoreObjective:
    """An objective that grows as the score of the most confident detection in each picture falls."""

    def terms(
        self, model: Model, views: Mapping[str, Tensor], samples: Sequence[Any], indices: Sequence[int]
    ) -> Mapping[str, Term]:
        """Returns one term, `objectness`: the negative mean over the pictures of the highest detection score.

        Args:
            model: the attacked network.
            views: (B, 3, H, W) pictures with the patches by camera name, float in 0..1.
            samples, indices: not used.
        """
        from gear.contracts.attacks import Term

        return {"objectness": Term(value=-max_score(model.forward(views)).mean())}


def max_score(outputs: Mapping[str, Tensor]) -> Tensor:
    """Returns the (B,) highest detection score in each picture, 0 to 1.

    Args:
        outputs: a detector's raw outputs by name, (B, ...) logits; the first of `SCORES` that exists is read.

    Raises:
        GearError: the detector has no raw output of objectness or class scores.
    """
    for name in SCORES:
        if name in outputs:
            return outputs[name].flatten(1).max(dim=1).values.sigmoid()
    raise GearError(
        f"attack thys needs a detector with one of the outputs {', '.join(SCORES)}; got {', '.join(outputs)}"
    )


thys: AttackSpec[ThysConfig] = AttackSpec(
    name="thys",
    summary="Objectness attack: lowers the most confident detection in every picture (Thys et al., 2019).",
    config=ThysConfig,
    build=Thys,
    tasks=("detect2d",),
)


@hookimpl
def gear_attacks() -> list[AttackSpec[ThysConfig]]:
    """Hook of the plugin system: returns the attack plugin that this module defines."""
    return [thys]
