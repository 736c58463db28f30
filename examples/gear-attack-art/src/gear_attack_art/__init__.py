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
        height_px, width_px: the patch's size.
        eps_unit: how far a value may move from where it began, of 0..1; 1 is no limit.
        step_unit: how far a step moves each value, of 0..1.
        batch: samples that a step looks at.
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
    """Imports the toolbox only when somebody asks for the attack."""
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
    """Found by gear through the entry point in pyproject.toml."""
    return [spec]
