"""Who mistypes a command or a flag gets one line, with what they may have meant."""

from __future__ import annotations

import argparse
import importlib
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import IO

import pytest

from gear.cli.commands import doctor
from gear.cli.device import add_device
from gear.cli.main import COMMANDS, main
from gear.values.errors import GearError


def said(capsys: pytest.CaptureFixture[str], argv: list[str]) -> str:
    try:
        code = main(argv)
    except SystemExit as left:
        code = int(left.code or 0)
    out, err = capsys.readouterr()
    assert code == 2 and not out and err.count("\n") == 1
    return err


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("colect --task semseg", "gear: no command named 'colect'; did you mean collect?"),
        ("sheet data --jsn", "gear sheet: no flag --jsn"),
        ("evaluate --model m --data d --devcie=cpu", "gear evaluate: no flag --devcie; did you mean --device?"),
        ("train --task t --model m --data d --out o --resume", "gear train: no flag --resume; gear train --help"),
        ("evaluate --data d", "gear evaluate: the following arguments are required: --model; gear evaluate --help"),
        ("sheet a b c", "gear sheet: does not know what to do with 'b c'"),
        ("plugins --kind modl", "gear plugins: argument --kind: invalid choice: 'modl'"),
        ("weights shw x", "gear weights: argument ACTION: invalid choice: 'shw'"),
        ("--foo", "gear: no flag --foo"),
    ],
)
def test_one_line(line: str, expected: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert said(capsys, line.split()).startswith(expected)


def test_the_device_is_a_setting_of_the_model() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--set", action="append", default=[], dest="settings")
    add_device(parser, "settings")
    assert parser.parse_args([]).settings == []
    assert parser.parse_args(["--set", "seed=3", "--device", "cpu"]).settings == ["seed=3", "device=cpu"]
    assert parser.parse_args([]).settings == [], "the default stays as it was"


def test_ctrl_c_is_one_line_whatever_was_made_of_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Compiled modules that are stopped in their import raise an ImportError, and others may make an error of that."""

    def stopped(args: argparse.Namespace) -> int:
        try:
            try:
                raise KeyboardInterrupt
            except KeyboardInterrupt as interrupt:
                raise ImportError("initialization failed") from interrupt
        except ImportError as error:
            if args.of_ours:
                raise GearError("there is no torch: pip install torch") from None
            raise error

    monkeypatch.setattr(doctor, "add_arguments", lambda parser: parser.add_argument("--of-ours", action="store_true"))
    monkeypatch.setattr(doctor, "run", stopped)
    for more in ([], ["--of-ours"]):
        assert main(["doctor", *more]) == 130
        assert capsys.readouterr().err == "gear: stopped; run the same command again to go on\n"


def test_what_a_disk_refuses_is_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(doctor, "run", lambda args: (tmp_path / ("x" * 300)).read_bytes())
    assert main(["doctor"]) == 2
    assert capsys.readouterr().err == f"gear: {tmp_path / ('x' * 200)}…: File name too long\n"
    monkeypatch.setattr(doctor, "run", lambda args: (tmp_path / "gone").read_bytes())
    with pytest.raises(FileNotFoundError):
        main(["doctor"])


def test_a_temporary_folder_that_is_nowhere_is_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """As where the disk of the system and of the folder is full."""
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setattr(tempfile, "_candidate_tempdir_list", lambda: [str(tmp_path / "gone")])
    monkeypatch.setattr(doctor, "run", lambda args: tempfile.mkdtemp())
    assert main(["doctor"]) == 2
    told = f"gear: No usable temporary directory found in ['{tmp_path}/gone']; make room there, or set TMPDIR"
    assert capsys.readouterr().err == f"{told} to a folder on another disk\n"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no disk is full here")
@pytest.mark.parametrize("count", ["1", "100_000"])
def test_printing_to_a_full_disk_is_one_line(count: str) -> None:
    """Whether it comes up while something is printed or at the end, when the rest is."""
    with Path("/dev/full").open("wb") as full:
        assert printing(count, full) == (2, "gear: No space left on device\n")


def test_a_closed_output_pipe_is_no_error() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "wb") as closed:
        assert printing("1", closed) == (0, "")


def printing(count: str, out: IO[bytes]) -> tuple[int, str]:
    """Status and errors of a command that prints so many lines."""
    code = (
        "from gear.cli import main\nfrom gear.cli.commands import doctor\n"
        f"doctor.run = lambda args: [print(i) for i in range({count})] and 0\n"
        "main.sys.argv = ['gear', 'doctor']\nmain.entry()"
    )
    env = {key: value for key, value in os.environ.items() if key != "PYTHONUNBUFFERED"}
    done = subprocess.run([sys.executable, "-c", code], stdout=out, stderr=subprocess.PIPE, check=False, env=env)
    return done.returncode, done.stderr.decode()


def test_a_bug_keeps_its_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(args: argparse.Namespace) -> int:
        raise ZeroDivisionError

    monkeypatch.setattr(doctor, "run", broken)
    with pytest.raises(ZeroDivisionError):
        main(["doctor"])


@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_completion_knows_every_command_and_its_flags(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert all(name in script for name in COMMANDS) and "--calibration-patched" in script


@pytest.mark.parametrize(
    ("command", "needed"), [("evaluate", "--model m"), ("train", "--task t --model m --out o --val v --val w")]
)
def test_a_repeated_flag_of_datasets_keeps_all_of_them(command: str, needed: str) -> None:
    parser = argparse.ArgumentParser()
    importlib.import_module(f"gear.cli.commands.{command}").add_arguments(parser)
    for _ in range(2):
        given = parser.parse_args([*needed.split(), "--data", "a", "b", "--data", "c"])
        assert given.data == ["a", "b", "c"] and getattr(given, "val", ["v", "w"]) == ["v", "w"]
