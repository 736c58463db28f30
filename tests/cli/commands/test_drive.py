from __future__ import annotations

import argparse

import pytest

from gear.cli.commands.drive import add_arguments
from gear.cli.main import main
from gear.cli.requests import request_of
from gear.verbs.drive.request import DriveRequest


def test_flags_reach_the_request() -> None:
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    words = ["quick", "--out", "x", "--set", "repeats=2", "--set", "seed=4", "--workers", "3", "--device", "cpu"]
    assert request_of(DriveRequest, parser.parse_args(words)) == DriveRequest(
        config="quick", out="x", settings=("repeats=2", "seed=4"), workers=3, device="cpu"
    )


def test_the_shipped_configs_can_be_planned(capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing is rendered and nothing is written; every name, option and patch is looked up."""
    assert main(["drive", "quick", "--out", "nowhere", "--list"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 9
    assert main(["drive", "study", "--out", "nowhere", "--list"]) == 0
    assert len(capsys.readouterr().out.splitlines()) > 1000


def test_an_unknown_config_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["drive", "quikc", "--out", "nowhere"]) == 2
    error = capsys.readouterr().err
    assert "did you mean quick?" in error and error.count("\n") == 1
