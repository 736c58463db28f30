"""Encodings and widths of the terminal."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import pytest

from gear.cli.streams import folded, line_width, prepare_streams, wrapped


def test_characters_that_the_encoding_lacks_are_escaped(monkeypatch: pytest.MonkeyPatch) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding="ascii"))
    prepare_streams()
    print("dätä … \udc80")
    sys.stdout.flush()
    assert raw.getvalue() == rb"d\xe4t\xe4 \u2026 \udc80" + b"\n"


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&-", "<&- >&- 2>&-"])
def test_closed_streams_read_and_keep_nothing(closed: str, tmp_path: Path) -> None:
    """A file that is opened later does not get the number of a standard stream, in this process or in its children."""
    code = (
        "import subprocess, sys; from gear.cli.streams import prepare_streams; prepare_streams(); print('out'); "
        "print('err', file=sys.stderr); sys.stdin.read(); "
        f"file = open({str(tmp_path / 'data')!r}, 'w'); file.write(f'{{file.fileno() > 2}} '); file.flush(); "
        "subprocess.run([sys.executable, '-c', 'import os; [os.fstat(n) for n in range(3)]'], check=True); "
        "file.write('done')"
    )
    command = ["sh", "-c", f'exec "$0" -c "$1" {closed}', sys.executable, code]
    done = subprocess.run(command, capture_output=True, stdin=subprocess.DEVNULL, check=False)
    assert done.returncode == 0 and (tmp_path / "data").read_text() == "True done", done.stderr
    assert done.stdout == (b"" if " >&-" in f" {closed}" else b"out\n")
    assert done.stderr == (b"" if "2>&-" in closed else b"err\n")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no full device")
def test_an_error_keeps_its_exit_code_where_it_cannot_be_printed() -> None:
    code = "import sys; from gear.cli.main import main; sys.exit(main(['verify', 'nowhere']))"
    done = subprocess.run(["sh", "-c", 'exec "$0" -c "$1" 2>/dev/full', sys.executable, code], check=False)
    assert done.returncode == 2


@pytest.mark.parametrize(("columns", "expected"), [("", 100), ("0", 100), ("30", 60), ("80", 80), ("200", 200)])
def test_lines_are_as_wide_as_the_terminal(columns: str, expected: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    monkeypatch.setattr(sys, "__stdout__", io.StringIO())
    assert line_width() == expected


def test_long_lines_are_wrapped_with_an_indent_and_addresses_stay_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "70")
    address = "https://example.org/" + "a" * 80
    lines = wrapped("  source: " + "word " * 20 + address).splitlines()
    assert lines[-1] == "      " + address and len(lines) == 3
    assert all(len(line) <= 70 for line in lines[:-1]) and lines[1].startswith("      word")


def test_sentences_fit_the_line_and_tables_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    row = "data/none  0.712 [0.690, 0.734]  " + "0.5  " * 20
    found = folded(f"{row}\n{'a word ' * 30}and an end\nshort\n").split("\n")
    assert found[0] == row and found[-2:] == ["short", ""]
    assert len(found) == 6 and all(len(line) <= 80 for line in found[1:]) and found[2].startswith("    ")
