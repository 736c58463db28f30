"""Formats a number with its noun, for messages."""

from __future__ import annotations


def counted(count: int, thing: str) -> str:
    """Formats a number with its noun, which takes an `s` in the plural: `1 sample`, `2 samples`.

    Args:
        count: the number.
        thing: the noun in the singular.
    """
    return f"{count} {thing}" + "s" * (count != 1)
