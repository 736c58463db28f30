"""Writes a step of a benchmark as the equivalent `gear` command line."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from typing import Any

from gear.verbs.bench.plan import Step, Verb

FLAGS: dict[str, str] = {
    "settings": "set",
    "model_settings": "model-set",
    "defense_settings": "defense-set",
    "calibration_patched": "calibration-patched",
    "reports": "report",
}
"""Names of the flags that differ from the name of the Python argument, by argument."""

ONCE: dict[Verb, tuple[str, ...]] = {"evaluate": ("data",)}
"""Arguments, by verb, whose values all follow one flag (`--data A B`); other flags are repeated for each value."""

ONLY_IN_PYTHON = ("pools",)

POSITIONAL = ("config",)
"""Arguments that stand on the command line without a flag."""


def command(step: Step) -> str:
    """Returns the command line of a step, quoted for a POSIX shell."""
    return shlex.join(["gear", step.verb, *_words(step)])


def _words(step: Step) -> Iterator[str]:
    for name, value in step.arguments.items():
        if name in ONLY_IN_PYTHON:
            continue
        if name in POSITIONAL:
            yield str(value)
            continue
        flag = f"--{FLAGS.get(name, name)}"
        if value is True:
            yield flag
        elif isinstance(value, (list, tuple)):
            yield from _several(flag, value, follows=name in ONCE.get(step.verb, ()))
        else:
            yield from (flag, str(value))


def _several(flag: str, values: list[Any] | tuple[Any, ...], *, follows: bool) -> Iterator[str]:
    if follows:
        yield from (flag, *map(str, values))
    else:
        for value in values:
            yield from (flag, str(value))
