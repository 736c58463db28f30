"""Legends: explanations of the colours in a task's previews (pictures of samples with labels, boxes or depth drawn
in).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

Rgb = tuple[int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class ColourBar:
    """A legend for a continuous scale of colours, drawn from left to right.

    Attributes:
        quantity: what the colours show, with its unit: `depth (m)`.
        colours: RGB 0..255 at equal distances along the bar; at least two.
        ticks: (position, text), with positions from 0 (left end) to 1 (right end).
    """

    quantity: str
    colours: tuple[Rgb, ...]
    ticks: tuple[tuple[float, str], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ColourNames:
    """A legend for colours that stand for names, such as classes.

    Attributes:
        entries: (name, RGB 0..255) in the order in which they are listed.
    """

    entries: tuple[tuple[str, Rgb], ...]


Legend = ColourBar | ColourNames


@runtime_checkable
class WithLegends(Protocol):
    """A task that provides legends for the colours of its previews."""

    def legends(self) -> Mapping[str, Legend]:
        """Legends by name of the preview, for those previews of `Task.preview` whose colours need an explanation."""
        ...
