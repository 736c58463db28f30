"""The arguments of `gear.train` as a dataclass."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gear.values.errors import GearError


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainRequest:
    """The arguments of `gear.train`. None means the value in the network's recipe (its default hyperparameters).

    Attributes:
        task, model: names of the task and of the network.
        data, val: datasets for training, and for validation; without `val` a part of `data` is held out.
        out: folder of the results.
        epochs, time_budget_s: length of the training in passes over the data, or in seconds.
        batch, lr, seed, init, precision, device, workers: values of the keys of `TrainConfig` with these names (`lr` is
            `learning_rate`).
        adversarial: attack plugin that makes patches during the training; None for none.
        settings: `KEY=VALUE` texts for further keys of `TrainConfig`.
        allow_test_data: whether `test` splits are accepted.
        log_to, log_settings: name of a logger plugin, None for no log, and its `KEY=VALUE` options. Weights do not
            depend on them.

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
    log_to: str | None = None
    log_settings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.data:
            raise GearError("there are no data to train on; give --data DIR")

    @property
    def config_values(self) -> dict[str, Any]:
        """The arguments that are fields of `TrainConfig`, by name of the field; None for arguments that the user
        did not give.
        """
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
        """The `KEY=VALUE` texts for `TrainConfig`; the argument `adversarial` is included as such a text."""
        return self.settings if self.adversarial is None else (f"adversarial.attack={self.adversarial}", *self.settings)

    @property
    def command_flags(self) -> dict[str, Any]:
        """Values of flags of `gear train`, for the command line that repeats this training, by name such as
        `time_budget`. Flags that were not given are None or False.

        Data and output folders, `--device`, `--workers` and `--log-to` are not included; `--set` and `--adversarial`
        are in `config_settings`.
        """
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
    """Returns the time budget as text for the command line, without an exponent, such as `600.5s`; None if epochs
    are counted.
    """
    return None if not seconds else f"{np.format_float_positional(seconds, trim='-')}s"
