"""`gear defend`: applies a defense to the pictures of a dataset and writes the cleaned pictures."""

from __future__ import annotations

import argparse

from gear.cli.settings import add_settings

EXAMPLE = """examples:
  gear defend data/semseg/town10-billboard01-ClearNoon/random --defense lgs --out cleaned/
  gear defend data/twin --defense jpeg --set quality=30 --out cleaned/

The cleaned pictures have the dataset's own relative paths; masks and scores lie under defense/<split>/.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear defend` to its argument parser."""
    parser.epilog = EXAMPLE
    parser.add_argument("dataset", help="root of a dataset of any task")
    parser.add_argument("--defense", required=True, metavar="NAME", help="defense plugin; gear plugins --kind defense")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for the cleaned pictures")
    parser.add_argument("--split", help="split to clean, if the dataset has several")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="seed of the defense's random draws (0)")
    add_settings(parser, "--set", help="an option of the defense; repeatable")


def run(args: argparse.Namespace) -> int:
    """Applies the defense to the pictures, prints the output folder and returns exit code 0.

    Args:
        args: arguments of the command line, as the parser of this command returns them.
    """
    from gear.cli.requests import request_of
    from gear.reporting.display import Display
    from gear.verbs.defend.request import DefendRequest
    from gear.verbs.defend.run import run_defend

    with Display("defend") as display:
        report = run_defend(request_of(DefendRequest, args), display.callbacks)
    print(report.summary())
    return 0
