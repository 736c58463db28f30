"""What holds for every command: a file, flags, a help page with examples."""

from __future__ import annotations

import argparse
from types import ModuleType

import pytest

from gear.cli.commands import (
    attack,
    bench,
    collect,
    completion,
    defend,
    doctor,
    evaluate,
    export,
    gap,
    import_archive,
    merge,
    models,
    new,
    plugins,
    sheet,
    show_config,
    towns,
    train,
    view,
    weights,
)
from gear.cli.main import COMMANDS, full_parser, module_of

MODULES = [
    attack, bench, collect, completion, defend, doctor, evaluate, export, gap, import_archive, merge, models, new,
    plugins, sheet, show_config, towns, train, view, weights,
]  # fmt: skip


def test_every_command_is_listed() -> None:
    assert {module.__name__ for module in MODULES} <= set(map(module_of, COMMANDS))


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__.rpartition(".")[2])
def test_the_help_page_has_an_example_and_describes_every_flag(module: ModuleType) -> None:
    parser = argparse.ArgumentParser()
    module.add_arguments(parser)
    assert parser.epilog and parser.epilog.startswith("examples:\n  gear ")
    leaves = [parser]
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            leaves += action.choices.values()
    flags = [
        action for leaf in leaves for action in leaf._actions if not isinstance(action, argparse._SubParsersAction)
    ]
    assert [action.dest for action in flags if not action.help] == []


def test_the_full_parser_has_the_flags_of_all_commands() -> None:
    parser = full_parser()
    assert all("--help" in parser.command(name)._option_string_actions for name in COMMANDS)
    assert "--task" in parser.command("collect")._option_string_actions
    assert "--task" not in full_parser("sheet").command("collect")._option_string_actions
