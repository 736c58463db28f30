"""`gear models`."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gear.verbs.models import ModelFacts, ShippedWeights

EXAMPLE = """examples:
  gear models
  gear models --task semseg
  gear models --json

Nothing is downloaded: fetch published weights yourself, then `gear weights convert MODEL IN OUT`.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the command's flags."""
    parser.epilog = EXAMPLE
    parser.add_argument("--task", help="only networks that do this task")
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Lists the installed networks."""
    from gear.networks.shipped import shipped_networks
    from gear.verbs.models import list_models

    models = list_models(args.task)
    if args.json:
        print(json.dumps({"models": [model.to_json() for model in models]}, indent=1))
        return 0
    for model in models:
        show(model)
    if not models:
        print(f"no installed model does {args.task}")
    if not shipped_networks():
        print("no weights are installed; mujoco-gear-weights has those of one network for every task of gear's")
    return 0


def show(model: ModelFacts) -> None:
    """Prints one."""
    spec = model.spec
    size = f"{spec.parameters / 1e6:.1f} M parameters" if spec.parameters else "size not stated"
    print(f"{spec.name:20} {', '.join(spec.tasks):20} {size}  {spec.summary}")
    if model.missing:
        print(f"{'':20} not usable: needs {', '.join(model.missing)} (pip install 'mujoco-gear[models]')")
    if spec.normalisation:
        print(f"{'':20} input: {spec.normalisation}")
    for weights in spec.published:
        print(f"{'':20} published: {weights.data}; {weights.size_mb:g} MB; {weights.licence}; {weights.source}")
    print(f"{'':20} shipped: {shipped_line(model.shipped)}")


def shipped_line(weights: ShippedWeights | None) -> str:
    """The reference weights in one line."""
    if weights is None:
        return "none"
    facts = weights.to_json()
    metrics = facts["metrics"] if isinstance(facts["metrics"], dict) else {}
    named = ", ".join(f"{key} {value:.3g}" for key, value in metrics.items() if isinstance(value, (int, float)))
    look = "look not stated"
    if weights.stale is not None:
        look = f"trained on another look ({', '.join(weights.stale)} changed)" if weights.stale else "look is current"
    return f"{facts['size_mb']:.1f} MB; {named or 'no metrics'}; {look}"
