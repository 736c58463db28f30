"""Notes on datasets."""

from __future__ import annotations

from gear.measuring.notes import grouped


def test_equal_notes_become_one_line() -> None:
    notes = ["a: small", None, "b: small", "b: dark", "a: small", "c: small", "all of them"]
    assert grouped(notes) == ["a and 2 other datasets: small", "b: dark", "all of them"]
    assert grouped(["a: small", "b: small"]) == ["a and 1 other dataset: small"]
    assert grouped([None]) == []
