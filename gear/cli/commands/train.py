"""`gear train`: trains a network on collected datasets."""

from __future__ import annotations

import argparse
import re
from typing import TYPE_CHECKING

from gear.cli.flag_types import positive
from gear.cli.log import add_log
from gear.cli.settings import add_settings

if TYPE_CHECKING:
    from gear.reporting.display import Display
    from gear.verbs.train.checkpoint import TrainingState

EXAMPLE = """examples:
  gear train --task semseg --model ddrnet23_slim --data data/training/semseg --time-budget 10m --out runs/semseg
  gear train --task depth --model glpdepth --data data/a data/b:finetuning --val data/c:val --epochs 25 --out runs/depth
  gear train --task detect2d --model retinanet_lite0_fpn --data data/det --init imagenet --out runs/det
  gear train --task semseg --model ddrnet23_slim --data data/ss --set augmentation.flip=0 --set crop_px='[512, 512]' \\
      --out runs/ss

DIR is a dataset's root, a folder of roots, or DIR:SPLIT. The folder of --out gets model.safetensors (use it with
--set weights=FILE), train.json, card.md, curves.png and samples.jpg (predictions beside ground truth); run the same
command again to continue after an interruption.
"""
SECONDS = {"s": 1, "m": 60, "h": 3600, "": 60}


def budget(text: str) -> float:
    """Parses a duration and returns seconds; a `type` function for argparse.

    Args:
        text: the duration, such as `90s`, `10m` or `1.5h`; a number without a unit means minutes.
    """
    match = re.fullmatch(r"(\d+(?:\.\d*)?)([smh]?)", text.strip())
    if not match or not float(match[1]):
        raise argparse.ArgumentTypeError(f"a time is written 90s, 10m or 1.5h, got {text!r}")
    return float(match[1]) * SECONDS[match[2]]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear train` to its argument parser."""
    parser.epilog = EXAMPLE
    parser.add_argument("--task", required=True, metavar="NAME", help="task plugin; gear plugins --kind task")
    parser.add_argument("--model", required=True, metavar="NAME", help="model plugin; gear plugins --kind model")
    parser.add_argument("--data", required=True, nargs="+", action="extend", metavar="DIR", help="datasets to train on")
    parser.add_argument(
        "--val",
        nargs="+",
        action="extend",
        default=[],
        metavar="DIR",
        help="datasets to validate on (a share of --data)",
    )
    parser.add_argument("--out", required=True, metavar="DIR", help="folder of the results")
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--epochs", type=positive, metavar="N", help="passes over the data (from the network's recipe)")
    length.add_argument(
        "--time-budget", type=budget, metavar="TIME", help="training time instead of epochs: 90s, 10m, 1.5h"
    )
    parser.add_argument("--batch", type=positive, metavar="N", help="samples per step (from the recipe)")
    parser.add_argument("--lr", type=float, metavar="X", help="peak learning rate (from the recipe)")
    parser.add_argument(
        "--seed", type=int, metavar="N", help="seed of the initial weights, the sample order and the augmentation (0)"
    )
    parser.add_argument(
        "--init",
        metavar="FILE|NAME",
        help="initial weights: a file, shipped, imagenet …; trunk:FILE or trunk:MODEL takes what fits of another "
        "network's (random)",
    )
    parser.add_argument(
        "--precision",
        choices=("auto", "float32", "bfloat16"),
        help="precision of training steps: auto is bfloat16 with --time-budget if that is faster, else float32 (auto)",
    )
    parser.add_argument("--device", choices=("auto", "cpu", "cuda"), help="device of the training (auto)")
    parser.add_argument(
        "--workers", type=positive, metavar="N", help="number of reading threads; it does not change the result (2)"
    )
    parser.add_argument(
        "--adversarial",
        metavar="ATTACK",
        help="adversarial patch training: show patches that this attack makes during the training",
    )
    parser.add_argument("--allow-test-data", action="store_true", help="allow test splits in --data")
    add_settings(
        parser, "--set", help="sets a key of the training config; options.KEY for options of the network; repeatable"
    )
    add_log(parser)


def run(args: argparse.Namespace) -> int:
    """Trains the network, prints the result and returns exit code 0.

    Args:
        args: arguments of the command line, as the parser of this command returns them.
    """
    from gear.cli.requests import request_of
    from gear.reporting.display import Display
    from gear.verbs.train.request import TrainRequest
    from gear.verbs.train.run import run_train

    request = request_of(TrainRequest, args, time_budget_s=args.time_budget)
    with Display("train", unit="step") as display:
        report = run_train(request, display.callbacks, TrainingLog(display))
    print(report.summary())
    return 0


class TrainingLog:
    """A callback that shows loss and learning rate in the progress display and prints one line after every
    validation.
    """

    SHOWN = 3
    """Number of validation metrics in the printed line, in addition to the loss."""

    def __init__(self, display: Display) -> None:
        """Connects the callback to the progress display `display` of the command."""
        self._display = display

    def __call__(self, state: TrainingState, share: float, metrics: dict[str, float] | None) -> None:
        """Updates the display after a training step.

        Args:
            state: progress of the training.
            share: finished share of the training, 0..1; not used.
            metrics: result of a validation by name, which is also printed as a line; None after steps without
                validation.
        """
        if state.steps:
            point = state.steps[-1]
            self._display.detail(f"loss {point['loss']:.3f}, lr {point['rate']:.1e}")
        if metrics is not None:
            chosen = [*list(metrics.items())[: self.SHOWN], ("loss", metrics["loss"])]
            text = "  ".join(f"{name} {value:.4f}" for name, value in dict(chosen).items())
            mark = " *" if state.best_step == state.step else ""
            self._display.write(f"step {state.step:>6}  {text}{mark}")
