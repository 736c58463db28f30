"""Names the options in a message as the command that prints it has them.

Code that several commands share names options by flags, `--model-set KEY=VALUE` for example. A command without such a
flag has a key of its config or another flag for the same purpose, or nothing.
"""

from __future__ import annotations

import re

_SETTING = r"\w+=\S*[^\s;,.)]"
_OPTION = re.compile(rf"--(renderer|attack) (\w+)(?: or \w+)?|--([a-z-]+)(?: ({_SETTING}(?: {_SETTING})*|[A-Z]+\b))?")
"""An option, and its value if a setting, a placeholder, or the name of a renderer or attack follows."""

_OF_A_DATASET = {"renderer": "a dataset collected with {0}"}
_NO_FOLDER = {"out": "folder"}

WORDS: dict[str, dict[str, str]] = {
    "attack": {**_OF_A_DATASET, "workers": "--engine-workers"},
    "bench": {
        "attack": "`plugin: {1}` in the key `attack`",
        "calibration": "the key `samples.calibrate`",
        "calibration-patched": "the key `samples.calibrate`",
        "defense-set": "{2} in the key `set` of the defense",
        "model-set": "{2} in the key `set` of the network",
        "queries": "the key `attack.queries`",
        "renderer": "`renderer: {1}` in the key `collect`",
        "samples": "the key `samples`",
    },
    "defend": {"defense-set": "--set {1}"},
    "drive": {
        "calibration": "the driver's key `calibration`",
        "calibration-patched": "the driver's key `calibration_patched`",
        "defense-set": "{2} in the driver's key `defense_set`",
        "model-set": "{2} in the driver's key `model_set`",
        "renderer": "the key `renderer`, such as `renderer: {1}`",
    },
    "evaluate": _OF_A_DATASET,
    "gap": _OF_A_DATASET,
    "leaderboard": {
        "attack": "such as {1}",
        "calibration": "the record's calibration data",
        "calibration-patched": "the record's calibration data",
        "defense-set": "{2} in the record's settings of the defense",
        "model-set": "{2} in the record's settings of the network",
        "queries": "the record's number of queries",
        "renderer": "a machine that has the record's renderer",
        "workers": "other programs at the same time",
    },
    "models": _NO_FOLDER,
    "train": {"model-set": "--set options.{1}"},
    "verify": {**_OF_A_DATASET, **_NO_FOLDER},
    "weights": _NO_FOLDER,
}
"""The words for each option that a command lacks, by command and option. In the words, {0} is the option with its
value, {1} the value, and {2} the value as YAML.
"""


def fitted(command: str, text: str) -> str:
    """Returns a message that names options as the command has them: as its flags, or as keys of its config.

    Args:
        command: name of the command, such as `bench`; further words, such as `attack --verify`, are ignored.
        text: the message.
    """
    words = WORDS.get(command.partition(" ")[0], {})

    def named(found: re.Match[str]) -> str:
        option, value = found[1] or found[3], found[2] or found[4] or ""
        yaml = ", ".join(f"`{one.replace('=', ': ', 1)}`" for one in value.split())
        return words[option].format(found[0], value, yaml) if option in words else found[0]

    return _OPTION.sub(named, text)
