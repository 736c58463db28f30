"""Rewrites the advice in a message for the command that prints it.

Code that several commands share names the flags of `gear evaluate` and `gear collect`. Other commands have a config key
or another flag for the same purpose, or nothing.
"""

from __future__ import annotations

import re
from collections.abc import Callable

Rewrites = tuple[tuple[str, str | Callable[[re.Match[str]], str]], ...]
"""Pairs of a regular expression and its replacement, applied in order."""

_SETTING = r"\w+=\S*[^\s;,.)]"
_OF_A_DEFENSE = rf"--defense-set ({_SETTING}(?: {_SETTING})*)"
_OF_A_NETWORK = rf"(?:--model-set|(?<=say )--set|--set(?= input_scale)) ({_SETTING})"
"""Options of a network: `--set` alone also sets keys of the config of `gear bench` and `gear drive`."""


def _in_yaml(where: str) -> Callable[[re.Match[str]], str]:
    """Returns a function that replaces `KEY=VALUE` settings by YAML, followed by where they stand in a config."""

    def replacement(found: re.Match[str]) -> str:
        return ", ".join(f"`{one.replace('=', ': ', 1)}`" for one in found[1].split()) + f" in {where}"

    return replacement


_NO_OUT: Rewrites = (
    (r"[;,](?: or)? use another --out", ""),
    (r"choose another --out", "write to another folder"),
)
_FROM_A_DATASET: Rewrites = ((r"use (--renderer \w+(?: or \w+)?)", r"collect the dataset with \1"),)

REWRITES: dict[str, Rewrites] = {
    "attack": (
        *_FROM_A_DATASET,
        (r"say --set (input_scale=)", r"say --model-set \1"),
        (r"fewer --workers", "fewer --engine-workers"),
    ),
    "bench": (
        (_OF_A_DEFENSE, _in_yaml("the key `set` of the defense")),
        (_OF_A_NETWORK, _in_yaml("the key `set` of the network")),
        (r"--calibration(?:-patched)?(?: DIR)?", "the key `samples.calibrate`"),
        (r"--attack (\w+) --queries N", r"`attack: {plugin: \1, queries: N}`"),
        (r"--queries(?: N)?", "the key `attack.queries`"),
        (r"--renderer (\w+)(?: or (\w+))?", r"`renderer: \1` in the key `collect`"),
        (r"--samples N", "the key `samples`"),
    ),
    "defend": ((r"--defense-set (\w+=)", r"--set \1"),),
    "drive": (
        (_OF_A_DEFENSE, _in_yaml("the driver's key `defense_set`")),
        (_OF_A_NETWORK, _in_yaml("the driver's key `model_set`")),
        (r"--calibration-patched(?: DIR)?", "the driver's key `calibration_patched`"),
        (r"--calibration(?: DIR)?", "the driver's key `calibration`"),
        (r"--renderer (\w+)(?: or (\w+))?", r"the key `renderer`, such as `renderer: \1`"),
    ),
    "evaluate": _FROM_A_DATASET,
    "gap": _FROM_A_DATASET,
    "leaderboard": (
        (_OF_A_DEFENSE, _in_yaml("the record's settings of the defense")),
        (_OF_A_NETWORK, _in_yaml("the record's settings of the network")),
        (r"--calibration(?:-patched)?(?: DIR)?", "the record's calibration data"),
        (r"--renderer (\w+)(?: or (\w+))?", "a machine that has the record's renderer"),
        (r"--attack (\w+) --queries N", r"such as \1"),
        (r"--queries(?: N)?", "the record's number of queries"),
        (r"fewer --workers need", "fewer other programs at the same time leave"),
    ),
    "models": _NO_OUT,
    "train": ((r"say --set (input_scale=)", r"say --set options.\1"),),
    "verify": (*_NO_OUT, *_FROM_A_DATASET),
    "weights": _NO_OUT,
}
"""The rewritten advice, by command."""


def fitted(command: str, text: str) -> str:
    """Returns a message whose advice names what the command has: its flags, or keys of its config.

    Args:
        command: name of the command, such as `bench`; further words, such as `attack --verify`, are ignored.
        text: the message.
    """
    for pattern, replacement in REWRITES.get(command.partition(" ")[0], ()):
        text = re.sub(pattern, replacement, text)
    return text
