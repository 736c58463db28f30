"""`gear sheet`: draws samples of a dataset, with their ground truth, as one PNG picture."""

from __future__ import annotations

import argparse

from gear.cli.flag_types import positive

EXAMPLE = """examples:
  gear sheet data/stereo3d/town10-billboard01-ClearNoon/none
  gear sheet data/twin --split test --samples 4 --out twin.png
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear sheet` to its argument parser."""
    parser.epilog = EXAMPLE
    parser.add_argument("dataset", help="root of a dataset")
    parser.add_argument("--split", help="split to draw, if the dataset has several")
    parser.add_argument("--samples", type=positive, default=12, metavar="N", help="rows of the sheet (12)")
    parser.add_argument("--out", default="sheet.png", metavar="FILE", help="PNG to write (sheet.png)")


def run(args: argparse.Namespace) -> int:
    """Writes the contact sheet, prints its path and returns exit code 0.

    Args:
        args: arguments of the command line: `dataset`, `out`, `split` and `samples`.
    """
    from gear.reporting.display import Display
    from gear.verbs.sheet import sheet

    with Display("sheet") as display:
        on_progress = display.callbacks.on_progress
        path = sheet(args.dataset, args.out, split=args.split, samples=args.samples, on_progress=on_progress)
    print(path)
    return 0
