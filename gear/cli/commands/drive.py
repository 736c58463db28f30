"""`gear drive`: drives cars in the closed loop, with and without patches, and writes a report."""

from __future__ import annotations

import argparse

from gear.cli.engine import add_engine
from gear.cli.flag_types import workers
from gear.cli.settings import add_settings

EXAMPLE = """examples:
  gear drive quick --out drive/quick --workers auto       three scenarios, three twins, one network
  gear drive study --out drive/study --list               only prints the drives of the study
  gear drive my.yml --out drive/mine --set repeats=5 --set 'scenarios={stopped_lead: [40, 60]}'
  gear drive my.yml --out drive/mine --engine slurm --address gpu --workers 32

The folder --out gets report.html, table.txt, drives.csv, drive.json and a log of each drive. Run the same command again
to continue after an interruption, or after adding drivers, scenarios or seeds: existing drives are kept.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear drive` to its argument parser."""
    parser.epilog = EXAMPLE
    parser.add_argument("config", metavar="CONFIG", help="name (quick, study) or path of a drive config")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for logs, results and the report")
    add_settings(parser, "--set", help="sets a key of the config; repeatable")
    parser.add_argument(
        "--device", choices=("auto", "cpu", "cuda"), help="device of the networks (the one in the config)"
    )
    add_engine(parser, "that makes the drives")
    parser.add_argument(
        "--workers", type=workers, default=1, metavar="N", help="number of drives at the same time, or auto (1)"
    )
    parser.add_argument("--list", action="store_true", help="only print the drives of the study")
    parser.add_argument("--json", action="store_true", help="print drive.json, or the drives, in place of the tables")


def run(args: argparse.Namespace) -> int:
    """Drives and prints the tables, or with `--list` only prints the drives; returns exit code 0.

    Args:
        args: arguments of the command line, as the parser of this command returns them.
    """
    import json

    from gear.cli.requests import request_of
    from gear.cli.streams import folded
    from gear.reporting.display import Display
    from gear.values.serial import to_json
    from gear.verbs.drive.request import DriveRequest
    from gear.verbs.drive.run import prepared, run_drive
    from gear.verbs.drive.table import text

    request = request_of(DriveRequest, args)
    if args.list:
        runs = prepared(request).runs
        listed = json.dumps([to_json(one) for one in runs], indent=1)
        print(listed if args.json else "\n".join(one.title for one in runs))
        return 0
    with Display("drive", unit="drive") as display:
        report = run_drive(request, display.callbacks)
    print(json.dumps(report.as_json(), indent=1, allow_nan=False) + "\n" if args.json else folded(text(report)), end="")
    return 0
