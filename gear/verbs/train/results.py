"""The results of a training: weights with their metadata, the history of the training, and a model card."""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Mapping as AnyMapping
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from torch import Tensor

from gear.config.dump import to_plain
from gear.config.nodes import Mapping
from gear.config.reader import read_node
from gear.contracts.specs import TaskSpec
from gear.dataset.files import read_bytes, sha256, write_whole
from gear.dataset.guarded_paths import remove_files
from gear.measuring.appearance_hash import Appearance
from gear.networks.options import CIRCUMSTANCES
from gear.networks.weights import serialised
from gear.plugins.catalogue import PluginEntry
from gear.readers import Samples
from gear.values.errors import DatasetError
from gear.values.serial import to_json
from gear.verbs.train.checkpoint import FILE as CHECKPOINT
from gear.verbs.train.checkpoint import TrainingState
from gear.verbs.train.config import TrainConfig
from gear.verbs.train.curves import FILE as CURVES
from gear.verbs.train.run_log import SAMPLES_FILE
from gear.verbs.train.starting import SCALE

WEIGHTS = "model.safetensors"
HISTORY = "train.json"
CARD = "card.md"


@dataclass(frozen=True, slots=True, kw_only=True)
class Origin:
    """How weights were trained: network, task, config and data.

    Attributes:
        model: plugin of the network.
        spec, task: spec and name of the task.
        config: config of the training.
        training, validation: training samples and validation samples.
        command: command line that repeats the training.
        appearance: hashes and versions of assets, light and renderer of the training pictures.
        picture_share: width of the training pictures divided by the task's default width.
    """

    model: PluginEntry
    spec: TaskSpec[Any]
    task: str
    config: TrainConfig
    training: Samples
    validation: Samples
    command: str
    appearance: Appearance
    picture_share: float

    def metadata(self, metrics: AnyMapping[str, Any]) -> dict[str, str]:
        """Returns the metadata of the weights file: `model`, `package`, `task`, `gear` (version), `command`, `seed`,
        `look` and `look_hash` (appearance of the training pictures), `data`, `metrics` and `options`. All values are
        texts; structured values are JSON texts.

        Args:
            metrics: validation metrics of the weights, by name; those that are not finite are left out.
        """
        data = {"training": self.training.facts(), "validation": self.validation.facts()}
        return {
            "model": self.model.spec.name,
            "package": self.model.owner.package,
            "task": self.task,
            "gear": version("mujoco-gear"),
            "command": self.command,
            "seed": str(self.config.seed),
            "look": json.dumps(to_json(self.appearance), sort_keys=True),
            "look_hash": self.appearance.hash,
            "data": json.dumps(data, sort_keys=True),
            "metrics": json.dumps(known(metrics), sort_keys=True),
            "options": json.dumps(self._options(), sort_keys=True),
        }

    def _options(self) -> dict[str, Any]:
        """Returns the options of the network that the user gave, adapted to pictures of the task's default size."""
        given = self.config.options.entries if isinstance(self.config.options, Mapping) else {}
        values: Any = to_plain(read_node(self.model.spec.config, self.config.options, "options"))
        options = {name: values[name] for name in given if name not in CIRCUMSTANCES}
        if options.get(SCALE):
            options[SCALE] *= self.picture_share
        return options


def known(metrics: AnyMapping[str, Any]) -> dict[str, Any]:
    """Returns the entries of `metrics` without those that are NaN or infinite, which JSON does not allow."""
    return {key: value for key, value in metrics.items() if not isinstance(value, float) or math.isfinite(value)}


def metrics_of(validation: AnyMapping[str, Any]) -> dict[str, float]:
    """Returns the metrics of `validation`, an entry of the validations, without its step and its times."""
    return {key: value for key, value in validation.items() if key not in ("step", "elapsed_s", "took_s")}


def command_of(
    task: str, model: str, data: Sequence[str], val: Sequence[str], flags: AnyMapping[str, Any], settings: Sequence[str]
) -> str:
    """Returns the `gear train` command line for the given values; a flag that is True has no value, and None or
    False leaves a flag out.

    Args:
        task, model: names of the task and of the network.
        data, val: folders of training and validation data.
        flags: values of further flags by name.
        settings: `KEY=VALUE` texts of `--set`.
    """
    words = ["gear", "train", "--task", task, "--model", model, "--data", *data, *(["--val", *val] if val else [])]
    for key, value in flags.items():
        if value is not None and value is not False:
            words += [f"--{key.replace('_', '-')}", *([] if value is True else [f"{value}"])]
    for setting in settings:
        words += ["--set", setting]
    return shlex.join([*words, "--out", "DIR"])


def packed(origin: Origin, state: AnyMapping[str, Tensor], progress: TrainingState) -> bytes:
    """Returns the weights of the last validation as the bytes of a safetensors file, with matrices in float16.

    Args:
        origin: network, task, config and data of the training.
        state: the weights by parameter name.
        progress: state of the training, with its validations.
    """
    metrics = metrics_of(progress.validations[-1])
    return serialised(state, origin.metadata(metrics), halves=True)


def write_weights(root: Path, weights: bytes) -> None:
    """Writes the weights file. Files that describe earlier weights are deleted first and written again at the end of
    the training.

    Args:
        root: folder of the training.
        weights: content of the weights file (safetensors).
    """
    remove_files(root, [CARD, HISTORY, CURVES, SAMPLES_FILE])
    write_whole(root, WEIGHTS, weights)


def is_kept(root: Path, progress: TrainingState) -> bool:
    """Whether the file of the best weights exists and has the recorded hash.

    Checkpoints of older versions record no hash; then any file counts.

    Args:
        root: folder of the training.
        progress: state of the training, with the recorded hash.
    """
    path = root / WEIGHTS
    return path.is_file() and progress.best_sha256 in ("", sha256(read_bytes(path)))


def check_kept(root: Path, progress: TrainingState) -> None:
    """Checks that the file of the best weights exists and has the recorded hash.

    Args:
        root: folder of the training.
        progress: state of the training, with the recorded hash.

    Raises:
        DatasetError: the file is missing, or has other content.
    """
    if not (root / WEIGHTS).is_file():
        raise DatasetError(root / WEIGHTS, f"is gone; put it back, or delete {CHECKPOINT} beside it to train again")
    if not is_kept(root, progress):
        raise DatasetError(
            root / WEIGHTS, f"is not what this training kept; put that back, or delete {CHECKPOINT} to train again"
        )


def write_history(root: Path, origin: Origin, progress: TrainingState) -> None:
    """Writes `train.json`, the history of the training, and `card.md`, the model card, into the folder `root`.

    Args:
        root: folder of the training.
        origin: network, task, config and data of the training.
        progress: final state of the training.
    """
    config: Any = to_plain(origin.config)
    history = {
        "task": origin.task,
        "model": origin.model.full_name,
        "command": origin.command,
        "config": config,
        "training": origin.training.facts(),
        "validation": origin.validation.facts(),
        "finished_steps": progress.step,
        "elapsed_s": round(progress.elapsed_s, 3),
        "best_step": progress.best_step,
        "steps": progress.steps,
        "validations": [known(entry) for entry in progress.validations],
    }
    write_whole(root, HISTORY, (json.dumps(history, indent=1) + "\n").encode())
    write_whole(root, CARD, card(root, origin, progress).encode())


def card(root: Path, origin: Origin, progress: TrainingState) -> str:
    """Returns the model card of the trained weights as Markdown: weights, settings, training data, validation
    metrics and limits.

    Args:
        root: folder of the training, which holds the weights file.
        origin: network, task, config and data of the training.
        progress: final state of the training: steps, time, validations and the step with the best validation.

    Raises:
        DatasetError: the weights file is missing, or its content is not what the training wrote.
    """
    best = next(entry for entry in progress.validations if entry["step"] == progress.best_step)
    check_kept(root, progress)
    weights = read_bytes(root / WEIGHTS)
    config = origin.config
    spec: Any = origin.model.spec
    lines = [
        f"# {spec.name} for {origin.task}",
        "",
        spec.summary,
        "",
        f"- weights: `{WEIGHTS}`, {len(weights) / 1e6:.1f} MB, sha256 `{sha256(weights)}`",
        f"- made by: `{origin.command}`",
        f"- gear {version('mujoco-gear')}, seed {config.seed}, begun with {config.init or 'random weights'}",
        f"- {config.optimiser}, learning rate {config.learning_rate:g}, weight decay {config.weight_decay:g}, "
        f"batch {config.batch}, crop {_size(config.crop_px)}, {config.precision}",
        f"- {progress.step} steps in {progress.elapsed_s / 60:.1f} minutes; the weights are those after step "
        f"{progress.best_step}",
        f"- appearance of the data: `{origin.appearance.hash}`",
        *_size_lines(origin),
        "",
        "## Training data",
        "",
        *_data_table(origin.training),
        "",
        "## Validation",
        "",
        f"On {len(origin.validation)} held-out sample{'s' * (len(origin.validation) != 1)}, whole pictures, float32:",
        "",
        "| metric | value |",
        "|---|---|",
        *(f"| {name} | {value:.4f} |" for name, value in known(metrics_of(best)).items()),
        "",
        "![curves](curves.png)",
        *(["", f"![validation samples]({SAMPLES_FILE})"] if (root / SAMPLES_FILE).is_file() else []),
        "",
        "## Limits",
        "",
        "Trained only on rendered pictures of gear's towns, with their appearance, weathers and cameras. On real",
        "pictures, or on towns with another appearance, the network may be much worse.",
        "",
    ]
    return "\n".join(lines)


def _size_lines(origin: Origin) -> list[str]:
    """Returns lines of the model card on how to use the weights for pictures of the training's size; none if that
    is the default size.
    """
    given = origin.config.options
    scale = read_node(origin.model.spec.config, given, "options") if isinstance(given, Mapping) else None
    seen = getattr(scale, SCALE, None)
    if seen is None or origin.picture_share == 1:
        return []
    return [
        f"- pictures {origin.picture_share:g} times as wide as the task's own: on such pictures use these weights with "
        f"`--set {SCALE}={seen:g}`, on the task's own as they are"
    ]


def _size(crop_px: tuple[int, int] | None) -> str:
    return "none" if crop_px is None else f"{crop_px[1]}x{crop_px[0]}"


def _data_table(samples: Samples) -> list[str]:
    rows = ["| scene | weather | split | seed | patch | samples |", "|---|---|---|---|---|---|"]
    for fact in samples.facts():
        entry: Any = fact
        cells = (entry[key] for key in ("scene", "weather", "split", "seed", "patch", "samples"))
        rows.append("| " + " | ".join(str(cell) for cell in cells) + " |")
    return rows
