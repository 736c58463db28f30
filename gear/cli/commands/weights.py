"""`gear weights`: converts a published weights file, averages two weights files, or prints the metadata of a
weights file.
"""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING

from gear.cli.settings import add_settings

if TYPE_CHECKING:
    from gear.verbs.weights.convert import ConvertReport

EXAMPLE = """examples:
  gear weights convert ddrnet23_slim best_val.pth ddrnet.safetensors
  gear weights convert bisenet_x39 cityscapes-bisenet-X39.pth bisenet.safetensors --set auxiliary=false
  gear weights convert ddrnet23_slim last.pt ddrnet.safetensors --entry ema
  gear weights average ddrnet23_slim runs/semseg/model.safetensors mean.safetensors
  gear weights show ddrnet.safetensors
  gear weights show ddrnet23_slim --json           the shipped reference weights of a model

A published file is read without running code in it; files that would run code are refused.
`gear models show NAME` says where the published weights of a network are.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear weights` to its argument parser."""
    parser.epilog = EXAMPLE
    actions = parser.add_subparsers(title="actions", metavar="ACTION", dest="action", required=True)
    converting = actions.add_parser(
        "convert", help="convert a published weights file to safetensors, with all keys checked"
    )
    converting.add_argument("model", metavar="MODEL", help="model plugin; gear models")
    converting.add_argument(
        "source", metavar="IN", help="published weights: .pth, .pt, .pkl, .safetensors, .json (TensorFlow.js)"
    )
    converting.add_argument("out", metavar="OUT", help="the file to write; ends in .safetensors")
    converting.add_argument("--half", action="store_true", help="store matrices in float16, half the size")
    add_settings(converting, "--set", help="an option of the model that changes its graph; repeatable")
    converting.add_argument(
        "--entry", metavar="NAME", default="", help="entry of the checkpoint to use, such as ema (the one that fits)"
    )
    converting.add_argument("--json", action="store_true", help="print JSON")
    averaging = actions.add_parser(
        "average", help="average two states of one network, such as before and after fine-tuning"
    )
    averaging.add_argument(
        "first", metavar="FIRST", help="a safetensors file, or the name of a model, for its shipped weights"
    )
    averaging.add_argument("second", metavar="SECOND", help="the second one, given like the first")
    averaging.add_argument("out", metavar="OUT", help="the file to write; ends in .safetensors")
    averaging.add_argument(
        "--share", type=float, default=0.5, metavar="X", help="share of the second file in the average, 0 to 1 (0.5)"
    )
    averaging.add_argument("--half", action="store_true", help="store matrices in float16, half the size")
    averaging.add_argument("--json", action="store_true", help="print JSON")
    showing = actions.add_parser("show", help="print the metadata of a weights file")
    showing.add_argument(
        "file", metavar="FILE", help="a safetensors file, or the name of a model, for its shipped weights"
    )
    showing.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Runs the chosen action (convert, average or show) and returns exit code 0.

    Args:
        args: arguments of the command line; `action` is the chosen action.
    """
    return {"convert": convert, "average": average, "show": show}[args.action](args)


def convert(args: argparse.Namespace) -> int:
    """`gear weights convert`: writes a published weights file as safetensors, prints its hash and returns exit code 0.

    Args:
        args: arguments of the command line: `model`, `source`, `out`, `settings`, `entry`, `half` and `json`.
    """
    from gear.verbs.weights.convert import convert_weights

    report = convert_weights(
        args.model, args.source, args.out, settings=args.settings, entry=args.entry, halves=args.half
    )
    return _say(report, args)


def average(args: argparse.Namespace) -> int:
    """`gear weights average`: writes the average of two weights files, prints its hash and returns exit code 0.

    Args:
        args: arguments of the command line: `first`, `second`, `out`, `share`, `half` and `json`.
    """
    from gear.verbs.weights.average import average_weights

    return _say(average_weights(args.first, args.second, args.out, share=args.share, halves=args.half), args)


def _say(report: ConvertReport, args: argparse.Namespace) -> int:
    if args.json:
        facts = {"model": report.model, "path": str(report.path), "sha256": report.sha256,
                 "size_mb": round(report.size_mb, 3), "tensors": report.tensors,
                 "entry": report.entry, "others": list(report.others)}  # fmt: skip
        print(json.dumps(facts, indent=1))
    else:
        print(report.summary())
    return 0


def show(args: argparse.Namespace) -> int:
    """`gear weights show`: prints the metadata in a weights file's header and returns exit code 0.

    Args:
        args: arguments of the command line: `file` and `json`.
    """
    from gear.plugins.text import LONGEST_LINE, printable
    from gear.verbs.weights.show import show_weights

    facts = show_weights(args.file).to_json()
    if args.json:
        print(json.dumps(facts, indent=1))
        return 0
    print(f"{facts['path']}: {facts['tensors']} tensors, {facts['numbers']} numbers, {facts['size_mb']:.1f} MB")
    print(f"  sha256: {facts['sha256']}")
    for key, value in sorted(facts["metadata"].items()):
        text = value if isinstance(value, str) else json.dumps(value)
        print(printable(f"  {key}: {text}", LONGEST_LINE))
    return 0
