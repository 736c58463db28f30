"""`gear gap`: measures how far composed patches (pasted into pictures) differ from rendered patches, in pixels and
in metrics.
"""

from __future__ import annotations

import argparse

from gear.cli.device import add_device
from gear.cli.settings import add_settings

EXAMPLE = """examples:
  gear gap data/train --twin data/train-patched
  gear gap data/train --patch patches/ --out gap/
  gear gap data/mine --patch patches/ --town mjcf/mytown.xml --scenes configs/scenes/mytown.yaml --out gap/
  gear gap data/test --twin data/test-patched --model ddrnet23_slim --json
  gear gap data/test --twin data/test-patched --model ddrnet23_slim --defense jpeg --defense-set quality=50

The dataset must have been collected with --probes. With --patch the twin is rendered into OUT/twin first.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear gap` to its argument parser."""
    from gear.cli.commands.evaluate import add_calibration
    from gear.cli.flag_types import positive

    parser.epilog = EXAMPLE
    parser.add_argument("dataset", help="root of a dataset with probes")
    parser.add_argument("--twin", metavar="DIR", help="the rendered twin of the dataset, with patches")
    parser.add_argument("--patch", help="a patch folder or picture, or random; the twin is rendered with it")
    add_places(parser)
    parser.add_argument("--split", help="split to compare, if the dataset has several")
    parser.add_argument(
        "--model", metavar="NAME", help="also compare the effect of composed and rendered patches on this model"
    )
    add_settings(parser, "--set", "--model-set", dest="model_settings", help="an option of the model")
    parser.add_argument("--defense", metavar="NAME", help="defense plugin that guards the model")
    add_settings(parser, "--defense-set", dest="defense_settings", help="an option of the defense")
    add_calibration(parser)
    parser.add_argument("--compositor", action="append", dest="compositors", help="transport, homography (both)")
    parser.add_argument("--samples", type=positive, metavar="N", help="the first N samples only")
    parser.add_argument("--out", metavar="DIR", help="folder for gap.json and gap.txt")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="seed of the defense's random draws (0)")
    add_device(parser, "model_settings")
    parser.add_argument("--json", action="store_true", help="print the report as JSON")


def add_places(parser: argparse.ArgumentParser) -> None:
    """Adds to `parser` the flags `--town` and `--scenes`: the MJCF file and the scene library of a town that is not
    part of gear.
    """
    parser.add_argument(
        "--town",
        metavar="FILE",
        help="MJCF file of the dataset's town, if it is not one of gear's; the twin is rendered in it",
    )
    parser.add_argument("--scenes", metavar="FILE", help="scene library of that town")


def run(args: argparse.Namespace) -> int:
    """Compares composed patches with rendered patches, prints the table and returns exit code 0.

    Args:
        args: arguments of the command line, as the parser of this command returns them.
    """
    from gear.cli.requests import guard_of, request_of
    from gear.dataset.json_text import dump_json
    from gear.measuring.gap.request import GapRequest
    from gear.measuring.gap.run import measure_gap
    from gear.reporting.display import Display

    with Display("gap") as display:
        report = measure_gap(request_of(GapRequest, args, guard=guard_of(args)), display.callbacks)
    print(dump_json(report.as_json()).decode().rstrip() if args.json else report.table())
    return 0
