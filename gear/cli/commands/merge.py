"""`gear merge`: joins folders that `gear collect --shard` filled into one dataset."""

from __future__ import annotations

import argparse

EXAMPLE = """examples:
  gear merge part1 part2 part3 --out data/train
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the command's flags to its parser."""
    parser.epilog = EXAMPLE
    parser.add_argument("datasets", nargs="+", metavar="DIR", help="folder that `gear collect --shard I/N` has filled")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder of the dataset; must be empty or new")


def run(args: argparse.Namespace) -> int:
    """Merges the folders, prints the dataset's folder and returns exit code 0."""
    from gear.reporting.display import Display
    from gear.verbs.merge import merge

    with Display("merge") as display:
        report = merge(args.datasets, out=args.out, on_progress=display.callbacks.on_progress)
    print(report.summary())
    return 0
