"""Encodings and widths of the terminal."""

from __future__ import annotations

import io
import sys

import pytest

from gear.cli.streams import folded, line_width, prepare_streams, wrapped


def test_characters_that_the_encoding_lacks_are_escaped(monkeypatch: pytest.MonkeyPatch) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding="ascii"))
    prepare_streams()
    print("dätä … \udc80")
    sys.stdout.flush()
    assert raw.getvalue() == rb"d\xe4t\xe4 \u2026 \udc80" + b"\n"


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
