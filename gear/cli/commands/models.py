"""`gear models`: lists the installed networks, or prints the details of one network and its weights."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

from gear.cli.streams import line_width, wrapped
from gear.measuring.text_table import text_table

if TYPE_CHECKING:
    from gear.verbs.models import ModelFacts, ShippedWeights

EXAMPLE = """examples:
  gear models
  gear models --task semseg
  gear models show ddrnet23_slim           # its input, published weights and shipped weights
  gear models --json

Nothing is downloaded: fetch published weights yourself, then `gear weights convert MODEL IN OUT`.
"""

HEAD = ("network", "tasks", "size", "weights", "usable", "summary")
"""Column titles of the list of networks."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear models` to its argument parser."""
    parser.epilog = EXAMPLE
    parser.add_argument(
        "action", nargs="?", choices=("list", "show"), default="list", help="list all, or show one (list)"
    )
    parser.add_argument("name", nargs="?", help="name of the network, with show")
    parser.add_argument("--task", help="only networks that do this task")
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Prints the list of installed networks, or the details of one network; returns exit code 0.

    Args:
        args: arguments of the command line: `action`, `name`, `task` and `json`.
    """
    from gear.networks.shipped import shipped_networks
    from gear.verbs.models import list_models

    models = list_models(args.task)
    if args.action == "show":
        models = [the_one(models, args.name)]
    if args.json:
        print(json.dumps({"models": [model.to_json() for model in models]}, indent=1))
        return 0
    if args.action == "show":
        print("\n".join(details(models[0])))
        return 0
    if models:
        print("\n".join(text_table(HEAD, [row(model) for model in models], width=line_width())))
    else:
        print(f"no installed model does {args.task}")
    if not shipped_networks():
        print("no weights are installed; mujoco-gear-weights has those of one network for every task of gear's")
    return 0


def the_one(models: Sequence[ModelFacts], name: str | None) -> ModelFacts:
    """Returns the network with the given name, for `gear models show`.

    Raises:
        GearError: no name was given.
        UnknownNameError: no installed model has this name.
    """
    from gear.values.errors import GearError, UnknownNameError

    if not name:
        raise GearError("gear models show needs a name, such as: gear models show ddrnet23_slim")
    for model in models:
        if name in (model.spec.name, model.found.full_name):
            return model
    raise UnknownNameError("model", name, [model.spec.name for model in models])


def row(model: ModelFacts) -> list[str]:
    """Returns the table cells of the network `model`, in the order of the column titles in `HEAD`."""
    spec = model.spec
    size = f"{spec.parameters / 1e6:.1f} M" if spec.parameters else "-"
    weights = "shipped" if model.shipped else "published" if spec.published else "-"
    if model.shipped is not None and model.shipped.stale:
        weights = "shipped, old appearance"
    usable = "yes" if not model.missing else f"needs {', '.join(model.missing)}"
    return [spec.name, ", ".join(spec.tasks), size, weights, usable, spec.summary]


def details(model: ModelFacts) -> list[str]:
    """Returns a description of the network `model` as lines of text: tasks, size, input, published weights and shipped
    weights.
    """
    spec = model.spec
    size = f"{spec.parameters / 1e6:.1f} M parameters" if spec.parameters else "size not stated"
    facts = [("tasks", ", ".join(spec.tasks)), ("size", size)]
    if model.missing:
        facts.append(("not usable", f"needs {', '.join(model.missing)} (pip install 'mujoco-gear[models]')"))
    if spec.normalisation:
        facts.append(("input", spec.normalisation))
    for weights in spec.published:
        facts.append(("published", f"{weights.data}; {weights.size_mb:g} MB; {weights.licence}; {weights.source}"))
    facts.append(("shipped", shipped_line(model.shipped)))
    return [wrapped(f"{spec.name}: {spec.summary}"), *text_table(("", ""), facts, width=line_width(), wrap=True)[1:]]


def shipped_line(weights: ShippedWeights | None) -> str:
    """Returns one line about the reference weights of a network: file size, metrics, and whether rendering has
    changed since the training.
    """
    if weights is None:
        return "none"
    facts = weights.to_json()
    metrics = facts["metrics"] if isinstance(facts["metrics"], dict) else {}
    named = ", ".join(f"{key} {value:.3g}" for key, value in metrics.items() if isinstance(value, (int, float)))
    appearance = "appearance not recorded"
    if weights.stale is not None:
        changed = f"trained on another appearance ({', '.join(weights.stale)} changed)"
        appearance = changed if weights.stale else "appearance is current"
    return f"{facts['size_mb']:.1f} MB; {named or 'no metrics'}; {appearance}"
