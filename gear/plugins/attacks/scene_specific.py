"""The scene-specific attack with gear's settings: Adam optimises one scene's textures through the compositor.

The method is that of CARLA-GeAR (Nesti et al., 2022), after Nesti et al. (WACV 2022), on patches in 0..1 and with a
decreasing learning rate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gear.contracts.attacks import Budget, Compositor, Monitor, Patch
from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model
from gear.contracts.specs import AttackSpec
from gear.formats.coco import CATEGORY_NAMES
from gear.plugins.attacks.classes import LABEL_IDS, check_classes, check_seen
from gear.plugins.attacks.optimisation.settings import USUAL_RATE, Settings
from gear.values.errors import FieldError, GearError

if TYPE_CHECKING:
    from gear.contracts.attacks import Objective
    from gear.plugins.attacks.optimisation.loop import Direction, Problem
    from gear.plugins.attacks.optimisation.parametrisation import Parametrisation

CATEGORY_IDS = {name: number for number, name in CATEGORY_NAMES.items()}
APPEAR_CLASS = "person"


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneSpecificConfig(Settings):
    """Options of the attack `scene_specific`. They include the options of `Settings`.

    Attributes:
        learning_rate: peak learning rate of Adam, one number or one for each channel. null takes 0.25 against depth
            networks, on which coarse patterns are effective, and 0.06 against others.
        gamma: for semantic segmentation: weight 0 to 1 of the pixels that are still classified correctly; below 0 their
            current share of all pixels. For depth: weight of the pixels whose error is below half a metre; below 0
            stands for 0.8.
        source_class, target: for semantic segmentation: Cityscapes classes. Pixels of `source_class` (all pixels if
            empty) are pushed to `target`. If `target` is empty, the attack is untargeted.
        direction: for depth: `any` error, or depth that is `farther` or `nearer`.
        goal: `harm` for any harm; `vanish` makes all objects vanish (detectors and stereo networks); `appear` makes an
            object appear on the patch (2D detection).
        appear_class: COCO category of the object that appears.
        losses: for detectors and stereo networks: sign of each loss by name, `+` to maximise, `-` to minimise, 0 to
            ignore, such as `bbox_regression=-`. Losses without a sign are maximised. With a `goal` other than `harm`
            all losses are minimised, and a loss can only be ignored.
    """

    learning_rate: float | tuple[float, float, float] | None = None
    gamma: float = -1.0
    source_class: str = ""
    target: str = ""
    direction: Literal["any", "farther", "nearer"] = "any"
    goal: Literal["harm", "vanish", "appear"] = "harm"
    appear_class: str = APPEAR_CLASS
    losses: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        Settings.__post_init__(self)
        if self.gamma > 1:
            raise FieldError("gamma", f"must be 0 to 1, or below 0, got {self.gamma:g}")
        check_classes(self.source_class, self.target)
        if self.appear_class not in CATEGORY_IDS:
            raise FieldError(
                "appear_class", f"must be a COCO category such as person or car, got {self.appear_class!r}"
            )
        if self.appear_class != APPEAR_CLASS and self.goal != "appear":
            raise FieldError("appear_class", "must come with goal=appear, which makes it appear")
        for name, sign in self.losses.items():
            if sign not in SIGNS:
                raise FieldError(f"losses.{name}", f"must be one of {', '.join(SIGNS)}, got {sign!r}")


LEARNING_RATES = {"depth": 0.25}
"""Learning rates of tasks for which 0.06 is not the best; docs/results/attacks.md has the measurements."""

SIGNS = {"+": 1.0, "-": -1.0, "0": 0.0}


class SceneSpecific:
    """The attack `scene_specific`: Adam on the textures of all surfaces together.

    Args:
        config: options of the attack.
    """

    def __init__(self, config: SceneSpecificConfig) -> None:
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
        from gear.plugins.attacks.optimisation.loop import Problem, optimise_textures

        objective, settings = self.objective(dataset[0]), self.settings(dataset[0])
        check_seen(self._config.source_class, dataset)
        self._check_losses(model, dataset[0])
        problem = Problem(model=model, dataset=dataset, compositor=compositor, settings=settings)
        return optimise_textures(
            problem,
            self.direction(problem, objective, settings),
            budget=budget,
            rng=rng,
            monitor=monitor,
            parametrisation=self.parametrisation(),
        )

    def direction(self, problem: Problem, objective: Objective, settings: SceneSpecificConfig) -> Direction:
        """Returns the function that computes the ascent direction of each step.

        Args:
            problem: the attacked model or group of models, the samples and the compositor.
            objective: what the attack maximises.
            settings: the attack's options with the learning rate of the task.
        """
        from gear.plugins.attacks.optimisation.loop import unit_gradients

        return unit_gradients(problem, objective, settings)

    def parametrisation(self) -> Parametrisation | None:
        """The parameters from which textures are computed; None, because the pixels are free."""
        return None

    def settings(self, sample: Any) -> SceneSpecificConfig:
        """Returns the attack's options with the learning rate that fits the task of a sample, unless the options
        name one.

        Args:
            sample: any sample of the dataset; its ground truth shows the task.
        """
        from gear.plugins.attacks.optimisation.objectives import kind_of

        if self._config.learning_rate is not None:
            return self._config
        return replace(self._config, learning_rate=LEARNING_RATES.get(kind_of(sample), USUAL_RATE))

    def objective(self, sample: Any) -> Objective:
        """Returns the objective (what the attack maximises) that fits the task of a sample and the options.

        Args:
            sample: any sample of the dataset; its ground truth shows the task.

        Raises:
            GearError: an option is set that belongs to another task.
        """
        from gear.plugins.attacks.optimisation.objectives import DepthObjective, LossObjective, SemsegObjective, kind_of

        config, kind = self._config, kind_of(sample)
        self._check(kind)
        if kind == "semseg":
            return SemsegObjective(
                gamma="dynamic" if config.gamma < 0 else config.gamma,
                source_class=LABEL_IDS.get(config.source_class),
                target=LABEL_IDS.get(config.target),
            )
        if kind == "depth":
            return DepthObjective(gamma=0.8 if config.gamma < 0 else config.gamma, direction=config.direction)
        if config.goal != "harm":
            return self._detection_goal(sample)
        return LossObjective(signs={name: SIGNS[sign] for name, sign in config.losses.items()})

    def _check(self, kind: str) -> None:
        config = self._config
        for name, is_set, wanted, whose in (
            ("target", config.target, ("semseg",), "semantic segmentation"),
            ("source_class", config.source_class, ("semseg",), "semantic segmentation"),
            ("gamma", config.gamma >= 0, ("semseg", "depth"), "semantic segmentation and depth"),
            ("direction", config.direction != "any", ("depth",), "depth"),
            ("goal", config.goal != "harm", ("losses",), "detectors and stereo networks"),
            ("losses", config.losses, ("losses",), "detectors and stereo networks"),
        ):
            if is_set and kind not in wanted:
                raise GearError(f"option {name} of the attack is for {whose}; these are other samples")

    def _check_losses(self, model: Model, sample: Any) -> None:
        from gear.plugins.attacks.optimisation.objectives import loss_names

        if not self._config.losses:
            return
        known = loss_names(model, sample)
        for name in self._config.losses:
            if name not in known:
                raise GearError(f"option losses.{name}: no loss of the model; it has {', '.join(known)}")
        if all(self._config.losses.get(name) == "0" for name in known):
            raise GearError(f"option losses: all of {', '.join(known)} are left out; nothing is left to be changed")

    def _detection_goal(self, sample: Any) -> Objective:
        from gear.plugins.attacks.detection_goals import DetectionGoal
        from gear.plugins.tasks.detect2d import Detect2dSample

        config = self._config
        assert config.goal != "harm"
        if config.goal == "appear" and not isinstance(sample, Detect2dSample):
            raise GearError("goal=appear is for 2D detection; these are other samples")
        if config.goal == "vanish" and not hasattr(sample, "objects"):
            raise GearError("goal=vanish is for samples with objects; these have none")
        for name, sign in config.losses.items():
            if sign != "0":
                raise GearError(f"option losses.{name}: goal={config.goal} makes losses small; 0 leaves one out")
        category_id = CATEGORY_IDS[config.appear_class] if config.goal == "appear" else 0
        return DetectionGoal(goal=config.goal, category_id=category_id, left_out=frozenset(config.losses))


scene_specific: AttackSpec[SceneSpecificConfig] = AttackSpec(
    name="scene_specific",
    summary="The main attack: Adam optimises a scene's patches through the compositor, with gear's settings.",
    config=SceneSpecificConfig,
    build=SceneSpecific,
)


@hookimpl
def gear_attacks() -> list[AttackSpec[SceneSpecificConfig]]:
    """Hook of the plugin system: returns the attack plugin that this module defines."""
    return [scene_specific]
