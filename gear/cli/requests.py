"""Builds the request dataclasses of the library from parsed flags: each field takes the value of the flag with the
same name.
"""

from __future__ import annotations

import argparse
import dataclasses
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from gear.measuring.guard import Guard

RequestT = TypeVar("RequestT")


def request_of(kind: type[RequestT], args: argparse.Namespace, **given: Any) -> RequestT:
    """Builds a request, the dataclass with the arguments of one library function, from parsed flags.

    Lists become tuples. A flag that the user did not give leaves the default of the field.

    Args:
        kind: dataclass of the request.
        args: parsed arguments of the command.
        given: values of further fields; they override the flags.

    Raises:
        GearError: the values contradict each other.
    """
    values = vars(args)
    fields = {field.name for field in dataclasses.fields(kind)}  # type: ignore[arg-type]
    chosen = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in values.items()
        if name in fields and value is not None
    }
    return kind(**{**chosen, **given})


def guard_of(args: argparse.Namespace) -> Guard | None:
    """Returns the defense that guards the model, from `--defense`, `--defense-set` and the calibration flags; None
    without `--defense`.

    Args:
        args: arguments of the command line, as `evaluate` and other commands with a defense have them.

    Raises:
        GearError: options or calibration data are given without a defense.
    """
    from gear.measuring.guard import Guard

    return Guard.of(args.defense, args.defense_settings, args.calibration, args.calibration_patched)
