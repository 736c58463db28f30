"""The attack `ensemble`: one patch against several networks, for transfer to networks that the attacker does not have.

It is `scene_specific` with weights of the networks: each step favours those that the patch harms least
(`gear.plugins.attacks.optimisation.member_weights` names the sources).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import AttackSpec
from gear.plugins.attacks.scene_specific import SceneSpecific, SceneSpecificConfig
from gear.values.errors import FieldError

if TYPE_CHECKING:
    from gear.contracts.attacks import Objective
    from gear.plugins.attacks.optimisation.loop import Direction, Problem


@dataclass(frozen=True, slots=True, kw_only=True)
class EnsembleConfig(SceneSpecificConfig):
    """Options of the attack `ensemble`. They include the options of `SceneSpecificConfig`.

    Attributes:
        focus: how strongly a step favours the networks that the patch harms least. The weights are a softmax of minus
            `focus` times each network's objective, divided by the mean size of all networks' objectives. With 0, or
            with one network, the attack is `scene_specific`.
    """

    focus: float = 4.0

    def __post_init__(self) -> None:
        SceneSpecificConfig.__post_init__(self)
        if not 0 <= self.focus <= 100:
            raise FieldError("focus", f"must be 0 to 100, got {self.focus:g}")


class Ensemble(SceneSpecific):
    """The attack `ensemble`: Adam on the textures, with weighted networks.

    Args:
        config: options of the attack.
    """

    def __init__(self, config: EnsembleConfig) -> None:
        SceneSpecific.__init__(self, config)
        self._focus = config.focus

    def direction(self, problem: Problem, objective: Objective, settings: SceneSpecificConfig) -> Direction:
        """Returns the function that computes the ascent direction of each step.

        Args:
            problem: the attacked group of models, the samples and the compositor.
            objective: what the attack maximises.
            settings: the attack's options with the learning rate of the task.
        """
        from gear.plugins.attacks.optimisation.loop import unit_gradients

        return unit_gradients(problem, objective, settings, focus=self._focus)


ensemble: AttackSpec[EnsembleConfig] = AttackSpec(
    name="ensemble",
    summary="One patch against several networks: each step favours the networks that are harmed least.",
    config=EnsembleConfig,
    build=Ensemble,
)


@hookimpl
def gear_attacks() -> list[AttackSpec[EnsembleConfig]]:
    """Hook of the plugin system: returns the attack plugin that this module defines."""
    return [ensemble]
