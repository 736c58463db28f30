"""Functions that parse the values of flags; argparse calls them as `type`."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gear.collecting.workers import Workers


def positive(text: str) -> int:
    """Parses the text of a flag as a whole number of at least 1; a `type` function for argparse."""
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError("must be at least 1")
    return number


def not_negative(text: str) -> int:
    """Parses the text of a flag as a whole number of at least 0; a `type` function for argparse."""
    number = int(text)
    if number < 0:
        raise argparse.ArgumentTypeError("must be at least 0")
    return number


def workers(text: str) -> Workers:
    """Parses `text`, the value of `--workers`: a whole number of at least 1, or `auto`; a `type` function for
    argparse.
    """
    return "auto" if text == "auto" else positive(text)
