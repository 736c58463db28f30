"""`gear attack`."""

from __future__ import annotations

import argparse
import sys

from gear.cli.device import add_device

EXAMPLE = """examples:
  gear collect --task semseg --scene billboard01 --split train --probes --out data/b01
  gear attack --model ddrnet23_slim --data data/b01 --out patches/b01
  gear attack --model ddrnet23_slim --data data/b01 --set target=sky --set attacked=road --out patches/road_to_sky
  gear attack --model ddrnet23_slim_depth --attack carla_gear --steps 5100 --data data/depth --out patches/paper
  gear attack --model ddrnet23_slim --attack square --queries 5000 --data data/b01 --out patches/black-box
  gear attack --model ddrnet23_slim --data data/b01 --data data/b02 --data data/b01-sunset --out patches/universal
  gear attack --model ddrnet23_slim --data data/b01 --out patches/b01 --verify data/b01-val
  gear collect --task semseg --scene billboard01 --split test --patch patches/b01 --out data/b01-patched

The folder holds patch_0.png, …, patch.safetensors, attack.json and figures/.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the command's flags to its parser."""
    from gear.cli.commands.evaluate import add_calibration
    from gear.cli.commands.gap import add_places

    parser.epilog = EXAMPLE
    parser.add_argument("--model", required=True, action="append", metavar="NAME", help="model plugin; repeatable")
    parser.add_argument(
        "--data", required=True, action="append", metavar="DIR", help="dataset with probes, or DIR:SPLIT; repeatable"
    )
    parser.add_argument("--out", required=True, metavar="DIR", help="the patch folder")
    parser.add_argument("--attack", default="scene_specific", metavar="NAME", help="attack plugin (scene_specific)")
    parser.add_argument("--steps", type=int, metavar="N", help="most optimisation steps (300; with --queries no limit)")
    parser.add_argument(
        "--queries", type=int, metavar="N", help="most forward passes of the model, for attacks without gradients"
    )
    parser.add_argument(
        "--set", metavar="KEY=VALUE", action="append", default=[], dest="settings", help="an option of the attack"
    )
    parser.add_argument("--model-set", metavar="KEY=VALUE", action="append", default=[], help="an option of the models")
    add_device(parser, "model_set")
    parser.add_argument(
        "--defense", metavar="NAME", help="defense that guards the models; the attack is adaptive to it"
    )
    parser.add_argument(
        "--defense-set", metavar="KEY=VALUE", action="append", default=[], help="an option of the defense"
    )
    add_calibration(parser)
    parser.add_argument(
        "--val",
        action="append",
        default=[],
        metavar="DIR",
        help="dataset on which patches are validated; the best patches are kept",
    )
    parser.add_argument("--every", type=int, default=25, metavar="N", help="steps between two validations (25)")
    parser.add_argument(
        "--patience",
        type=int,
        default=0,
        metavar="N",
        help="validations without improvement until the attack stops early (0: never)",
    )
    parser.add_argument(
        "--verify", metavar="DIR", help="dataset with probes on which the patches are rendered and compared afterwards"
    )
    add_places(parser)
    parser.add_argument("--compositor", default="transport", metavar="NAME", help="transport, or homography")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="seed of all random draws (0)")
    parser.add_argument("--allow-test-data", action="store_true", help="optimise on test splits too")
    parser.add_argument("--force", action="store_true", help="replace what another attack left in --out")
    parser.add_argument(
        "--json", action="store_true", help="print attack.json; with --verify, both as attack and verify"
    )


def run(args: argparse.Namespace) -> int:
    """Runs the attack and prints where the patches are."""
    import json

    from gear.cli.progress import ProgressBar
    from gear.values.errors import GearError
    from gear.verbs.attack.run import attack
    from gear.verbs.attack.verify import check_held_out, verify

    if args.verify is not None:
        check_held_out(args.data, args.verify, args.val)
    elif args.town is not None or args.scenes is not None:
        raise GearError(
            "--town and --scenes are of the dataset that --verify names; add --verify DIR, or leave them out"
        )
    unit = "step" if args.queries is None else "query"
    with ProgressBar(unit="picture") as learning, ProgressBar(unit=unit) as progress:
        report = attack(
            args.data,
            model=args.model,
            out=args.out,
            attack=args.attack,
            steps=args.steps,
            queries=args.queries,
            settings=args.settings,
            model_settings=args.model_set,
            defense=args.defense,
            defense_settings=args.defense_set,
            calibration=args.calibration,
            calibration_patched=args.calibration_patched,
            val=args.val,
            every=args.every,
            patience=args.patience,
            compositor=args.compositor,
            seed=args.seed,
            allow_test_data=args.allow_test_data,
            force=args.force,
            on_progress=progress,
            on_fit_progress=learning,
            on_warning=lambda text: print(f"gear: note: {text}", file=sys.stderr),
        )
    if args.verify is None or not args.json:
        print(json.dumps(report.facts, indent=2) if args.json else report.summary())
    if args.verify is not None:
        with ProgressBar(unit="picture") as learning, ProgressBar() as progress:
            reports = verify(
                args.out,
                args.verify,
                models=args.model,
                model_settings=args.model_set,
                defense=args.defense,
                defense_settings=args.defense_set,
                calibration=args.calibration,
                calibration_patched=args.calibration_patched,
                town=args.town,
                scenes=args.scenes,
                on_progress=progress,
                on_fit_progress=learning,
            )
        if args.json:
            verified = {name: found.as_json() for name, found in reports.items()}
            print(json.dumps({"attack": report.facts, "verify": verified}, indent=2))
        else:
            for found in reports.values():
                print(found.table())
    return 0
