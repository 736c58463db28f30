"""Flags of commands that can log their run for a tool such as TensorBoard."""

from __future__ import annotations

import argparse

from gear.cli.settings import add_settings


def add_log(parser: argparse.ArgumentParser) -> None:
    """Adds `--log-to` and `--log-set` to the parser of a command."""
    parser.add_argument(
        "--log-to",
        metavar="NAME",
        help="logger plugin, such as tensorboard: curves and figures in OUT/log while the command runs",
    )
    add_settings(parser, "--log-set", dest="log_settings", help="an option of the logger; repeatable")
