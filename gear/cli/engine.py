"""The flags by which commands choose an engine and its workers for jobs that run at the same time."""

from __future__ import annotations

import argparse

from gear.cli.flag_types import positive


def add_engine(parser: argparse.ArgumentParser, purpose: str) -> None:
    """Adds the flags `--engine` and `--address` to the parser of a command.

    Args:
        parser: parser of the command.
        purpose: what the engine does, for the help, such as `that makes the samples`.
    """
    parser.add_argument("--engine", metavar="NAME", help=f"engine {purpose}: processes, ray or slurm (processes)")
    parser.add_argument("--address", help="of the engine's cluster: a Ray cluster, or a SLURM partition")


def add_engine_workers(parser: argparse.ArgumentParser, what: str) -> None:
    """Adds the flag `--engine-workers` to the parser of a command that may distribute several large jobs.

    Args:
        parser: parser of the command.
        what: what the workers carry out at the same time, for the help.
    """
    parser.add_argument(
        "--engine-workers", type=positive, default=1, metavar="N", help=f"number of {what} at the same time (1)"
    )
