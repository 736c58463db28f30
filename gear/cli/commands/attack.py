"""`gear attack`: optimises adversarial patches for a scene's surfaces against one or more models."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from gear.cli.device import add_device
from gear.cli.flag_types import not_negative, positive
from gear.cli.log import add_log
from gear.cli.settings import add_settings

if TYPE_CHECKING:
    from gear.values.serial import Json
    from gear.verbs.attack.request import AttackRequest

EXAMPLE = """examples:
  gear collect --task semseg --scene billboard01 --split train --probes --out data/b01
  gear attack --model ddrnet23_slim --data data/b01 --out patches/b01
  gear attack --model ddrnet23_slim --data data/b01 --set target=sky --set source_class=road --out patches/road_to_sky
  gear attack --model ddrnet23_slim_depth --attack carla_gear --steps 5100 --data data/depth --out patches/paper
  gear attack --drive quick --drive-set 'scenarios={stopped_lead: [40]}' --queries 200 --out patches/crash
  gear attack --model ddrnet23_slim --attack square --queries 5000 --data data/b01 --out patches/black-box
  gear attack --model ddrnet23_slim --data data/b01 --data data/b02 --data data/b01-sunset --out patches/universal
  gear attack --model ddrnet23_slim --per-scene --engine-workers 4 --data data/train --out patches
  gear attack --model ddrnet23_slim --data data/b01 --out patches/b01 --verify data/b01-val
  gear collect --task semseg --scene billboard01 --split test --patch patches/b01 --out data/b01-patched

The folder --out gets patch_0.png, …, patch.safetensors, attack.json and figures/.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear attack` to its argument parser."""
    from gear.cli.commands.gap import add_places
    from gear.cli.engine import add_engine, add_engine_workers

    parser.epilog = EXAMPLE
    parser.add_argument("--model", action="append", metavar="NAME", help="model plugin; repeatable")
    parser.add_argument("--data", action="append", metavar="DIR", help="dataset with probes, or DIR:SPLIT; repeatable")
    _add_drive(parser)
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for the patches")
    parser.add_argument("--attack", metavar="NAME", help="attack plugin (scene_specific; with --drive square)")
    parser.add_argument(
        "--steps", type=positive, metavar="N", help="most optimisation steps (300; with --queries no limit)"
    )
    parser.add_argument(
        "--queries",
        type=positive,
        metavar="N",
        help="most forward passes of the model, for attacks without gradients; with --drive most tried patches (100)",
    )
    add_settings(parser, "--set", help="an option of the attack")
    add_settings(parser, "--model-set", dest="model_settings", help="an option of the models")
    add_device(parser, "model_settings")
    _add_defense(parser)
    parser.add_argument(
        "--val",
        action="append",
        default=[],
        metavar="DIR",
        help="dataset on which patches are validated; the best patches are kept",
    )
    parser.add_argument("--every", type=positive, default=25, metavar="N", help="steps between two validations (25)")
    parser.add_argument(
        "--patience",
        type=not_negative,
        default=0,
        metavar="N",
        help="validations without improvement until the attack stops early (0: never)",
    )
    parser.add_argument(
        "--verify", metavar="DIR", help="dataset with probes on which the patches are rendered and compared afterwards"
    )
    add_places(parser)
    parser.add_argument(
        "--per-scene",
        action="store_true",
        help="make patches for each scene of --data, in OUT/<town>-<scene>; --data may be a folder of datasets",
    )
    add_engine(parser, "with workers")
    add_engine_workers(parser, "scenes that are attacked")
    parser.add_argument("--compositor", default="transport", metavar="NAME", help="transport, or homography")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="seed of all random draws (0)")
    parser.add_argument("--allow-test-data", action="store_true", help="optimise on test splits too")
    parser.add_argument("--force", action="store_true", help="replace the results of another attack in --out")
    add_log(parser)
    parser.add_argument(
        "--json", action="store_true", help="print attack.json; with --verify, both as attack and verify"
    )


def _add_drive(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of attacks on the closed loop."""
    parser.add_argument(
        "--drive", metavar="CONFIG", help="attack the drives of a drive config, in place of --model and --data"
    )
    parser.add_argument(
        "--driver", metavar="NAME", help="with --drive: the attacked driver (the only one with cameras)"
    )
    add_settings(
        parser, "--drive-set", dest="drive_settings", help="with --drive: sets a key of the drive config; repeatable"
    )
    parser.add_argument(
        "--redrive", type=positive, metavar="N", help="with --drive: steps after which the drives are made anew (100)"
    )
    parser.add_argument(
        "--frames",
        type=positive,
        metavar="N",
        help="with --drive: frames of the drives to optimise on, with gradients (60)",
    )
    parser.add_argument(
        "--held-out", type=not_negative, metavar="N",
        help="with --drive: seeds per situation at which the patches are judged; 0 for none (3)",
    )  # fmt: skip


def _add_defense(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of the defense that the attack takes into account."""
    from gear.cli.commands.evaluate import add_calibration

    parser.add_argument(
        "--defense", metavar="NAME", help="defense that guards the models; the attack is adaptive to it"
    )
    add_settings(parser, "--defense-set", dest="defense_settings", help="an option of the defense")
    add_calibration(parser)
    parser.add_argument(
        "--score-weight",
        type=float,
        default=1.0,
        metavar="W",
        help="weight of lowering the defense's score; 0 for none (1)",
    )
    parser.add_argument(
        "--mask-weight",
        type=float,
        default=1.0,
        metavar="W",
        help="weight of removing the defense's mask from the patch; 0 for none (1)",
    )


def run(args: argparse.Namespace) -> int:
    """Runs the attack, prints the patch folder and the result, and returns exit code 0.

    Args:
        args: arguments of the command line, as the parser of this command returns them.
    """
    import json

    from gear.cli.requests import guard_of, request_of
    from gear.reporting.display import Display
    from gear.values.errors import GearError
    from gear.verbs.attack.request import AttackRequest
    from gear.verbs.attack.run import run_attack, unit_of
    from gear.verbs.attack.verify import check_held_out

    if args.drive is not None:
        return attack_drives(args)
    if args.model is None or args.data is None:
        raise GearError("name a model and its data with --model and --data, or drives with --drive")
    of_drives = (args.driver, args.drive_settings or None, args.held_out, args.redrive, args.frames)
    if any(one is not None for one in of_drives):
        raise GearError(
            "--driver, --drive-set, --held-out, --redrive and --frames are for drives; add --drive, or leave them out"
        )
    if args.verify is not None:
        check_held_out(args.data, args.verify, args.val)
    elif args.town is not None or args.scenes is not None:
        raise GearError(
            "--town and --scenes are of the dataset that --verify names; add --verify DIR, or leave them out"
        )
    request = request_of(AttackRequest, args, models=tuple(args.model), guard=guard_of(args))
    if args.per_scene:
        return attack_per_scene(args, request)
    if args.engine is not None or args.address is not None or args.engine_workers != 1:
        raise GearError(
            "--engine, --address and --engine-workers are for several scenes; add --per-scene, or leave them out"
        )
    with Display("attack", unit=unit_of(request)) as display:
        report = run_attack(request, display.callbacks)
    if args.verify is None or not args.json:
        print(json.dumps(report.facts, indent=2) if args.json else report.summary())
    if args.verify is not None:
        check_rendered(args, request, report.facts)
    return 0


OF_PICTURES = (
    "model", "data", "model_settings", "defense", "defense_settings", "calibration", "calibration_patched",
    "val", "every", "patience", "verify", "town", "scenes", "per_scene", "engine", "address", "engine_workers",
    "compositor", "score_weight", "mask_weight", "allow_test_data",
)  # fmt: skip
"""Flags of attacks on pictures, which an attack on drives does not take."""


def attack_drives(args: argparse.Namespace) -> int:
    """Runs an attack on the closed loop (`--drive`), prints the result and returns exit code 0.

    Args:
        args: arguments of the command line.
    """
    import json

    from gear.cli.device import device_of
    from gear.cli.requests import request_of
    from gear.reporting.display import Display
    from gear.values.errors import GearError
    from gear.verbs.attack.drives.request import DriveAttackRequest
    from gear.verbs.attack.drives.run import run_attack_drive, unit_of_drives

    device, args.model_settings = device_of(args.model_settings)
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    given = [name for name in OF_PICTURES if getattr(args, name) != parser.get_default(name)]
    if given:
        flag = given[0].removesuffix("_settings").replace("_", "-")
        raise GearError(f"--{flag} is for attacks on pictures; with --drive, the drive config names what is attacked")
    request = request_of(DriveAttackRequest, args, device=device)
    unit = unit_of_drives(request)
    if unit == "step" and args.queries is not None:
        raise GearError(f"attack {request.attack!r} takes steps; --queries is for attacks without gradients")
    if unit == "query" and (args.steps, args.redrive, args.frames) != (None, None, None):
        raise GearError(f"attack {request.attack!r} takes queries; --steps, --redrive and --frames need gradients")
    with Display("attack", unit=unit) as display:
        report = run_attack_drive(request, display.callbacks)
    print(json.dumps(report.facts, indent=2) if args.json else report.summary())
    return 0


def attack_per_scene(args: argparse.Namespace, request: AttackRequest) -> int:
    """Runs one attack for each scene (`--per-scene`), prints the results and returns exit code 0.

    Args:
        args: arguments of the command line.
        request: the arguments of `gear.attack`, with the data of all scenes.
    """
    import json

    from gear.dataset.executors.engines import DEFAULT
    from gear.reporting.display import Display
    from gear.values.errors import GearError
    from gear.verbs.attack.per_scene import Engine, run_attack_scenes

    if args.verify is not None:
        raise GearError("--verify is for the patches of one attack; run it for each scene, without --per-scene")
    engine = Engine(name=args.engine or DEFAULT, address=args.address, workers=args.engine_workers)
    with Display("attack", unit="scene") as display:
        reports = run_attack_scenes(request, engine, display.callbacks)
    if args.json:
        print(json.dumps({scene: report.facts for scene, report in reports.items()}, indent=2))
    else:
        print("\n".join(report.summary() for report in reports.values()))
    return 0


def check_rendered(args: argparse.Namespace, request: AttackRequest, facts: Json) -> None:
    """Renders the optimised patches in samples that the attack did not use (`--verify`), and prints a
    comparison with composed patches.

    Args:
        args: parsed arguments of the command.
        request: arguments of the attack.
        facts: content of `attack.json`.
    """
    import json

    from gear.cli.requests import request_of
    from gear.reporting.display import Display
    from gear.verbs.attack.request import VerifyRequest
    from gear.verbs.attack.verify import verify

    check = request_of(VerifyRequest, args, data=args.verify, models=request.models, guard=request.guard)
    with Display("attack --verify") as display:
        reports = verify(check, display.callbacks)
    if args.json:
        verified = {name: found.as_json() for name, found in reports.items()}
        print(json.dumps({"attack": facts, "verify": verified}, indent=2))
    else:
        for found in reports.values():
            print(found.table())
