"""`gear show-config`: prints the collection config that results from flags and config files, with all defaults
filled in.
"""

from __future__ import annotations

import argparse

from gear.cli.commands.collect import add_collection_arguments

EXAMPLE = """examples:
  gear show-config --task semseg
  gear show-config --config old_collection_config.yml     # converts a CARLA-GeAR config
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear show-config` to its argument parser."""
    parser.epilog = EXAMPLE
    add_collection_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Checks that every name in the collection config exists, prints the config as YAML and returns exit code 0.

    Args:
        args: arguments of the command line, as the parser of this command returns them.
    """
    from gear.collecting.lookup import look_up
    from gear.config.dump import to_yaml
    from gear.config.load import load_collection

    names = ("task", "town", "scene", "split", "samples", "seed", "weather", "patch", "renderer", "quality")
    flags = {name: getattr(args, name) for name in names} | {"root": args.out}
    config = load_collection(args.config, flags, args.settings)
    look_up(config)
    print(to_yaml(config), end="")
    return 0
