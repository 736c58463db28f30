"""Flags whose values are `KEY=VALUE` settings; errors about a setting name the flag as the user gave it."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

from gear.values.setting import Setting


def add_settings(parser: argparse.ArgumentParser, *flags: str, help: str, dest: str = "settings") -> None:
    """Adds a repeatable flag with the value `KEY=VALUE` to a parser.

    Args:
        parser: the parser of a command.
        flags: names of the flag, such as `--set`.
        help: description of the settings.
        dest: attribute of the parsed arguments that gets the list of settings; several flags may share it.
    """
    parser.add_argument(*flags, metavar="KEY=VALUE", action=AddSetting, default=[], dest=dest, help=help)


class AddSetting(argparse.Action):
    """Appends the flag's value to a list of settings."""

    key = ""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        """Appends the value as a `Setting`.

        Args:
            parser, namespace, values, option_string: as argparse gives them; the parser, the parsed arguments, the
                flag's value, and the flag.
        """
        added = Setting(f"{self.key}{values}", given=f"{option_string} {values}")
        setattr(namespace, self.dest, [*getattr(namespace, self.dest, []), added])
