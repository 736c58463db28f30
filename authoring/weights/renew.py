"""Shipped weights measured again, after the look has changed in a way that they bear."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from authoring.weights.ship import MADE_BY, MODELS, TRAINING, Measured, head, wrapped
from gear.dataset.files import write_alone
from gear.measuring.appearance_hash import current_appearance, read_appearance
from gear.networks.weights import read, write
from gear.values.errors import GearError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Of the command."""
    parser.add_argument("model", help="whose shipped weights")
    parser.add_argument(
        "--evaluation", type=Path, required=True, help="gear evaluate --report reference, held-out data of today"
    )
    parser.add_argument("--note", required=True, help="what has changed since they were trained")


def run(args: argparse.Namespace) -> int:
    """Renews one network's file and card."""
    print(renew(args.model, args.evaluation, args.note))
    return 0


def renew(model: str, evaluation: Path, note: str, models: Path = MODELS) -> Path:
    """Writes today's figures, and of which look they are, into `<model>.safetensors` and `<model>.md`.

    The numbers stay as they are, and so does the look that they were trained on: `gear models` goes on saying what has
    changed since. The card's words on how they were made stay, too; the note comes after them.

    Returns:
        The former file.

    Raises:
        GearError: the evaluation is of other weights, or the files do not say what is to be renewed.
    """
    target = models / f"{model}.safetensors"
    state, metadata = read(target)
    measured = Measured.read(evaluation, model, target)
    trained = read_appearance(json.loads(metadata.get("look", "null")))
    made, heading, rest = target.with_suffix(".md").read_text(encoding="utf-8").partition(f"\n{MADE_BY}\n")
    how, training, data = rest.partition(f"{TRAINING}\n")
    if trained is None or not (made and heading and training):
        raise GearError(f"{target}: it or its card does not say what look it knows or how it was made")
    metadata |= measured.texts() | {"measured_look_hash": current_appearance(trained).hash}
    write(target, state, metadata, halves=True)
    lines = [*head(target, metadata, measured), f"{MADE_BY}\n{how}" + "\n".join([*wrapped(note), f"{training}{data}"])]
    write_alone(target.with_suffix(".md"), "\n".join(lines).encode())
    return target
