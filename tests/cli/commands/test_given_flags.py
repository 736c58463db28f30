"""Errors name the flag that the user gave, and are one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.cli.main import main
from tests.dataset.splits import fill, plan

ATTACK = [
    "attack",
    "--model",
    "ddrnet23_slim_depth",
    "--data",
    "DATA:train",
    "--compositor",
    "homography",
    "--out",
    "new",
]
EVALUATE = ["evaluate", "--model", "ddrnet23_slim_depth", "--data", "DATA", "--out", "new"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small dataset of depth."""
    root = tmp_path_factory.mktemp("given")
    fill(root / "DATA", plan(split="train", samples=2))
    return root


@pytest.mark.parametrize(
    ("words", "flag"),
    [
        (EVALUATE, "--set"),
        (EVALUATE, "--model-set"),
        ([*EVALUATE, "--defense", "jpeg"], "--defense-set"),
        (ATTACK, "--set"),
        (ATTACK, "--model-set"),
        ([*ATTACK, "--defense", "jpeg"], "--defense-set"),
        ([*ATTACK, "--log-to", "tensorboard"], "--log-set"),
        (["attack", "--drive", "quick", "--out", "new"], "--drive-set"),
        (["defend", "DATA", "--defense", "jpeg", "--out", "new"], "--set"),
        (["drive", "quick", "--out", "new"], "--set"),
        (["bench", "quick", "--out", "new"], "--set"),
        (["train", "--task", "semseg", "--model", "ddrnet23_slim", "--data", "DATA", "--out", "new"], "--set"),
        (["train", "--task", "semseg", "--model", "ddrnet23_slim", "--data", "DATA", "--out", "new",
          "--log-to", "tensorboard"], "--log-set"),
        (["collect", "--task", "semseg", "--out", "new"], "--set"),
        (["show-config", "--task", "semseg"], "--set"),
    ],
)  # fmt: skip
def test_an_unknown_key_is_reported_with_its_flag(
    words: list[str], flag: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)
    assert main([*words, flag, "no_such_key=1"]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"gear: {flag} no_such_key=1: ") and said.count("\n") == 1
    assert not (folder / "new").exists()


@pytest.mark.parametrize(
    ("words", "flag"),
    [
        (ATTACK, "--steps"),
        (ATTACK, "--queries"),
        (ATTACK, "--every"),
        (EVALUATE, "--batch"),
        (["verify", "DATA"], "--workers"),
        (["sheet", "DATA"], "--samples"),
    ],
)
def test_a_number_out_of_range_is_reported_with_its_flag(
    words: list[str], flag: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main([*words, flag, "0"])
    said = capsys.readouterr().err
    assert f"argument {flag}: must be at least 1" in said and said.count("\n") == 1
