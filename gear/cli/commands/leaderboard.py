"""`gear leaderboard`: checks records of benchmark results, and builds the pages of a leaderboard."""

from __future__ import annotations

import argparse
import json

from gear.cli.flag_types import positive
from gear.cli.settings import add_settings

EXAMPLE = """examples:
  gear bench paper --out bench/paper --record                        write records into bench/paper/records
  gear leaderboard check bench/paper/records/semseg-net+zmask-seed0.json
  gear leaderboard check entry.json --seed 481 --out checks          also write the verdict, for `build`
  gear leaderboard build records --checks checks --out site
  gear leaderboard commit withheld.json                              the salted hash of withheld scenes

A check makes some samples of the record again, measures them and compares; nothing in a record is run, and its plugins
must be installed. Exit codes of `check`: 0 reproduced, 1 differs or incomplete, 2 the record is refused.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the actions and flags of `gear leaderboard` to its argument parser."""
    parser.epilog = EXAMPLE
    actions = parser.add_subparsers(title="actions", metavar="ACTION", dest="action", required=True)
    checking = actions.add_parser("check", help="measure a part of a record again, and compare")
    checking.add_argument("record", metavar="RECORD", help="file of the record")
    checking.add_argument("--patches", metavar="DIR", help="folder of the patches (patches beside the record)")
    checking.add_argument("--work", metavar="DIR", help="folder for data (a temporary folder)")
    checking.add_argument("--out", metavar="DIR", help="folder that gets the verdict")
    checking.add_argument(
        "--samples",
        type=positive,
        default=4,
        metavar="N",
        help="samples to measure again, per kind of patch (4)",
    )
    checking.add_argument(
        "--fresh", type=int, default=8, metavar="N", help="samples outside of the benchmark, per kind of patch (8)"
    )
    checking.add_argument("--drives", type=positive, default=2, metavar="N", help="drives to make again (2)")
    checking.add_argument("--seed", type=int, metavar="N", help="seed of the choice of samples (random)")
    add_settings(
        checking, "--set", help="replaces a key of the record's config, such as the file of a town; repeatable"
    )
    checking.add_argument("--withheld", metavar="FILE", help="file with the seed and places that were withheld")
    checking.add_argument("--commitment", metavar="HASH", help="the published salted hash of that file")
    checking.add_argument(
        "--most-pictures", type=positive, default=2000, metavar="N", help="refuse a check with more pictures (2000)"
    )
    checking.add_argument("--device", choices=("auto", "cpu", "cuda"), help="device of the networks")
    checking.add_argument("--json", action="store_true", help="print the verdict as JSON")
    building = actions.add_parser("build", help="make static pages of a folder of records")
    building.add_argument("records", metavar="DIR", help="folder of the records")
    building.add_argument("--out", required=True, metavar="SITE", help="folder of the pages")
    building.add_argument("--checks", metavar="DIR", help="folder of the verdicts that `check --out` wrote")
    building.add_argument("--commitment", metavar="HASH", help="salted hash of withheld scenes, which is published")
    building.add_argument("--json", action="store_true", help="print board.json")
    committing = actions.add_parser("commit", help="print the salted hash of a file with withheld scenes")
    committing.add_argument("file", metavar="FILE", help='JSON with "salt", "seed" and "places"')


def run(args: argparse.Namespace) -> int:
    """Runs the chosen action (check, build or commit) and returns its exit code.

    Args:
        args: arguments of the command line; `action` is the chosen action.
    """
    return {"check": check, "build": build, "commit": commit}[args.action](args)


def check(args: argparse.Namespace) -> int:
    """`gear leaderboard check`: prints one line per finding; returns 0 if the record is reproduced, otherwise 1.

    Args:
        args: arguments of the command line. Without `seed` a random one is used, without `work` a temporary folder.
    """
    import secrets
    import tempfile
    from pathlib import Path

    from gear.cli.requests import request_of
    from gear.leaderboard.reading import read_record
    from gear.reporting.display import Display
    from gear.verbs.leaderboard.check import run_check, summary
    from gear.verbs.leaderboard.request import CheckRequest

    seed = secrets.randbelow(1 << 31) if args.seed is None else args.seed
    filed = read_record(Path(args.record))
    with tempfile.TemporaryDirectory(prefix="gear-check-") as folder, Display("leaderboard check") as display:
        request = request_of(CheckRequest, args, seed=seed, work=args.work or folder)
        verdict = run_check(request, display.callbacks)
    print(json.dumps(verdict.as_json(), indent=1) + "\n" if args.json else summary(filed, verdict), end="")
    return 0 if verdict.state == "reproduced" else 1


def build(args: argparse.Namespace) -> int:
    """`gear leaderboard build`: writes the pages, prints counts and refused files, and returns exit code 0.

    Args:
        args: arguments of the command line: `records`, `out`, `checks`, `commitment` and `json`.
    """
    from gear.verbs.leaderboard.build import build_leaderboard

    report = build_leaderboard(args.records, out=args.out, checks=args.checks, commitment=args.commitment)
    print(json.dumps(report.as_json(), indent=1) + "\n" if args.json else report.summary(), end="")
    return 0


def commit(args: argparse.Namespace) -> int:
    """`gear leaderboard commit`: prints the salted hash of a file with withheld scenes and returns exit code 0.

    Args:
        args: arguments of the command line; `file` is the file.
    """
    from pathlib import Path

    from gear.verbs.leaderboard.withheld import read_withheld

    print(read_withheld(Path(args.file)).commitment)
    return 0
