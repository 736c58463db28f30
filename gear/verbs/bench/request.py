"""What a bench is asked to do."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gear.values.errors import GearError


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchRequest:
    """As the keywords of `gear.bench`, where they are explained.

    Raises:
        GearError: the number of workers is not at least 1.
    """

    config: str | Path
    out: str | Path
    settings: tuple[str, ...] = ()
    device: str | None = None
    workers: int = 1
    in_subprocess: bool = False

    def __post_init__(self) -> None:
        if self.workers < 1:
            raise GearError(f"workers must be at least 1, got {self.workers}")
