"""Errors of `gear leaderboard` are one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.cli.commands.leaderboard import run
from gear.cli.main import full_parser, main


@pytest.mark.parametrize("action", ["check", "build", "commit"])
def test_missing_files_are_one_line(action: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    more = ["--out", str(tmp_path / "site")] if action == "build" else []
    assert main(["leaderboard", action, str(tmp_path / "none.json"), *more]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.startswith("gear: ") and said.err.count("\n") == 1
    assert not (tmp_path / "site").exists()


def test_the_flags_of_a_check() -> None:
    args = full_parser("leaderboard").parse_args(["leaderboard", "check", "a.json", "--set", "seed=1"])
    assert (args.run, args.samples, args.fresh, args.seed, args.settings) == (run, 4, 8, None, ["seed=1"])
