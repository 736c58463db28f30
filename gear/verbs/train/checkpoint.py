"""A training on disk, whole at any time: a safetensors file with everything that the next step depends on."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save as to_bytes
from torch import Tensor, nn

from gear.dataset.files import write_whole
from gear.values.errors import DatasetError
from gear.values.serial import Json
from gear.verbs.train.feed import Position
from gear.verbs.train.optimise import RunningMean

FILE = "checkpoint.safetensors"


@dataclass(slots=True)
class Progress:
    """How far a training is.

    Attributes:
        step: steps that are over.
        position: in the data.
        elapsed_s: time that steps and validations have taken.
        best_step: after which step the kept weights stood; -1 before the first validation.
        worse: validations since then.
        steps: `step`, `loss`, `rate` of stretches of the training.
        open_losses: of steps that are in no stretch yet.
        validations: `step`, `elapsed_s`, `took_s`, `loss` and figures of every validation.
    """

    step: int = 0
    position: Position = field(default_factory=Position)
    elapsed_s: float = 0.0
    best_step: int = -1
    worse: int = 0
    steps: list[dict[str, float]] = field(default_factory=list)
    open_losses: list[float] = field(default_factory=list)
    validations: list[dict[str, Any]] = field(default_factory=list)

    def as_json(self) -> Json:
        """All of it."""
        return dataclasses.asdict(self)

    @staticmethod
    def from_json(value: Json) -> Progress:
        """The inverse."""
        return Progress(**{**value, "position": Position(**value["position"])})


def save(
    root: Path,
    plan: Json,
    progress: Progress,
    module: nn.Module,
    mean: RunningMean,
    optimiser: torch.optim.Optimizer,
    extra: Mapping[str, Tensor],
) -> None:
    """Writes a checkpoint in place of the last one."""
    tensors = {f"module.{key}": value for key, value in module.state_dict().items()}
    tensors |= {f"mean.{key}": value for key, value in mean.state.items()}
    for number, entries in optimiser.state_dict()["state"].items():
        tensors |= {f"optimiser.{number}.{key}": value for key, value in entries.items() if torch.is_tensor(value)}
    tensors |= {f"extra.{key}": value for key, value in extra.items()}
    whole = {key: value.detach().cpu().clone().contiguous() for key, value in tensors.items()}
    texts = {"plan": json.dumps(plan, sort_keys=True), "progress": json.dumps(progress.as_json())}
    write_whole(root, FILE, to_bytes(whole, texts))


def load(
    root: Path, plan: Json, module: nn.Module, mean: RunningMean, optimiser: torch.optim.Optimizer
) -> tuple[Progress, dict[str, Tensor]] | None:
    """Takes up a checkpoint, or does nothing where there is none.

    Returns:
        The progress and the extra tensors.

    Raises:
        DatasetError: what is there was begun with other settings or data, or is damaged.
    """
    path = root / FILE
    if not path.exists():
        return None
    try:
        with safe_open(str(path), framework="pt") as opened:
            texts = opened.metadata() or {}
            tensors = {key: opened.get_tensor(key) for key in opened.keys()}  # noqa: SIM118
        there, progress = json.loads(texts["plan"]), json.loads(texts["progress"])
    except (SafetensorError, KeyError, ValueError) as error:
        raise DatasetError(path, f"is damaged ({error}); delete it to train from the start") from error
    check_plan(root, there, plan)
    module.load_state_dict(_below(tensors, "module."))
    for key, value in _below(tensors, "mean.").items():
        mean.state[key].copy_(value)
    state: dict[int, dict[str, Tensor]] = {}
    for key, value in _below(tensors, "optimiser.").items():
        number, _, name = key.partition(".")
        state.setdefault(int(number), {})[name] = value
    optimiser.load_state_dict({**optimiser.state_dict(), "state": state})
    return Progress.from_json(progress), _below(tensors, "extra.")


def check_plan(root: Path, there: Json, wanted: Json) -> None:
    """Whether a training that was begun is the one that is asked for.

    Raises:
        DatasetError: it is not; says what differs.
    """
    if there == wanted:
        return
    differs = sorted(_differences(there, wanted))
    raise DatasetError(root, f"holds a training with other settings ({', '.join(differs)} differ); use another --out")


def _differences(one: Json, two: Json, key: str = "") -> set[str]:
    if isinstance(one, dict) and isinstance(two, dict):
        names = one.keys() | two.keys()
        return {
            found
            for name in names
            for found in _differences(one.get(name), two.get(name), f"{key}.{name}" if key else name)
        }
    return set() if one == two else {key}


def _below(tensors: Mapping[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {key.removeprefix(prefix): value for key, value in tensors.items() if key.startswith(prefix)}
