"""Collects the data on which the reference weights are trained and measured, and makes patches against them:

    python -m authoring.weights training --task semseg --out data            # into data/training/semseg/…
    python -m authoring.weights held-out --task semseg --out data            # into data/held-out/semseg/…
    python -m authoring.weights training --task depth --samples 400 --list   # prints the commands only

Each collection is one `gear collect`, so an interrupted command continues when it is run again. The next steps are:

    gear train --task semseg --model ddrnet23_slim --data data/training/semseg --out runs/semseg
    gear evaluate … --data data/held-out/semseg --report reference
    python -m authoring.weights ship runs/semseg --evaluation evaluations/semseg/ddrnet23_slim
    python -m authoring.weights renew ddrnet23_slim --evaluation evaluations/semseg/ddrnet23_slim --note "…"
    python -m authoring.weights patches --task semseg --model ddrnet23_slim --out runs/patches
    python -m authoring.weights lock                                         # after the version is raised
"""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from authoring.weights import lock, renew, ship
from authoring.weights.patches import command as patches
from authoring.weights.plan import (
    FIRST_HELD_OUT_SEED,
    HELD_OUT_SAMPLES,
    TRAINING_OPTIONS,
    Collection,
    held_out,
    training,
)
from gear.cli.closed_output import discard_output
from gear.values.errors import GearError

TRAINING_SAMPLES = 1000


def main() -> int:
    """Runs the chosen part of the command; returns the exit code, which is 2 for an error that the user can correct."""
    parser = argparse.ArgumentParser(
        prog="python -m authoring.weights", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parts = parser.add_subparsers(dest="part", required=True, metavar="PART")
    for part in ("training", "held-out"):
        collections = parts.add_parser(part, help=f"collects the {part} data")
        collections.add_argument("--task", required=True, choices=tuple(TRAINING_OPTIONS))
        collections.add_argument(
            "--out", type=Path, default=Path("data"), help="root folder; the data goes to <part>/<task>/ in it (data)"
        )
        collections.add_argument(
            "--samples",
            type=int,
            help=f"approximate total ({TRAINING_SAMPLES} for training, {HELD_OUT_SAMPLES} for held-out data)",
        )
        if part == "held-out":
            collections.add_argument(
                "--first-seed",
                type=int,
                default=FIRST_HELD_OUT_SEED,
                help=f"seed of the first collection ({FIRST_HELD_OUT_SEED}); another seed gives new pictures",
            )
        collections.add_argument(
            "--set", metavar="KEY=VALUE", action="append", default=[], dest="settings",
            help="a setting of all collections, such as crowd=2; repeatable",
        )  # fmt: skip
        collections.add_argument("--jobs", type=int, default=2, help="collections that run at the same time (2)")
        collections.add_argument("--list", action="store_true", help="print the commands and do nothing")
        collections.set_defaults(run=run)
    made = parts.add_parser("patches", help="makes a network's patches, scene by scene, and measures them")
    patches.add_arguments(made)
    made.set_defaults(run=patches.run)
    shipped = parts.add_parser("ship", help="copies trained weights with their metrics into the weights package")
    ship.add_arguments(shipped)
    shipped.set_defaults(run=ship.run)
    renewed = parts.add_parser("renew", help="measures shipped weights again on the current towns")
    renew.add_arguments(renewed)
    renewed.set_defaults(run=renew.run)
    locked = parts.add_parser("lock", help="writes the checksums of the shipped weights for a new version")
    lock.add_arguments(locked)
    locked.set_defaults(run=lock.run)
    args = parser.parse_args()
    try:
        code = int(args.run(args))
        sys.stdout.flush()  # an error while Python exits could not be caught
    except BrokenPipeError:
        discard_output()
        return 0
    except GearError as error:
        print(f"authoring.weights: {error}", file=sys.stderr)
        return 2
    return code


def run(args: argparse.Namespace) -> int:
    """Runs the collections, several at the same time; returns 1 if one failed, otherwise 0."""
    if args.part == "training":
        plan = training(args.task, args.samples or TRAINING_SAMPLES)
    else:
        plan = held_out(args.task, args.samples or HELD_OUT_SAMPLES, first_seed=args.first_seed)
    plan = [replace(one, settings=(*one.settings, *args.settings)) for one in plan]
    root: Path = args.out / args.part / args.task
    if args.list:
        for collection in plan:
            print(shlex.join(["gear", "collect", *collection.arguments(), "--out", str(root / collection.name)]))
        return 0
    total, begin = sum(collection.samples for collection in plan), time.monotonic()
    print(f"{total} samples in {len(plan)} collections into {root}", file=sys.stderr)
    finished = 0
    failed = []
    with ThreadPoolExecutor(args.jobs) as pool:
        for collection, problem in zip(plan, pool.map(lambda one: collect(one, root), plan), strict=True):
            finished += collection.samples
            minutes = (time.monotonic() - begin) / 60
            print(f"{finished:>5}/{total}  {minutes:5.1f} min  {collection.name} {problem}", file=sys.stderr)
            failed += [collection.name] if problem else []
    return 1 if failed else 0


def collect(collection: Collection, root: Path) -> str:
    """Runs one collection in a separate process; returns its error message, "" without an error."""
    command = [sys.executable, "-m", "gear.cli.main", "collect", *collection.arguments()]
    done = subprocess.run([*command, "--out", str(root / collection.name)], capture_output=True, text=True, check=False)
    return "" if done.returncode == 0 else done.stderr.strip().splitlines()[-1]


if __name__ == "__main__":
    sys.exit(main())
