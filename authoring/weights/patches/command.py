"""The command `python -m authoring.weights patches`."""

from __future__ import annotations

import argparse
import shlex
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from authoring.weights.patches.install import install
from authoring.weights.patches.plan import PRECISION, SAMPLES, STEPS, STEPS_OF, PatchPlan, plans
from authoring.weights.patches.run import Gear, OnStep, gear_process, make_patch, measure_again
from authoring.weights.patches.summary import table
from authoring.weights.plan import TOWNS, TRAINING_OPTIONS
from gear.dataset.files import write_alone
from gear.dataset.json_text import dump_json
from gear.networks.options import SHIPPED
from gear.values.errors import GearError
from gear.values.serial import Json


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    others = "".join(f"; {task} {steps}" for task, steps in STEPS_OF.items())
    parser.add_argument("--task", required=True, choices=tuple(TRAINING_OPTIONS))
    parser.add_argument("--model", required=True, metavar="NAME", help="model plugin")
    parser.add_argument("--out", type=Path, required=True, help="folder; a scene's files go to <model>/<town>-<scene>/")
    parser.add_argument("--town", nargs="+", default=list(TOWNS), metavar="NAME", help=f"({' '.join(TOWNS)})")
    parser.add_argument("--scenes", nargs="+", default=[], metavar="NAME", help="scenes (all with a surface)")
    parser.add_argument(
        "--samples", type=int, metavar="N", help=f"samples per scene, to attack and to measure ({SAMPLES['train']})"
    )
    parser.add_argument("--steps", type=int, metavar="N", help=f"steps of each attack ({STEPS}{others})")
    parser.add_argument(
        "--precision",
        choices=("float32", "bfloat16"),
        default=PRECISION,
        help="precision of the network in the attack, but not in the evaluation (float32); bfloat16 is faster on"
        " processors with instructions for it",
    )
    parser.add_argument("--weights", default=SHIPPED, metavar="FILE", help="the network's weights (the shipped ones)")
    parser.add_argument(
        "--set", metavar="KEY=VALUE", action="append", default=[], dest="settings", help="a setting of the collections"
    )
    parser.add_argument(
        "--attack-set", metavar="KEY=VALUE", action="append", default=[], help="an option of the attack"
    )
    parser.add_argument("--jobs", type=int, default=1, metavar="J", help="number of scenes at the same time (1)")
    parser.add_argument("--install", action="store_true", help="copy complete patches to weights/gear_weights/patches")
    parser.add_argument(
        "--again", action="store_true", help="make no patches; measure installed ones against the shipped weights"
    )
    parser.add_argument("--list", action="store_true", help="print the commands and do nothing")


def run(args: argparse.Namespace) -> int:
    """Makes the patches, several scenes at the same time; a scene that fails does not stop the others.

    Raises:
        GearError: a name is unknown, or `--install` is combined with weights or settings that are not the shipped ones.
    """
    if args.install and args.weights != SHIPPED:
        raise GearError("--install is for patches against the shipped weights; leave --weights out")
    if args.install and (args.settings or args.attack_set):
        raise GearError("--install is for patches with the default settings; leave --set and --attack-set out")
    if args.again and (args.install or args.weights != SHIPPED):
        raise GearError(
            "--again measures installed patches against the shipped weights; leave --install and --weights out"
        )
    if args.jobs < 1:
        raise GearError(f"--jobs must be at least 1, got {args.jobs}")
    chosen = plans(
        args.task,
        args.model,
        towns=args.town,
        scenes=args.scenes,
        samples=args.samples,
        steps=args.steps,
        weights=args.weights,
        settings=args.settings,
        attack_settings=args.attack_set,
        precision=args.precision,
    )
    root: Path = args.out / args.model.replace("/", "-")
    if args.list:
        for plan in chosen:
            for step in (plan.commands_again if args.again else plan.commands)(root / plan.place):
                print(shlex.join(["gear", *step.arguments]))
        return 0
    effects, failed = _made(chosen, root, args.jobs, measure_again if args.again else make_patch)
    if args.again:
        print(table([effect | effect["again"] for effect in effects]), end="")
        return 1 if failed else 0
    if effects:
        write_alone(root / "summary.json", dump_json(effects))
        write_alone(root / "summary.txt", table(effects).encode())
    print(table(effects), end="")
    if args.install:
        for effect in effects:
            print(install(root / effect["scene"] / effect["patch"], effect), file=sys.stderr)
    return 1 if failed else 0


def _made(
    chosen: list[PatchPlan], root: Path, jobs: int, work: Callable[[PatchPlan, Path, Gear, OnStep], Json]
) -> tuple[list[Json], int]:
    begin = time.monotonic()

    def say(text: str) -> None:
        print(f"{(time.monotonic() - begin) / 60:6.1f} min  {text}", file=sys.stderr, flush=True)

    def make(plan: PatchPlan) -> Json | None:
        try:
            return work(plan, root / plan.place, gear, lambda step: say(f"{plan.name}: {step}"))
        except GearError as error:
            say(f"{plan.name}: failed: {error}")
            return None

    gear = gear_process(jobs)
    with ThreadPoolExecutor(jobs) as pool:
        effects = list(pool.map(make, chosen))
    return [effect for effect in effects if effect is not None], effects.count(None)
