"""The request of a training."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gear.values.errors import GearError


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainRequest:
    """The arguments of `gear.train`, which documents them; None leaves a value to the network's recipe.

    Raises:
        GearError: there are no data.
    """

    task: str
    model: str
    data: tuple[str, ...]
    out: str | Path
    val: tuple[str, ...] = ()
    epochs: int | None = None
    time_budget_s: float | None = None
    batch: int | None = None
    lr: float | None = None
    seed: int | None = None
    init: str | Path | None = None
    precision: str | None = None
    device: str | None = None
    workers: int | None = None
    adversarial: str | None = None
    settings: tuple[str, ...] = ()
    allow_test_data: bool = False

    def __post_init__(self) -> None:
        if not self.data:
            raise GearError("there are no data to train on; give --data DIR")

    @property
    def config_values(self) -> dict[str, Any]:
        """Keys of `TrainConfig` with their values; None for what was not given."""
        return {
            "epochs": self.epochs,
            "time_budget_s": self.time_budget_s,
            "batch": self.batch,
            "learning_rate": self.lr,
            "seed": self.seed,
            "init": self.init,
            "precision": self.precision,
            "device": self.device,
            "workers": self.workers,
        }

    @property
    def config_settings(self) -> tuple[str, ...]:
        """`KEY=VALUE` texts for `TrainConfig`, with the one that `adversarial` stands for."""
        return self.settings if self.adversarial is None else (f"adversarial.attack={self.adversarial}", *self.settings)

    @property
    def command_flags(self) -> dict[str, Any]:
        """Further flags, besides data and settings, of the command that repeats the training, by flag."""
        return {
            "epochs": self.epochs,
            "time_budget": _budget(self.time_budget_s),
            "batch": self.batch,
            "lr": self.lr,
            "seed": self.seed,
            "init": self.init,
            "precision": self.precision,
            "allow_test_data": self.allow_test_data,
        }


def _budget(seconds: float | None) -> str | None:
    """The time budget as text for the command: all digits, no exponent, empty if epochs are counted."""
    return None if not seconds else f"{np.format_float_positional(seconds, trim='-')}s"
