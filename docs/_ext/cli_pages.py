"""The reference page of the command line, made from the parsers that the commands themselves use."""

from __future__ import annotations

import argparse
import importlib
import os
from unittest import mock

from gear.cli.main import COMMANDS, module_of
from gear.cli.parser import Parser


def page() -> str:
    """The page in Markdown: the help of every command and of its own subcommands."""
    parts = [
        "# Command line",
        "Every command prints this help with `--help`. Each one is also a function of the [Python API](api.md).",
    ]
    with mock.patch.dict(os.environ, {"COLUMNS": "100", "NO_COLOR": "1"}):
        for name, summary in COMMANDS.items():
            parts.append(f"## `gear {name}`")
            parts += [_help(one) for one in _with_subcommands(_parser(name, summary))]
    return "\n\n".join(parts) + "\n"


def _parser(name: str, summary: str) -> argparse.ArgumentParser:
    parser = Parser(prog=f"gear {name}", description=summary, formatter_class=argparse.RawDescriptionHelpFormatter)
    importlib.import_module(module_of(name)).add_arguments(parser)
    return parser


def _with_subcommands(parser: argparse.ArgumentParser) -> list[argparse.ArgumentParser]:
    found = [parser]
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for sub in action.choices.values():
                found += _with_subcommands(sub)
    return found


def _help(parser: argparse.ArgumentParser) -> str:
    return f"```text\n{parser.format_help().rstrip()}\n```"
