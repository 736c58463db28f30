"""`gear verify`: compares every file of a dataset with its recorded hash; with `--repair` damaged samples are
rendered again.
"""

from __future__ import annotations

import argparse

from gear.cli.flag_types import positive

EXAMPLE = """examples:
  gear verify data/semseg/town10-billboard01-ClearNoon/none
  gear verify data/twin --repair
  gear verify data/twin --json > report.json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear verify` to its argument parser."""
    parser.epilog = EXAMPLE
    parser.add_argument("dataset", help="root of a dataset, or folder of an export")
    parser.add_argument("--split", help="split to check (all)")
    parser.add_argument("--repair", action="store_true", help="make damaged and missing samples again")
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    parser.add_argument("--patch", help="patch that the dataset shows, if the dataset's copy of it is damaged")
    parser.add_argument("--town", metavar="FILE", help="MJCF file of the dataset's town, if it is not one of gear's")
    parser.add_argument("--scenes", metavar="FILE", help="scene library of that town")
    parser.add_argument("--simulation", metavar="FILE", help="simulation config, if it is not one of gear's")
    parser.add_argument(
        "--workers", type=positive, default=1, metavar="N", help="number of processes that make samples again (1)"
    )


def run(args: argparse.Namespace) -> int:
    """Checks the files of a dataset, and prints one line for each damaged, missing or unexpected file. With `--repair`,
    samples are made again.

    Args:
        args: arguments of the command line, as the parser of this command returns them.

    Returns:
        0 if every file has its recorded content and no file is missing or unexpected; otherwise 1.
    """
    import json

    from gear.verbs.verify.run import verify

    report = verify(
        args.dataset,
        split=args.split,
        repair=args.repair,
        patch=args.patch,
        town=args.town,
        scenes=args.scenes,
        simulation=args.simulation,
        workers=args.workers,
        progress=True,
    )
    print(json.dumps(report.as_json(), indent=1) if args.json else "\n".join(report.lines()))
    return 0 if report.is_whole else 1
