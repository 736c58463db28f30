"""The arguments of `gear.bench` as a dataclass."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path

from gear.collecting.workers import Workers, fitting_workers
from gear.dataset.executors.engines import DEFAULT
from gear.leaderboard.record import Kind
from gear.values.errors import GearError


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchRequest:
    """The arguments of `gear.bench`.

    Attributes:
        config, settings: name or path of the bench config, and `KEY=VALUE` texts that replace its values.
        out: folder of all results.
        device: device of the networks; None for that of the config.
        workers, engine, address: number of workers, name of the engine that runs them, and address of its cluster.
        in_subprocess: whether a single worker runs in a process of its own.
        log_to, log_settings: name of a logger plugin, None for no log, and its `KEY=VALUE` options.
        record: whether records for a leaderboard are written; a text sets their kind.

    Raises:
        GearError: the number of workers is below 1.
    """

    config: str | Path
    out: str | Path
    settings: tuple[str, ...] = ()
    device: str | None = None
    workers: Workers = 1
    in_subprocess: bool = False
    engine: str = DEFAULT
    address: str | None = None
    record: Kind | bool = False
    log_to: str | None = None
    log_settings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.workers != "auto" and self.workers < 1:
            raise GearError(f"workers must be at least 1, got {self.workers}")

    @property
    def name(self) -> str:
        """The name of the config, without folder and ending."""
        return Path(self.config).stem

    @property
    def command(self) -> str:
        """The command line that makes the same results, without folders of this machine."""
        config = self.config if Path(self.config).name == str(self.config) else Path(self.config).name
        settings = [word for text in self.settings for word in ("--set", text)]
        return shlex.join(["gear", "bench", str(config), *settings])

    @property
    def is_scheduled(self) -> bool:
        """Whether the workers of an engine carry out the steps, several at a time; otherwise this process carries
        them out, one after the other.
        """
        return self.engine != DEFAULT or self.address is not None or fitting_workers(self.workers) > 1
