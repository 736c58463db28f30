"""Copies trained weights into the weights package, with metrics on held-out data and a card."""

from __future__ import annotations

import argparse
import json
import math
import shlex
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gear.dataset.files import sha256, write_alone
from gear.measuring.guarded_model import weights_digest
from gear.measuring.plugin_selection import chosen_model
from gear.networks.shipped import CHECKOUT
from gear.networks.weights import read, write
from gear.plugins.build import build
from gear.values.errors import GearError
from gear.verbs.train.results import HISTORY, WEIGHTS

MODELS = CHECKOUT / "models"
REPORT = "reference"
MADE_BY, TRAINING = "## Made by", "## Training data"
FACTS = ("scene", "weather", "split", "seed", "patch", "samples")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of `python -m authoring.weights ship`."""
    parser.add_argument(
        "runs", nargs="+", type=Path, help="folders of gear train, in order; the weights of the last one are shipped"
    )
    parser.add_argument(
        "--evaluation", type=Path, required=True, help="folder of gear evaluate --report reference, held-out data"
    )
    parser.add_argument(
        "--base", type=Path, default=Path(), help="folder of data and runs; paths in the card are relative to it"
    )
    parser.add_argument(
        "--averaged", type=Path, help="file of gear weights average, shipped in place of the last weights"
    )
    parser.add_argument("--note", default="", help="text about the training, for the card")
    parser.add_argument("--samples", type=int, help="value of `--samples` in the collection of the training data")
    parser.add_argument(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        dest="settings",
        help="another setting of this collection; repeatable",
    )


def run(args: argparse.Namespace) -> int:
    """Ships the weights of one network."""
    target = ship(
        args.runs, args.evaluation, args.base,
        samples=args.samples, settings=args.settings, averaged=args.averaged, note=args.note,
    )  # fmt: skip
    print(target)
    return 0


def ship(
    runs: Sequence[Path],
    evaluation: Path,
    base: Path,
    models: Path = MODELS,
    *,
    samples: int | None = None,
    settings: Sequence[str] = (),
    averaged: Path | None = None,
    note: str = "",
) -> Path:
    """Writes `<model>.safetensors` and `<model>.md`; returns the path of the first.

    Args:
        runs: folders of `gear train`, in order; each run starts with the weights of the previous one.
        evaluation: folder of `gear evaluate --report reference` with the weights that are shipped.
        base: folder; commands in the card name files below it by their relative path.
        models: folder of the weights package.
        samples: value of `--samples` in the collection of the training data, if it had one.
        settings: values of `--set` in the collection of the training data.
        averaged: a file of `gear weights average` that is shipped in place of the last run's weights.
        note: text about the training, for the card.

    Raises:
        GearError: the evaluation is of another network or other weights, or lacks the report.
    """
    weights = averaged or runs[-1] / WEIGHTS
    state, metadata = read(weights)
    name = metadata["model"]
    measured = Measured.read(evaluation, name, weights)
    metadata |= measured.texts()
    histories = [_json(one / HISTORY) for one in runs]
    commands = [_without(base, history["command"]).replace("--out DIR", f"--out {_without(base, str(one))}")
                for history, one in zip(histories, runs, strict=True)]  # fmt: skip
    collected = ["python", "-m", "authoring.weights", "training", "--task", metadata["task"], "--out", "."]
    options = ["--samples", str(samples)] if samples else []
    options += [part for text in settings for part in ("--set", text)]
    commands.insert(0, shlex.join(collected + options))
    if averaged is not None:
        commands.append(_without(base, metadata["command"]))
    metadata["command"] = " && ".join(commands)
    target = models / f"{name}.safetensors"
    models.mkdir(parents=True, exist_ok=True)
    write(target, state, metadata, halves=True)
    card = _card(target, metadata, histories, commands, measured, note)
    write_alone(target.with_suffix(".md"), card.encode())
    return target


@dataclass(frozen=True, slots=True)
class Measured:
    """An evaluation on held-out data.

    Attributes:
        results: content of `results.json`.
        samples: number of pictures.
        metrics: metrics of the report over all pictures; each is a mapping with `value`, `low` and `high`.
    """

    results: Any
    samples: int
    metrics: Mapping[str, Any]

    @staticmethod
    def read(evaluation: Path, name: str, weights: Path) -> Measured:
        """Reads an evaluation of a network's weights.

        Args:
            evaluation: folder of `gear evaluate`.
            name: name of the network.
            weights: the weights file that must have been evaluated.

        Raises:
            GearError: the evaluation is of another network or other weights, or lacks the report.
        """
        results = _json(evaluation / "results.json")
        if results["model"]["weights_sha256"] != _digest(name, weights):
            raise GearError(f"{evaluation}: not an evaluation of {weights}")
        together = results["together"][0] if results["together"] else results["rows"][0]
        metrics: dict[str, Any] = together["metrics"].get(REPORT, {})
        if not metrics:
            raise GearError(f"{evaluation}: holds no report {REPORT!r}; evaluate again with --report {REPORT}")
        return Measured(results, together["samples"], metrics)

    def texts(self) -> dict[str, str]:
        """Returns the metrics as metadata of a weights file."""
        known = {key: one for key, one in self.metrics.items() if one["value"] is not None}
        return {
            "metrics": json.dumps({key: one["value"] for key, one in known.items()}),
            "intervals": json.dumps({key: [one["low"], one["high"]] for key, one in known.items()}),
        }


def head(target: Path, metadata: Mapping[str, str], measured: Measured) -> list[str]:
    """Returns the first lines of a card: facts of the file, and the metrics."""
    data, metrics = target.read_bytes(), measured.metrics
    absent = [key for key, one in metrics.items() if one["value"] is None]
    measured_on = metadata.get("measured_look_hash", metadata["look_hash"])
    return [
        f"# {metadata['model']} for {metadata['task']}",
        "",
        f"`{target.name}`, {len(data) / 1e6:.1f} MB, matrices in float16, sha256 `{sha256(data)}`. MIT licence.",
        f"Made with gear {metadata['gear']}, seed {metadata['seed']}; the look that it knows is"
        f" `{metadata['look_hash']}`.",
        *([f"Measured on pictures of the look `{measured_on}`."] if measured_on != metadata["look_hash"] else []),
        "",
        "## Measured",
        "",
        f"On {measured.samples} pictures at the task's own size, of two scenes and one weather that nothing was",
        "trained on (`python -m authoring.weights held-out`), 95 % intervals by the jackknife over pictures:",
        "",
        "| metric | value | from | to |",
        "|---|---|---|---|",
        *(f"| {key} | {_number(one['value'])} | {_number(one['low'])} | {_number(one['high'])} |"
          for key, one in metrics.items() if one["value"] is not None),
        "",
        *([f"Nothing to measure for: {', '.join(absent)}.", ""] if absent else []),
        *_rows(measured.results),
    ]  # fmt: skip


def _card(
    target: Path,
    metadata: Mapping[str, str],
    histories: Sequence[Any],
    commands: Sequence[str],
    measured: Measured,
    note: str,
) -> str:
    lines = [
        *head(target, metadata, measured),
        MADE_BY,
        "",
        "```",
        *commands,
        "```",
        "",
        *(f"- {one['finished_steps']} steps in {one['elapsed_s'] / 60:.0f} minutes; the weights are those after step "
          f"{one['best_step']}" for one in histories),
        *(["- what is shipped is the mean that the last command makes"] if "averaged" in metadata else []),
        "",
        *wrapped(note),
        TRAINING,
        "",
        "| scene | weather | split | seed | patch | samples |",
        "|---|---|---|---|---|---|",
        *("| " + " | ".join(str(fact[key]) for key in FACTS) + " |" for fact in histories[-1]["training"]),
        "",
        "## Limits",
        "",
        "Trained on rendered pictures of gear's towns alone. It knows their looks, weathers and cameras; on real",
        "pictures, or on towns with another appearance, the network may be much worse.",
        "",
    ]  # fmt: skip
    return "\n".join(lines)


def wrapped(note: str) -> list[str]:
    """Returns the lines of a note and an empty line; no lines without a note."""
    return [*textwrap.wrap(note, 110), ""] if note else []


def _rows(results: Any) -> list[str]:
    """A table of the report's first metric, with one line per dataset."""
    first = next(iter(results["rows"][0]["metrics"][REPORT]))
    lines = [f"| collection | samples | {first} |", "|---|---|---|"]
    for row in results["rows"]:
        one, place = row["metrics"][REPORT][first], Path(row["dataset"]["root"]).name
        lines.append(f"| {place} | {row['samples']} | {_number(one['value'])} |")
    return [*lines, ""]


def _number(value: float | None) -> str:
    return "-" if value is None or math.isnan(value) else f"{value:.3f}"


def _without(base: Path, text: str) -> str:
    return text.replace(f"{base.resolve()}/", "") if base != Path() else text


def _digest(name: str, weights: Path) -> str | None:
    """The hash of the weights in a file, as in evaluations."""
    chosen = chosen_model(name, [f"weights={weights}"])
    return weights_digest(build(chosen.found, chosen.options))


def _json(path: Path) -> Any:
    if not path.is_file():
        raise GearError(f"{path}: there is no such file")
    return json.loads(path.read_text())
