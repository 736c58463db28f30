"""The arguments of `gear.defend` as a dataclass."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gear.values.rng import check_seed


@dataclass(frozen=True, slots=True, kw_only=True)
class DefendRequest:
    """The arguments of `gear.defend`, which describes each of them.

    Raises:
        GearError: the seed is out of range.
    """

    dataset: str | Path
    defense: str
    out: str | Path
    split: str | None = None
    settings: tuple[str, ...] = ()
    seed: int = 0

    def __post_init__(self) -> None:
        check_seed(self.seed)
