"""art: an attack of the Adversarial Robustness Toolbox, through gear's compositor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gear.contracts.attacks import Attack
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import AttackSpec
from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class ArtConfig:
    """Options of art.

    Attributes:
        method: `pgd` is the toolbox's ProjectedGradientDescent, `mim` its MomentumIterativeMethod.
        height_px, width_px: size of the patch.
        eps_unit: largest change of a value from its start, of 0..1; 1 is no limit.
        step_unit: change of each value in a step, of 0..1.
        batch: number of samples per step.
    """

    method: Literal["pgd", "mim"] = "pgd"
    height_px: int = 100
    width_px: int = 200
    eps_unit: float = 1.0
    step_unit: float = 0.05
    batch: int = 4

    def __post_init__(self) -> None:
        for name in ("height_px", "width_px", "batch", "step_unit", "eps_unit"):
            if not getattr(self, name) > 0:
                raise FieldError(name, f"must be above 0, got {getattr(self, name)}")


def build(config: ArtConfig) -> Attack:
    """Imports the toolbox when the attack is asked for."""
    from gear_attack_art.art import ArtAttack

    return ArtAttack(config)


spec = AttackSpec(
    name="art",
    summary="Gradient attacks of the Adversarial Robustness Toolbox, through gear's compositor.",
    config=ArtConfig,
    build=build,
    needs_gradients=True,
)


@hookimpl
def gear_attacks() -> list[AttackSpec[ArtConfig]]:
    """Called by gear, which finds this module through the entry point in pyproject.toml."""
    return [spec]
