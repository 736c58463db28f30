"""`gear export`: writes a dataset in the layout of another tool, such as YOLO."""

from __future__ import annotations

import argparse

from gear.cli.settings import add_settings

EXAMPLE = """examples:
  gear export data/stereo3d/town10-billboard01-ClearNoon/none --layout kitti --out kitti/
  gear export data/detect2d/town10-billboard01-ClearNoon/none --layout yolo --set labels=polygons --out yolo/
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear export` to its argument parser."""
    from gear.formats.exports.registry import layout_names

    parser.epilog = EXAMPLE
    parser.add_argument("dataset", help="root of a dataset")
    parser.add_argument("--layout", required=True, help=f"{', '.join(layout_names())}")
    parser.add_argument(
        "--out",
        required=True,
        metavar="DIR",
        help="folder of the new tree, or an address such as s3://bucket/folder; must be empty or new",
    )
    add_settings(parser, "--set", help="option of the layout")


def run(args: argparse.Namespace) -> int:
    """Exports the dataset, prints the new folder and returns exit code 0.

    Args:
        args: arguments of the command line, as the parser of this command returns them.
    """
    from gear.values.counted import counted
    from gear.verbs.export import export

    count = export(args.dataset, layout=args.layout, out=args.out, settings=args.settings, progress=True)
    print(f"{args.out}: {counted(count, 'sample')} in the layout {args.layout}")
    return 0
