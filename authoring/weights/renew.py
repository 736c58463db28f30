"""Shipped weights measured again, after the look has changed in a way that they bear."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from authoring.weights.ship import MADE_BY, MODELS, TRAINING, Measured, head, wrapped
from gear.dataset.files import write_alone
from gear.nn.weights import read, write
from gear.values.errors import GearError
from gear.values.serial import to_json
from gear.verbs.look import look_now, read_look


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
    """Writes today's look and figures into `<model>.safetensors` and `<model>.md`; returns the former.

    The numbers stay as they are, and so do the card's words on how they were made; the note comes after them.

    Raises:
        GearError: the evaluation is of other weights, or the files do not say what is to be renewed.
    """
    target = models / f"{model}.safetensors"
    state, metadata = read(target)
    measured = Measured.read(evaluation, model, target)
    trained = read_look(json.loads(metadata.get("look", "null")))
    made, heading, rest = target.with_suffix(".md").read_text(encoding="utf-8").partition(f"\n{MADE_BY}\n")
    how, training, data = rest.partition(f"{TRAINING}\n")
    if trained is None or not (made and heading and training):
        raise GearError(f"{target}: it or its card does not say what look it knows or how it was made")
    look = look_now(trained)
    metadata |= measured.texts() | {"look": json.dumps(to_json(look), sort_keys=True), "look_hash": look.hash}
    write(target, state, metadata, halves=True)
    lines = [*head(target, metadata, measured), f"{MADE_BY}\n{how}" + "\n".join([*wrapped(note), f"{training}{data}"])]
    write_alone(target.with_suffix(".md"), "\n".join(lines).encode())
    return target
