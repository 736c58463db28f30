"""`gear doctor`: checks which renderers work on this machine."""

from __future__ import annotations

import argparse
import json

EXAMPLE = """examples:
  gear doctor
  gear doctor --renderer filament --json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear doctor` to its argument parser."""
    parser.epilog = EXAMPLE
    parser.add_argument("--renderer", help="check only this renderer: raster, filament or classic")
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Checks the renderers and prints a report.

    Args:
        args: arguments of the command line: `renderer` and `json`.

    Returns:
        0 if at least one of the checked renderers works, otherwise 2; with `--renderer` only that renderer is checked.
    """
    from gear.verbs.doctor import doctor

    report = doctor(args.renderer)
    print(json.dumps(report.as_json(), indent=1) if args.json else report.summary())
    return 0 if report.works else 2
