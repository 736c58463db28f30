"""The arguments of `gear.evaluate` as a dataclass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from gear.dataset.executors.engines import DEFAULT
from gear.measuring.guard import Guard
from gear.values.errors import GearError
from gear.values.rng import check_seed


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluateRequest:
    """The arguments of `gear.evaluate`.

    Attributes:
        data, split: roots of datasets or folders of roots, and their split; None if each has only one.
        model, model_settings: name of the network, and its `KEY=VALUE` options.
        guard: the defense that guards the network, with its calibration data; None for none.
        reports: names of further reports, which are groups of metrics.
        out: folder of the results; None for the default, which `folder` returns.
        batch: samples per batch; None for the default.
        workers: number of threads that read, score and write.
        engine, address, engine_workers: engine whose workers evaluate whole datasets, address of its cluster, and
            number of datasets at the same time.
        seed: seed of the defense's random draws and of the permutation tests.
        pictures: number of samples on the sheet of pictures of each dataset; 0 for no sheets.
        pools: roots of datasets that are evaluated as one, by name of the pool.

    Raises:
        GearError: a number is out of range.
    """

    data: tuple[str | Path, ...]
    model: str
    model_settings: tuple[str, ...] = ()
    guard: Guard | None = None
    split: str | None = None
    reports: tuple[str, ...] = ()
    out: str | Path | None = None
    batch: int | None = None
    workers: int = 2
    engine: str = DEFAULT
    address: str | None = None
    engine_workers: int = 1
    seed: int = 0
    pictures: int = 4
    pools: Mapping[str, Sequence[str | Path]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_seed(self.seed)
        if self.pictures < 0:
            raise GearError(f"pictures must be at least 0; got {self.pictures}")
        if min(1 if self.batch is None else self.batch, self.workers) < 1:
            raise GearError(f"batch and workers must be at least 1; got {self.batch}, {self.workers}")
        if self.engine_workers < 1:
            raise GearError(f"engine_workers must be at least 1, got {self.engine_workers}")

    @property
    def is_distributed(self) -> bool:
        """Whether the workers of an engine evaluate the datasets; otherwise this process evaluates them."""
        return self.engine != DEFAULT or self.address is not None or self.engine_workers > 1

    def folder(self, task: str) -> Path:
        """Returns the folder of the results: the requested one, or `evaluations/<task>/<model>[+<defense>]`."""
        if self.out is not None:
            return Path(self.out)
        guarded = "" if self.guard is None else f"+{self.guard.defense}"
        return Path("evaluations", task, self.model.replace("/", "-") + guarded)
