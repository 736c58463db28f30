"""Updates the metrics of shipped weights after the towns' appearance has changed, without training them again."""

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
    """Adds the arguments of `python -m authoring.weights renew`."""
    parser.add_argument("model", help="network whose shipped weights are measured again")
    parser.add_argument(
        "--evaluation", type=Path, required=True, help="folder of gear evaluate --report reference, on current towns"
    )
    parser.add_argument("--note", required=True, help="what has changed since the training")


def run(args: argparse.Namespace) -> int:
    """Updates the weights file and the card of one network."""
    print(renew(args.model, args.evaluation, args.note))
    return 0


def renew(model: str, evaluation: Path, note: str, models: Path = MODELS) -> Path:
    """Writes the metrics of an evaluation, and the hash of the current appearance, into `<model>.safetensors` and
    `<model>.md`.

    The weights do not change. The files still name the appearance on which they were trained, so `gear models` still
    lists what has changed since. The card keeps its section on the training; the note is added to it.

    Args:
        model: name of the network.
        evaluation: folder of `gear evaluate --report reference` with the shipped weights.
        note: what has changed since the training.
        models: folder of the weights package.

    Returns:
        Path of the weights file.

    Raises:
        GearError: the evaluation is of other weights, or the weights file or its card is incomplete.
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
