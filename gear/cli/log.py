"""Flags of commands that can log their run for a tool such as TensorBoard."""

from __future__ import annotations

import argparse


def add_log(parser: argparse.ArgumentParser) -> None:
    """Adds `--log-to` and `--log-set` to the parser of a command."""
    parser.add_argument(
        "--log-to",
        metavar="NAME",
        help="logger plugin, such as tensorboard: curves and figures in OUT/log while the command runs",
    )
    parser.add_argument(
        "--log-set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        dest="log_settings",
        help="an option of the logger; repeatable",
    )
