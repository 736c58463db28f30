"""Messages advise only what the command at hand has."""

from __future__ import annotations

import argparse
import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from gear.cli.main import COMMANDS, full_parser
from gear.reporting.advice import WORDS, fitted
from gear.reporting.display import Display

GEAR = Path(__file__).parents[2] / "gear"
FLAG = re.compile(r"(?<![\w-])--[a-z][a-z-]+")
OTHER_COMMAND = re.compile(r"\bgear [a-z-]+|\bcollect(?:ed)?\b|pip install")
"""Words of a message about the flags of another command."""

MEASURING = ("evaluate", "attack", "gap", "bench", "drive", "leaderboard")
RENDERING = ("collect", "towns", "attack", "gap", "bench", "drive", "verify")
WRITING = (
    "collect", "sheet", "view", "train", "attack", "gap", "defend", "evaluate", "bench", "leaderboard", "drive",
    "verify", "merge", "import", "export", "towns", "weights", "new",
)  # fmt: skip

REACHED: dict[str, tuple[str, ...]] = {
    "collecting": ("collect",),
    "collecting/devices.py": ("collect",),
    "config/load.py": ("collect",),
    "config/overrides.py": ("collect",),
    "dataset": WRITING,
    "dataset/claims.py": ("collect", "bench", "drive"),
    "dataset/disk_and_time_forecast.py": ("collect", "bench"),
    "dataset/executors": ("collect", "bench", "drive", "evaluate"),
    "dataset/plan.py": ("collect", "merge"),
    "dataset/probe_files.py": ("attack", "gap", "bench"),
    "dataset/sharding": ("merge",),
    "dataset/store.py": ("collect", "bench", "verify"),
    "driving": ("drive", "attack", "bench"),
    "formats/exports": ("export",),
    "measuring": MEASURING,
    "measuring/calibration.py": ("evaluate", "attack", "gap"),
    "measuring/gap/request.py": ("gap",),
    "measuring/gap/twin.py": ("gap",),
    "measuring/gap/run.py": ("gap",),
    "measuring/guard.py": ("evaluate", "attack", "gap"),
    "measuring/plugin_selection.py": ("evaluate", "attack", "gap"),
    "measuring/run_log.py": ("attack", "train", "bench"),
    "networks": (*MEASURING, "train"),
    "plugins/attacks": ("attack", "bench"),
    "plugins/defenses": (*MEASURING, "defend"),
    "plugins/defenses/activations": MEASURING,
    "plugins/defenses/masking": MEASURING,
    "plugins/models": ("train",),
    "plugins/tasks": WRITING,
    "readers": ("train", "attack"),
    "render": RENDERING,
    "values/errors.py": ("collect", "attack"),
    "values/setting.py": ("collect", "evaluate", "gap", "attack", "train", "bench", "drive", "defend", "export"),
    "verbs/attack": ("attack",),
    "verbs/attack/job.py": ("attack",),
    "verbs/attack/models.py": ("attack", "bench"),
    "verbs/attack/run.py": ("attack", "bench"),
    "verbs/attack/scenes.py": ("attack", "bench"),
    "verbs/bench": ("bench",),
    "verbs/collect": ("collect",),
    "verbs/defend": ("defend",),
    "verbs/drive": ("drive",),
    "verbs/evaluate": ("evaluate",),
    "verbs/export.py": ("export",),
    "verbs/import_archive": ("import",),
    "verbs/leaderboard": ("leaderboard",),
    "verbs/merge.py": ("merge",),
    "verbs/scaffold": ("new",),
    "verbs/towns": ("towns",),
    "verbs/train": ("train",),
    "verbs/verify": ("verify",),
    "verbs/weights": ("weights",),
    "view": ("view",),
    "world": RENDERING,
}
"""Commands that print the messages of a folder or module; the longest prefix counts."""


def messages(path: Path) -> Iterator[str]:
    """The texts in a module that name a flag, without docstrings; values in f-strings become `{}`."""
    tree = ast.parse(path.read_text())
    skipped: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr):
            skipped.add(id(node.value))
        elif isinstance(node, ast.JoinedStr):
            skipped |= {id(value) for value in node.values}
    for node in ast.walk(tree):
        if id(node) in skipped:
            continue
        text = ""
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = node.value
        elif isinstance(node, ast.JoinedStr):
            text = "".join(str(one.value) if isinstance(one, ast.Constant) else "{}" for one in node.values)
        if FLAG.search(text) and not FLAG.fullmatch(
            text.strip()
        ):  # a flag alone is an argument, or a part of a command
            yield text


def commands_of(module: str) -> tuple[str, ...]:
    prefixes = [prefix for prefix in REACHED if module == prefix or module.startswith(f"{prefix}/")]
    return REACHED[max(prefixes, key=len)] if prefixes else ()


@pytest.fixture(scope="module")
def flags() -> dict[str, set[str]]:
    """The flags of each command and of its subcommands."""

    def known(parser: argparse.ArgumentParser) -> set[str]:
        found = set(parser._option_string_actions)
        for action in parser._actions:
            if isinstance(action, argparse._SubParsersAction):
                found |= {flag for one in action.choices.values() for flag in known(one)}
        return found

    parser = full_parser()
    return {name: known(parser.command(name)) for name in COMMANDS}


MODULES = sorted(
    path.relative_to(GEAR).as_posix()
    for path in GEAR.rglob("*.py")
    if path.relative_to(GEAR).parts[0] != "cli" and path.name != "advice.py" and any(messages(path))
)


@pytest.mark.parametrize("module", MODULES)
def test_messages_name_flags_of_the_command_that_prints_them(module: str, flags: dict[str, set[str]]) -> None:
    assert commands_of(module), f"{module} names flags; add the commands that print its messages to REACHED"
    for text in messages(GEAR / module):
        for command in commands_of(module):
            said = fitted(command, text)
            unknown = [flag for flag in FLAG.findall(said) if flag not in flags[command]]
            assert not unknown or OTHER_COMMAND.search(said), f"gear {command} has no {unknown}: {said}"


@pytest.mark.parametrize(
    ("command", "message", "said"),
    [
        (
            "bench",
            "give at least 19 (--calibration DIR), or raise it with --defense-set false_alarms=SHARE",
            "give at least 19 (the key `samples.calibrate`), or raise it with `false_alarms: SHARE` in the key `set` "
            "of the defense",
        ),
        (
            "bench",
            "learnt from 1536 px: --model-set input_scale=0.5 corrects this",
            "learnt from 1536 px: `input_scale: 0.5` in the key `set` of the network corrects this",
        ),
        (
            "drive",
            "its masks mean nothing (other layers: --defense-set shallow=[TAP] deep=[TAP])",
            "its masks mean nothing (other layers: `shallow: [TAP]`, `deep: [TAP]` in the driver's key `defense_set`)",
        ),
        ("bench", "--set foo=1: foo: unknown key", "--set foo=1: foo: unknown key"),
        ("drive", "--set foo=1: foo: unknown key", "--set foo=1: foo: unknown key"),
        (
            "drive",
            "the model assumes 70; say --model-set hfov_deg=90",
            "the model assumes 70; say `hfov_deg: 90` in the driver's key `model_set`",
        ),
        ("defend", "raise it with --defense-set false_alarms=0.1", "raise it with --set false_alarms=0.1"),
        ("verify", "wait for its end, or use another --out", "wait for its end, or use another folder"),
        ("attack --verify", "or use --renderer filament", "or use a dataset collected with --renderer filament"),
        ("evaluate", "--model-set input_scale=0.5 corrects this", "--model-set input_scale=0.5 corrects this"),
        ("train", "say --model-set hfov_deg=90", "say --set options.hfov_deg=90"),
        (
            "bench",
            "use --renderer filament or classic",
            "use `renderer: filament` in the key `collect`",
        ),
        (
            "bench",
            "can (--attack square with --queries N)",
            "can (`plugin: square` in the key `attack` with the key `attack.queries`)",
        ),
        (
            "leaderboard",
            "with fewer --workers more memory is free",
            "with fewer other programs at the same time more memory is free",
        ),
        ("attack", "use fewer --workers; or another --out", "use fewer --engine-workers; or another --out"),
    ],
)
def test_advice_fits_the_command(command: str, message: str, said: str) -> None:
    assert fitted(command, message) == said


@pytest.mark.parametrize("command", sorted(WORDS))
def test_only_options_that_a_command_lacks_have_other_words(command: str, flags: dict[str, set[str]]) -> None:
    """Otherwise an error that repeats what the user gave would name another flag."""
    assert not {f"--{option}" for option in WORDS[command]} & flags[command]


def test_notes_of_a_display_fit_its_command(capsys: pytest.CaptureFixture[str]) -> None:
    with Display("bench") as shown:
        shown.callbacks.on_warning("--model-set input_scale=0.5 corrects this")
    assert capsys.readouterr().err == "gear: note: `input_scale: 0.5` in the key `set` of the network corrects this\n"
