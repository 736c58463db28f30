"""`gear completion`: prints a shell script that enables tab completion of gear's commands and flags."""

from __future__ import annotations

import argparse

SHELLS = ("bash", "zsh")

EXAMPLE = """examples:
  gear completion bash > ~/.local/share/bash-completion/completions/gear
  gear completion zsh > "${fpath[1]}/_gear"
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear completion` to its argument parser."""
    parser.epilog = EXAMPLE
    parser.add_argument("shell", choices=SHELLS, help="shell for which the script is printed")


def run(args: argparse.Namespace) -> int:
    """Prints the completion script for the requested shell and returns exit code 0.

    Args:
        args: arguments of the command line; `shell` is the name of the shell.
    """
    import shtab

    from gear.cli.main import full_parser

    print(shtab.complete(full_parser(), shell=args.shell))
    return 0
