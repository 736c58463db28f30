"""Robust physical perturbations (RP2; Eykholt et al., CVPR 2018) on a billboard: all terms are added to one loss.

The patch is a base colour plus a perturbation, which is kept printable and small in the 2-norm. The mean loss over
varied pictures is optimised: towards the class `target` if the option is set (segmentation only), otherwise away from
the ground truth.
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
from gear.plugins.attacks.classes import LABEL_IDS, check_classes, check_seen
from gear.plugins.attacks.optimisation.settings import Appearance, TextureSettings
from gear.values.errors import FieldError, GearError

if TYPE_CHECKING:
    from torch import Tensor

    from gear.contracts.attacks import Objective
    from gear.plugins.attacks.optimisation.loop import PatchedBatch


@dataclass(frozen=True, slots=True, kw_only=True)
class Rp2Appearance(Appearance):
    """Random appearance changes with stronger changes of light and without blur, as defaults; the options are
    those of `Appearance`.

    It is a class of its own so that a user can set one field in a config and keep the other defaults.
    """

    brightness: float = 0.1
    contrast: float = 0.3
    blur_px: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Rp2Config(TextureSettings):
    """Options of the attack `rp2`. They include the options of `TextureSettings`.

    Learning rate, height and `norm_weight` are those of the published GTSRB experiment; the others are gear's choice.

    Attributes:
        base: grey value, 0 to 1, to which the perturbation is added.
        norm_weight: weight of the perturbation's 2-norm.
        printability_weight: weight of the non-printability score, a mean over pixels.
        smoothness_weight: weight of the smoothness term, a mean over pixels.
        source_class, target: for semantic segmentation: Cityscapes classes. Pixels of `source_class` (all pixels if
            empty) are pushed to `target`. If `target` is empty, the attack is untargeted.
    """

    height_px: int = 32
    width_px: int = 64
    base: float = 0.5
    norm_weight: float = 1e-3
    printability_weight: float = 0.1
    smoothness_weight: float = 1e-3
    learning_rate: float | tuple[float, float, float] = 0.25
    decay: bool = False
    source_class: str = ""
    target: str = ""
    appearance: Rp2Appearance = field(default_factory=Rp2Appearance)

    def __post_init__(self) -> None:
        TextureSettings.__post_init__(self)
        if not 0 <= self.base <= 1:
            raise FieldError("base", f"must be 0 to 1, got {self.base:g}")
        check_classes(self.source_class, self.target)


class Rp2:
    """The attack `rp2`: Adam on the sum of all terms.

    Args:
        config: options of the attack.
    """

    def __init__(self, config: Rp2Config) -> None:
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
        from gear.plugins.attacks.optimisation.loop import Problem, one_gradient, optimise_textures

        problem = Problem(model=model, dataset=dataset, compositor=compositor, settings=self._config)
        objective = self.objective(dataset[0])
        check_seen(self._config.source_class, dataset)

        def harm(_: Tensor, batch: PatchedBatch) -> Mapping[str, Tensor]:
            return self._harm(problem.model, objective, batch)

        return optimise_textures(problem, one_gradient(harm, self._penalties), budget=budget, rng=rng, monitor=monitor)

    def objective(self, sample: Any) -> Objective:
        """Returns the objective for the task of a sample: towards the class `target` if the option is set,
        otherwise untargeted.

        Args:
            sample: any sample of the dataset; its ground truth shows the task.

        Raises:
            GearError: `target` or `source_class` is set, but the sample has no semantic labels.
        """
        from gear.plugins.attacks.optimisation.objectives import SemsegObjective, default_objective, kind_of

        config = self._config
        if kind_of(sample) != "semseg":
            for name in ("target", "source_class"):
                if getattr(config, name):
                    whose = "semantic segmentation; these are other samples"
                    raise GearError(f"option {name} of the attack is for {whose}")
        elif config.target:
            return SemsegObjective(source_class=LABEL_IDS.get(config.source_class), target=LABEL_IDS[config.target])
        return default_objective(sample)

    def _harm(self, model: Model, objective: Objective, seen: PatchedBatch) -> Mapping[str, Tensor]:
        import torch

        from gear.plugins.attacks.optimisation.objectives import weighted

        terms = weighted(objective, model, seen.views, seen.samples, seen.indices)
        return {"harm": torch.stack(terms).sum()} if terms else {}

    def _penalties(self, textures: Tensor) -> Mapping[str, Tensor]:
        import torch

        from gear.plugins.attacks.optimisation.regularisers import non_printability, smoothness

        config, pixels = self._config, textures[:, 0].numel()
        return {
            "norm": -config.norm_weight * (textures - config.base).norm(),
            "printability": -config.printability_weight
            * torch.stack([non_printability(t) for t in textures]).sum()
            / pixels,
            "smoothness": -config.smoothness_weight * torch.stack([smoothness(t) for t in textures]).sum() / pixels,
        }


rp2: AttackSpec[Rp2Config] = AttackSpec(
    name="rp2",
    summary="RP2 (robust physical perturbations): a small, printable change of a base colour; one summed loss.",
    config=Rp2Config,
    build=Rp2,
)


@hookimpl
def gear_attacks() -> list[AttackSpec[Rp2Config]]:
    """Hook of the plugin system: returns the attack plugin that this module defines."""
    return [rp2]
