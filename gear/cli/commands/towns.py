"""`gear towns`: lists towns and their scenes, or draws a map of a town and a thumbnail of each of its scenes."""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from gear.values.errors import GearError
    from gear.verbs.towns.facts import Town

EXAMPLE = """examples:
  gear towns                                    the towns that come with gear, and their scenes
  gear towns town10 --out maps/                 a map, and a picture of every scene
  gear towns my/towns/port.xml --scenes port.yml --out maps/ --renderer classic
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear towns` to its argument parser."""
    parser.epilog = EXAMPLE
    parser.add_argument("town", nargs="?", help="name of a town, or path of its MJCF (all of gear's towns)")
    parser.add_argument("--scenes", metavar="FILE", help="scene library of the town, instead of gear's own")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--out", metavar="DIR", help="write a map and a sheet of thumbnails there")
    parser.add_argument(
        "--renderer", default="raster", help="renderer of the thumbnails: raster, filament, classic (raster)"
    )
    parser.add_argument("--quality", default="fast", help="quality of the thumbnails: film or fast (fast)")
    parser.add_argument("--weather", default="ClearNoon", help="weather preset of the thumbnails (ClearNoon)")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="seed of the thumbnails' viewpoints (0)")


def run(args: argparse.Namespace) -> int:
    """Lists towns with their scenes, or draws one town with `--out`; returns 0, or 2 if a scene is unusable.

    Args:
        args: arguments of the command line, as the parser of this command returns them.
    """
    from gear.values.errors import GearError
    from gear.verbs.towns.facts import read_town, town_names
    from gear.verbs.towns.write import check_pictures

    if args.town is None and (args.out or args.scenes):
        raise GearError("gear towns needs a town for --out and --scenes, such as: gear towns town10 --out maps/")
    if args.out is not None:
        return draw(args)
    check_pictures(renderer=args.renderer, quality=args.quality, weather=args.weather, seed=args.seed)
    names = [args.town] if args.town else town_names()
    found = [read_town(name, args.scenes) for name in names]
    if args.json:
        print(json.dumps({"towns": [town.to_json() for town in found]}, indent=1))
    else:
        for town in found:
            show(town)
    return _report(error for town in found for error in town.faulty.values())


def draw(args: argparse.Namespace) -> int:
    """Writes the map and the thumbnail sheet of one town and prints their paths; returns 0, or 2 if a scene is
    unusable.

    Args:
        args: arguments of the command line; `town` and `out` are given.
    """
    from gear.reporting.display import Display
    from gear.verbs.towns.write import write_town

    with Display("towns", unit="scene") as display:
        report = write_town(
            args.town,
            args.out,
            scenes=args.scenes,
            renderer=args.renderer,
            quality=args.quality,
            weather=args.weather,
            seed=args.seed,
            on_progress=display.callbacks.on_progress,
        )
    print(json.dumps({"map": str(report.map), "sheet": report.sheet and str(report.sheet)}) if args.json
          else report.summary())  # fmt: skip
    return _report(report.problems)


def _report(problems: Iterable[GearError]) -> int:
    """Prints one error per unusable scene on stderr; returns 2 if there is any, otherwise 0."""
    code = 0
    for problem in problems:
        print(f"gear: {problem}", file=sys.stderr)
        code = 2
    return code


def show(town: Town) -> None:
    """Prints the size, the lanes and the scenes of a town."""
    from gear.cli.streams import wrapped
    from gear.plugins.text import printable
    from gear.verbs.towns.legend import scene_note

    width_m, height_m = town.size_m
    print(
        f"{town.name}: {width_m:.0f} m x {height_m:.0f} m, {len(town.lanes.lanes)} lanes, {town.lane_km:.1f} km of"
        f" lanes, {len(town.lanes.bays)} parking bays"
    )
    if town.scenes is None:
        print("  no scenes; give a scene library with --scenes FILE.yml")
        return
    for name, scene in town.scenes.scenes.items():
        print(wrapped(printable(f"  {name:14} {scene_note(scene)}")))
        for board in scene.boards:
            x_m, y_m, _ = board.position_m
            print(f"  {'':14}   {printable(board.asset)} at ({x_m:g}, {y_m:g}), facing {board.facing_deg:g} deg")
