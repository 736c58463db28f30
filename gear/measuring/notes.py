"""Combines equal warnings about several datasets into one line."""

from __future__ import annotations

from collections.abc import Iterable


def grouped(notes: Iterable[str | None]) -> list[str]:
    """Combines warnings of the form `ROOT: text`: one line per text, with the first root and the number of further
    roots.

    Args:
        notes: the warnings; None entries are skipped.

    Returns:
        The lines, in the order in which each text comes first.
    """
    roots: dict[str, dict[str, None]] = {}
    for note in notes:
        if note is not None:
            root, _, text = note.partition(": ")
            roots.setdefault(text, {})[root] = None
    lines = []
    for text, named in roots.items():
        first, others = next(iter(named)), len(named) - 1
        more = f" and {others} other dataset{'s' * (others > 1)}" if others else ""
        lines.append(f"{first}{more}: {text}" if text else first)
    return lines
