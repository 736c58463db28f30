"""The scene-specific attack with the settings of the CARLA-GeAR paper, without known errors of its code.

The step sizes of the published code are in the units of each network's input; here they are converted to patches in
0..1. Its segmentation networks took normalised pictures, so the step of 0.5 was 0.5 standard deviations of ImageNet.
Its detectors and depth networks took pictures in 0..1. Its stereo network took pictures in 0..255, with a step of 10.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gear.contracts.attacks import Budget, Compositor, Monitor, Patch
from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model
from gear.contracts.specs import AttackSpec
from gear.plugins.attacks.optimisation.settings import Appearance, Settings

if TYPE_CHECKING:
    from gear.contracts.attacks import Objective

IMAGENET_STD = (0.229, 0.224, 0.225)
PaperTask = Literal["semseg", "depth", "detect2d", "stereo3d"]
STEREO_LOSSES_LEFT_OUT = ("rpn_class", "class")
"""Names of Stereo R-CNN's two classification losses, which the paper computes but does not attack."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CarlaGearConfig:
    """Options of the attack `carla_gear`: only the size of the patches; all other settings are the paper's.

    Attributes:
        height_px, width_px: size of every patch, pixels.
    """

    height_px: int = 150
    width_px: int = 300

    def __post_init__(self) -> None:
        Settings(height_px=self.height_px, width_px=self.width_px)


class CarlaGear:
    """The attack `carla_gear`: the gradient of each loss term is scaled to length 1, and the learning rate is
    constant.

    The weight gamma of the first loss term is 1 for segmentation and 0.8 for depth
    (`gear.plugins.attacks.optimisation.objectives` defines the terms).

    Args:
        config: options of the attack.
    """

    def __init__(self, config: CarlaGearConfig) -> None:
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

        The paper's budget is 51 epochs of 100 samples: 2550 steps for segmentation (two samples per step), and 5100 for
        the other tasks.

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

        objective, settings = self.objective(dataset[0]), self.settings(dataset[0])
        problem = Problem(model=model, dataset=dataset, compositor=compositor, settings=settings)
        return optimise_textures(
            problem, unit_gradients(problem, objective, settings), budget=budget, rng=rng, monitor=monitor
        )

    def settings(self, sample: Any) -> Settings:
        """Returns the paper's settings of the optimisation for the task of a sample.

        Args:
            sample: any sample of the dataset; its ground truth shows the task.
        """
        task = task_of(sample)
        return Settings(
            height_px=self._config.height_px,
            width_px=self._config.width_px,
            batch=2 if task == "semseg" else 1,
            learning_rate=LEARNING_RATES[task],
            decay=False,
            smoothness=0.1,
            appearance=Appearance(noise=0.02, brightness=BRIGHTNESS[task], contrast=0.1, blur_px=6),
        )

    def objective(self, sample: Any) -> Objective:
        """Returns the paper's objective (what the attack maximises) for the task of a sample.

        Args:
            sample: any sample of the dataset; its ground truth shows the task.
        """
        from gear.plugins.attacks.optimisation.objectives import DepthObjective, LossObjective, SemsegObjective

        task = task_of(sample)
        if task == "semseg":
            return SemsegObjective(gamma=1.0)
        if task == "depth":
            return DepthObjective(gamma=0.8)
        return LossObjective(signs=dict.fromkeys(STEREO_LOSSES_LEFT_OUT if task == "stereo3d" else (), 0.0))


LEARNING_RATES: dict[PaperTask, float | tuple[float, float, float]] = {
    "semseg": (0.5 * IMAGENET_STD[0], 0.5 * IMAGENET_STD[1], 0.5 * IMAGENET_STD[2]),
    "depth": 0.5,
    "detect2d": 0.5,
    "stereo3d": 10 / 255,
}
BRIGHTNESS: dict[PaperTask, float] = {"semseg": 0.02 / 0.224, "depth": 0.02, "detect2d": 0.02, "stereo3d": 0.02}


def task_of(sample: Any) -> PaperTask:
    """Returns the name of the task to which a sample belongs, found by its ground truth and its number of cameras.

    Args:
        sample: with `label_ids` `semseg`, with `depth_m` `depth`; otherwise `stereo3d` with several cameras, `detect2d`
            with one.
    """
    from gear.plugins.attacks.optimisation.objectives import kind_of

    kind = kind_of(sample)
    if kind != "losses":
        return kind
    return "stereo3d" if len(sample.images) > 1 else "detect2d"


carla_gear: AttackSpec[CarlaGearConfig] = AttackSpec(
    name="carla_gear",
    summary="The scene-specific attack with the CARLA-GeAR paper's settings.",
    config=CarlaGearConfig,
    build=CarlaGear,
)


@hookimpl
def gear_attacks() -> list[AttackSpec[CarlaGearConfig]]:
    """Hook of the plugin system: returns the attack plugin that this module defines."""
    return [carla_gear]
