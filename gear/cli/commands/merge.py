"""`gear merge`: joins the folders of several `gear collect --shard` runs into one dataset."""

from __future__ import annotations

import argparse

EXAMPLE = """examples:
  gear merge part1 part2 part3 --out data/train
  gear merge part1 part2 --out s3://bucket/train
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear merge` to its argument parser."""
    parser.epilog = EXAMPLE
    parser.add_argument("datasets", nargs="+", metavar="DIR", help="folder that `gear collect --shard I/N` has filled")
    parser.add_argument(
        "--out",
        required=True,
        metavar="DIR",
        help="folder of the dataset, or an address such as s3://bucket/folder; must be empty or new",
    )


def run(args: argparse.Namespace) -> int:
    """Joins the folders, prints the path of the new dataset and returns exit code 0.

    Args:
        args: arguments of the command line: `datasets` and `out`.
    """
    from gear.verbs.merge import merge

    report = merge(args.datasets, out=args.out, progress=True)
    print(report.summary())
    return 0
