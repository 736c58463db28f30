"""The flags of the log are those of every command that can log its run."""

from __future__ import annotations

import argparse

import pytest

from gear.cli.log import add_log
from gear.cli.main import full_parser


def test_options_of_the_logger_are_collected() -> None:
    parser = argparse.ArgumentParser()
    add_log(parser)
    args = parser.parse_args(["--log-to", "tensorboard", "--log-set", "flush_s=1", "--log-set", "a=b"])
    assert (args.log_to, args.log_settings) == ("tensorboard", ["flush_s=1", "a=b"])
    assert (parser.parse_args([]).log_to, parser.parse_args([]).log_settings) == (None, [])


@pytest.mark.parametrize("command", ["attack", "train", "bench"])
def test_commands_with_a_log(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        full_parser(command).parse_args([command, "--help"])
    assert "--log-to NAME" in capsys.readouterr().out
