"""Shards: the parts of a split that several runs make, on any machine and in any order."""

from __future__ import annotations

import re
from dataclasses import dataclass

from gear.values.errors import GearError

_WRITTEN = re.compile(r"([0-9]{1,9})/([0-9]{1,9})")


@dataclass(frozen=True, slots=True, kw_only=True)
class Shard:
    """One part of a split: every `count`-th driving sequence.

    Sequences are assigned to the shards in turn, so a sequence stays in its shard when the split is extended.

    Attributes:
        number: number of this shard, from 1 to `count`.
        count: number of shards.
    """

    number: int
    count: int

    @classmethod
    def parse(cls, text: str) -> Shard:
        """Parses a shard from a text such as `2/8`, the second of eight shards.

        Raises:
            GearError: the text is not `I/N` with 1 ≤ I ≤ N.
        """
        found = _WRITTEN.fullmatch(text)
        shard = cls(number=int(found[1]), count=int(found[2])) if found else None
        if shard is None or not 1 <= shard.number <= shard.count:
            problem = "must be I/N with I from 1 to N, such as 2/8 for the second of eight shards"
            raise GearError(f"shard {text!r}: {problem}")
        return shard

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"

    def holds(self, sequence: int) -> bool:
        """Whether the shard contains a driving sequence, given by its number from 0."""
        return sequence % self.count == self.number - 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Picked(Shard):
    """A part of a split that consists of chosen driving sequences, for checks of single samples.

    Attributes:
        sequences: numbers of the sequences, from 0; single pictures are sequences of one frame.
    """

    sequences: frozenset[int]
    number: int = 1
    count: int = 1

    def holds(self, sequence: int) -> bool:
        """Whether the part contains a driving sequence, given by its number from 0."""
        return sequence in self.sequences


WHOLE = Shard(number=1, count=1)
"""The only shard of an undivided split; it contains all samples."""
