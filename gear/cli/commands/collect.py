"""`gear collect`: renders one split of a dataset: pictures with exact ground truth."""

from __future__ import annotations

import argparse

from gear.cli.engine import add_engine
from gear.cli.flag_types import workers
from gear.cli.settings import add_settings

EXAMPLE = """examples:
  gear collect --task stereo3d
  gear collect --task semseg --scene billboard04 --patch patches/ --out data/twin
  gear collect --task semseg --split train --probes --out data/train
  gear collect --task depth --weather WetNight --set weather.fog_density=10
  gear collect --task semseg --split train --shard 2/8 --out part2
  gear collect --config my.yml --set weather.cloudiness=30 --set options.width_px=1024
"""


def add_collection_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds to `parser` the flags that describe a collection (task, scene, weather, patch, …); `gear collect` and `gear
    show-config` share them.
    """
    parser.add_argument("--task", help="task plugin: semseg, detect2d, stereo3d, depth, or an installed one")
    parser.add_argument("--scene", help="name of a scene of the town (billboard01 … 09, truck …), or FILE.yml:NAME")
    parser.add_argument("--town", help="name of a town, or path of its MJCF (town10)")
    parser.add_argument("--split", help="split to collect: train, val, test, debug, finetuning, video (test)")
    parser.add_argument("--samples", metavar="N", help="number of samples, instead of the simulation config's")
    parser.add_argument("--seed", metavar="N", help="seed of the split, instead of the simulation config's")
    parser.add_argument("--weather", help="weather preset (ClearNoon)")
    parser.add_argument("--patch", help="patch to show: none, random, a picture, or a patch folder (none)")
    parser.add_argument("--renderer", help="renderer: raster, filament or classic (raster)")
    parser.add_argument("--quality", help="quality of the pictures: film or fast (film)")
    parser.add_argument(
        "--out", metavar="DIR", help="root of the dataset (data/<task>/<town>-<scene>-<weather>/<patch>)"
    )
    parser.add_argument("--config", metavar="FILE", help="collection config, gear's or CARLA-GeAR's; flags override it")
    add_settings(parser, "--set", help="sets a key of the config; repeatable")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear collect` to its argument parser."""
    parser.epilog = EXAMPLE
    add_collection_arguments(parser)
    add_engine(parser, "that makes the samples")
    parser.add_argument(
        "--workers",
        type=workers,
        default=1,
        metavar="N",
        help="number of processes, or auto: as many as cores and memory allow; it does not change the result (1)",
    )
    parser.add_argument(
        "--shard",
        metavar="I/N",
        help="collect only part I of N, on any machine; finish with `gear merge`, or with a run without --shard",
    )
    parser.add_argument(
        "--probes",
        action="store_const",
        const=True,
        help="also write probes, from which patches can be composed; for `gear attack` and `gear gap`",
    )
    parser.add_argument("--force", action="store_true", help="replace a split that was made with another configuration")


def run(args: argparse.Namespace) -> int:
    """Collects the split, prints the dataset's folder and returns exit code 0.

    Args:
        args: arguments of the command line, as the parser of this command returns them.
    """
    from gear.cli.requests import request_of
    from gear.reporting.display import Display
    from gear.verbs.collect.request import CollectRequest
    from gear.verbs.collect.run import run_collect

    with Display("collect") as display:
        report = run_collect(request_of(CollectRequest, args), display.callbacks)
    print(report.summary())
    return 0
