"""The arguments of `gear.defend` as a dataclass."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gear.values.rng import check_seed


@dataclass(frozen=True, slots=True, kw_only=True)
class DefendRequest:
    """The arguments of `gear.defend`.

    Attributes:
        dataset, split: root of the dataset, and its split; None for the only split.
        defense, settings: name of the defense, and its `KEY=VALUE` options.
        out: folder for the cleaned pictures.
        seed: seed of the defense's random draws.

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
