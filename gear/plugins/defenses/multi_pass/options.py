"""Options of the defense ObjectSeeker and their checks."""

from __future__ import annotations

from dataclasses import dataclass

from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectSeekerConfig:
    """Options of ObjectSeeker; the defaults are those of the authors' code.

    Attributes:
        lines: number of lines that split the picture in each direction; the detector is called 4 times for each.
        masked_confidence: score that a box of a masked picture must exceed.
        base_confidence: score above which a box of the whole picture prunes boxes of masked pictures that lie in it.
        prune_share: share of a box of a masked picture that must lie in such a box, so that it is pruned.
    """

    lines: int = 30
    masked_confidence: float = 0.8
    base_confidence: float = 0.6
    prune_share: float = 0.6

    def __post_init__(self) -> None:
        if not 1 <= self.lines <= 1000:
            raise FieldError("lines", f"must be 1 to 1000, got {self.lines}")
        for name in ("masked_confidence", "base_confidence", "prune_share"):
            if not 0 <= getattr(self, name) <= 1:
                raise FieldError(name, f"must be 0 to 1, got {getattr(self, name):g}")
