"""The parser of the command line: an unknown flag gives a one-line error that suggests the closest known flag."""

from __future__ import annotations

import argparse
import difflib
from collections.abc import Sequence
from typing import NoReturn

from gear.reporting.messages import one_line


class Parser(argparse.ArgumentParser):
    """An argparse parser that prints errors as one line."""

    def error(self, message: str) -> NoReturn:
        """Prints a usage error as one line on stderr and exits with code 2.

        Args:
            message: what is wrong with the command line.
        """
        self.exit(2, f"{self.prog}: {one_line(message)}; {self.prog} --help says more\n")

    def command(self, name: str) -> Parser:
        """Returns the subparser of the command with this name."""
        chosen = next(action for action in self._actions if isinstance(action, argparse._SubParsersAction))
        parser = chosen.choices[name]
        assert isinstance(parser, Parser)
        return parser

    def refuse(self, unknown: Sequence[str]) -> NoReturn:
        """Prints one line about command-line words that no argument accepts, suggests the closest flag, and exits with
        code 2.

        Args:
            unknown: the words, as argparse returns those that it does not know.
        """
        flag = next((word.partition("=")[0] for word in unknown if word.startswith("-")), None)
        if flag is None:
            self.error(f"does not know what to do with {' '.join(unknown)!r}")
        # Flags are compared without dashes; with them --resume would resemble --set.
        flags = {known.lstrip("-"): known for known in self._option_string_actions}
        close = difflib.get_close_matches(flag.lstrip("-"), flags, n=1)
        self.error(f"no flag {flag}" + (f"; did you mean {flags[close[0]]}?" if close else ""))
