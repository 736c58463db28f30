"""The flag `--device` of `gear attack`, `gear evaluate` and `gear gap`, which sets the option `device` of their
models.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any


def add_device(parser: argparse.ArgumentParser, settings: str) -> None:
    """Adds the flag `--device` to a parser. Its value is appended as `device=VALUE` to the argument that
    `settings` names, the list of model options.
    """
    parser.add_argument(
        "--device",
        choices=("auto", "cpu", "cuda"),
        action=_AsSetting,
        dest=settings,
        default=argparse.SUPPRESS,
        help="device of the model: auto takes a GPU if there is one (auto)",
    )


class _AsSetting(argparse.Action):
    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        setattr(namespace, self.dest, [*getattr(namespace, self.dest, []), f"device={values}"])
