"""The arguments of `gear.drive` as a dataclass."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gear.collecting.workers import Workers
from gear.dataset.executors.engines import DEFAULT
from gear.values.errors import GearError


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveRequest:
    """The arguments of `gear.drive`.

    Attributes:
        config, settings: name or path of the drive config, and `KEY=VALUE` texts that replace its values.
        out: folder of all results.
        device: device of the networks; None for that of the config.
        workers, engine, address: number of drives at the same time, name of the engine, and address of its cluster.

    Raises:
        GearError: the number of workers is below 1.
    """

    config: str | Path
    out: str | Path
    settings: tuple[str, ...] = ()
    device: str | None = None
    workers: Workers = 1
    engine: str = DEFAULT
    address: str | None = None

    def __post_init__(self) -> None:
        if self.workers != "auto" and self.workers < 1:
            raise GearError(f"workers must be at least 1, got {self.workers}")
