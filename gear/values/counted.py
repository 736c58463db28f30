"""Numbers of things in sentences."""

from __future__ import annotations


def counted(count: int, thing: str) -> str:
    """`1 sample`, `2 samples`: a number with its noun, which takes an `s` in the plural."""
    return f"{count} {thing}" + "s" * (count != 1)
