"""`gear evaluate`: measures a model, with or without a defense, on datasets."""

from __future__ import annotations

import argparse

from gear.cli.device import add_device
from gear.cli.engine import add_engine, add_engine_workers
from gear.cli.flag_types import not_negative, positive
from gear.cli.settings import add_settings
from gear.cli.streams import folded, line_width

EXAMPLE = """examples:
  gear evaluate --model ddrnet23_slim --data data/clean
  gear evaluate --model ddrnet23_slim --data data/none data/random data/patch --report outside_patch
  gear evaluate --model ddrnet23_slim --set weights=net.safetensors --defense jpeg --data data/clean
  gear evaluate --model ddrnet23_slim --defense zmask --calibration data/val --calibration-patched data/val-patched \
    --data data/none data/patch

The folder --out gets predictions, results.json, table.txt, and report.html with pictures. Run the same command again to
continue after an interruption.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear evaluate` to its argument parser."""
    parser.epilog = EXAMPLE
    parser.add_argument("--model", required=True, metavar="NAME", help="model plugin; gear plugins --kind model")
    parser.add_argument(
        "--data",
        required=True,
        nargs="+",
        action="extend",
        metavar="DIR",
        help="datasets of the model's task, also twins; DIR:SPLIT, or a folder of datasets",
    )
    parser.add_argument("--split", help="split to evaluate, if the datasets have several")
    parser.add_argument("--defense", metavar="NAME", help="defense plugin; gear plugins --kind defense")
    add_settings(parser, "--set", "--model-set", dest="model_settings", help="an option of the model; repeatable")
    add_settings(parser, "--defense-set", dest="defense_settings", help="an option of the defense; repeatable")
    add_calibration(parser)
    parser.add_argument(
        "--report",
        metavar="NAME",
        action="append",
        default=[],
        dest="reports",
        help="further metrics: reference (by which shipped networks are judged), outside_patch, or a metric plugin"
        " (gear plugins --kind metric) as NAME or NAME:KEY=VALUE,...; repeatable",
    )
    parser.add_argument("--out", metavar="DIR", help="folder for the results (evaluations/<task>/<model>[+<defense>])")
    parser.add_argument(
        "--batch", type=positive, metavar="N", help="samples per forward pass (1 to 4, by picture size)"
    )
    parser.add_argument(
        "--workers", type=positive, default=2, metavar="N", help="number of threads that read and measure (2)"
    )
    add_engine(parser, "with workers")
    add_engine_workers(parser, "datasets that are evaluated")
    parser.add_argument(
        "--seed",
        type=int,
        default=0,
        metavar="N",
        help="seed of the defense's random draws and of the permutation tests (0)",
    )
    parser.add_argument(
        "--pictures",
        type=not_negative,
        default=4,
        metavar="N",
        help="samples on the sheet of what changed most in each dataset, linked from report.html; 0 for none (4)",
    )
    add_device(parser, "model_settings")
    parser.add_argument("--json", action="store_true", help="print results.json instead of the table")


def add_calibration(parser: argparse.ArgumentParser) -> None:
    """Adds to `parser` the flags `--calibration` and `--calibration-patched`, which name the datasets on which a
    defense is calibrated.
    """
    parser.add_argument("--calibration", metavar="DIR", help="clean dataset on which the defense is calibrated")
    parser.add_argument("--calibration-patched", metavar="DIR", help="twin of the calibration dataset, with patches")


def run(args: argparse.Namespace) -> int:
    """Evaluates the model on the datasets, prints the table of results and returns exit code 0.

    Args:
        args: arguments of the command line, as the parser of this command returns them.
    """
    import json

    from gear.cli.requests import guard_of, request_of
    from gear.reporting.display import Display
    from gear.verbs.evaluate.request import EvaluateRequest
    from gear.verbs.evaluate.run import run_evaluate
    from gear.verbs.evaluate.table import table

    with Display("evaluate") as display:
        report = run_evaluate(request_of(EvaluateRequest, args, guard=guard_of(args)), display.callbacks)
    print(
        json.dumps(report.as_json(), indent=1, allow_nan=False) + "\n"
        if args.json
        else folded(table(report, width=line_width())),
        end="",
    )
    return 0
