"""Checkpoints of a training: safetensors files with everything on which the next step depends, written atomically."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save as to_bytes
from torch import Tensor, nn

from gear.dataset.files import write_whole
from gear.plugins.text import one_line
from gear.values.errors import DatasetError, FieldError
from gear.values.regular_file import check_regular
from gear.values.serial import Json, from_json
from gear.verbs.train.feed import Position
from gear.verbs.train.optimise import RunningMean

FILE = "checkpoint.safetensors"

BROKEN = (SafetensorError, OSError, KeyError, ValueError, RecursionError)
"""Exceptions that reading a file raises if the file is no valid checkpoint."""


@dataclass(slots=True)
class TrainingState:
    """The progress of a training, as stored in a checkpoint.

    Attributes:
        step: number of finished steps.
        position: epoch and batch at which the training continues.
        elapsed_s: time of all steps and validations, in seconds.
        best_step: step after which the weights were the best in validation; -1 before the first validation.
        best_sha256: hash of the file with the best weights; "" in checkpoints of older versions.
        worse: number of validations since the best one.
        broken: number of consecutive steps, up to the last one, that were skipped because the loss was not finite.
        steps: history of the training: `step`, mean `loss` and learning rate `rate`, one entry per 10 steps.
        open_losses: losses of the steps after the last entry of `steps`.
        validations: `step`, `elapsed_s`, `took_s`, `loss` and metrics of every validation.
    """

    step: int = 0
    position: Position = field(default_factory=Position)
    elapsed_s: float = 0.0
    best_step: int = -1
    best_sha256: str = ""
    worse: int = 0
    broken: int = 0
    steps: list[dict[str, float]] = field(default_factory=list)
    open_losses: list[float] = field(default_factory=list)
    validations: list[dict[str, Any]] = field(default_factory=list)

    def as_json(self) -> Json:
        """Returns all fields as JSON."""
        return dataclasses.asdict(self)

    @staticmethod
    def from_json(value: Json) -> TrainingState:
        """Reads a state from the JSON `value` that `as_json` returned.

        Raises:
            ValueError, KeyError, TypeError: a field that a training needs to continue is missing or invalid, or there
                is an unknown field.
        """
        kinds = {"step": int, "best_step": int, "worse": int, "elapsed_s": float}
        for name, kind in kinds.items():
            from_json(kind, value[name], name)
        from_json(int, value.get("broken", 0), "broken")
        if not re.fullmatch("([0-9a-f]{64})?", from_json(str, value.get("best_sha256", ""), "best_sha256")):
            raise FieldError("best_sha256", "is no digest")
        from_json(Position, value["position"], "position")
        from_json(tuple[float, ...], value["open_losses"], "open_losses")
        for name in ("steps", "validations"):
            from_json(tuple[dict[str, float], ...], value[name], name)
        validated = [entry["step"] for entry in value["validations"]] or [-1]
        if value["best_step"] not in validated:
            raise FieldError("best_step", f"no validation was after step {value['best_step']}")
        return TrainingState(**{**value, "position": Position(**value["position"])})


def save(
    root: Path,
    plan: Json,
    progress: TrainingState,
    module: nn.Module,
    mean: RunningMean,
    optimiser: torch.optim.Optimizer,
    extra: Mapping[str, Tensor],
) -> None:
    """Writes a checkpoint and replaces the previous one.

    Args:
        root: folder of the training.
        plan: everything on which the weights depend, as JSON.
        progress: progress of the training.
        module: the trained network.
        mean: moving average of the network's weights.
        optimiser: the optimiser.
        extra: further tensors to store, such as adversarial patches.
    """
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
) -> tuple[TrainingState, dict[str, Tensor]] | None:
    """Loads the checkpoint in the folder `root` into the network, the averaged weights and the optimiser.

    Args:
        root: folder of the training.
        plan: everything on which the weights depend, as JSON.
        module: the network.
        mean: moving average of the weights.
        optimiser: optimiser of the network.

    Returns:
        The progress and the extra tensors; None if there is no checkpoint.

    Raises:
        DatasetError: the checkpoint belongs to a training with other settings or data, or is damaged.
    """
    path = root / FILE
    if not path.exists():
        return None
    try:
        with safe_open(str(check_regular(path)), framework="pt") as opened:
            texts = opened.metadata() or {}
            tensors = {key: opened.get_tensor(key) for key in opened.keys()}  # noqa: SIM118
        there, progress = json.loads(texts["plan"]), json.loads(texts["progress"])
    except BROKEN as error:
        raise _damaged(path, error) from error
    check_plan(root, there, plan)
    try:
        taken_up = TrainingState.from_json(progress)
        module.load_state_dict(_below(tensors, "module."))
        _fill(mean.state, _below(tensors, "mean."))
        optimiser.load_state_dict({**optimiser.state_dict(), "state": _states(tensors, optimiser)})
    except (KeyError, ValueError, TypeError, RuntimeError) as error:
        raise _damaged(path, error) from error
    return taken_up, _below(tensors, "extra.")


def begun_config(root: Path) -> Json:
    """Returns the config, as JSON, of the training whose checkpoint is in the folder `root`.

    The result is None if the folder has no checkpoint, or a checkpoint that cannot be read; `load` raises an error for
    the second case.
    """
    path = root / FILE
    if not path.exists():
        return None
    try:
        with safe_open(str(check_regular(path)), framework="pt") as opened:
            return json.loads((opened.metadata() or {})["plan"])["config"]
    except (*BROKEN, TypeError):
        return None


def _damaged(path: Path, error: Exception) -> DatasetError:
    return DatasetError(path, f"is damaged ({one_line(error)}); delete it to train from the start")


def _fill(state: Mapping[str, Tensor], given: Mapping[str, Tensor]) -> None:
    """Copies tensors into the tensors of `state` after comparing shapes, because torch would broadcast smaller
    tensors without an error.
    """
    for key, tensor in state.items():
        if given[key].shape != tensor.shape:
            raise ValueError(f"mean.{key} is {tuple(given[key].shape)}, not {tuple(tensor.shape)}")
        tensor.copy_(given[key])


def _states(tensors: Mapping[str, Tensor], optimiser: torch.optim.Optimizer) -> dict[int, dict[str, Tensor]]:
    """Returns the optimiser's state of each weight: counters, and tensors with the shape of the weight."""
    weights = [weight for group in optimiser.param_groups for weight in group["params"]]
    state: dict[int, dict[str, Tensor]] = {}
    for key, value in _below(tensors, "optimiser.").items():
        number, _, name = key.partition(".")
        if not number.isdecimal() or int(number) >= len(weights):
            raise ValueError(f"optimiser.{key} is of no weight")
        if value.dim() and value.shape != weights[int(number)].shape:
            raise ValueError(f"optimiser.{key} is {tuple(value.shape)}, not {tuple(weights[int(number)].shape)}")
        state.setdefault(int(number), {})[name] = value
    if len({tuple(sorted(entries)) for entries in state.values()}) > 1:
        raise ValueError("the optimiser's state is of some weights only in part")
    return state


def check_plan(root: Path, stored: Json, expected: Json) -> None:
    """Checks that the training in a folder has the requested settings and data.

    Args:
        root: folder of the training, for the message.
        stored: plan in the checkpoint: everything on which the weights depend, as JSON.
        expected: plan of the requested training.

    Raises:
        DatasetError: the plans differ; the message names the keys.
    """
    if stored == expected:
        return
    differs = sorted(_differences(stored, expected))
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
