"""The flag `--device` of `gear attack`, `gear evaluate` and `gear gap`, which sets the option `device` of their
models.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from gear.cli.settings import AddSetting

DEVICE = "device="
"""Beginning of the model option that the flag sets."""


def add_device(parser: argparse.ArgumentParser, settings: str) -> None:
    """Adds the flag `--device` to a parser. Its value is appended as `device=VALUE` to the argument that
    `settings` names, the list of model options.
    """
    parser.add_argument(
        "--device",
        choices=("auto", "cpu", "cuda"),
        action=_AddDevice,
        dest=settings,
        default=argparse.SUPPRESS,
        help="device of the model: auto takes a GPU if there is one (auto)",
    )


def device_of(settings: Sequence[str]) -> tuple[str | None, list[str]]:
    """Separates the value of the flag `--device` from other model options.

    Args:
        settings: `KEY=VALUE` texts, to which the flag appends `device=VALUE`.

    Returns:
        The last device, None without one, and the other options.
    """
    devices = [text.removeprefix(DEVICE) for text in settings if text.startswith(DEVICE)]
    return (devices[-1] if devices else None), [text for text in settings if not text.startswith(DEVICE)]


class _AddDevice(AddSetting):
    key = DEVICE
