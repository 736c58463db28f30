"""The arguments of `gear.collect` as a dataclass."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gear.collecting.workers import Workers
from gear.config.collection import CollectionConfig
from gear.config.load import load_collection
from gear.dataset.executors.engines import DEFAULT
from gear.dataset.sharding.shards import Shard
from gear.values.errors import GearError


@dataclass(frozen=True, slots=True, kw_only=True)
class CollectRequest:
    """The arguments of `gear.collect`. None means the value of the config.

    Attributes:
        config: name or path of the collection config; None for gear's defaults.
        task, town, scene, split, samples, seed, weather, patch, renderer, quality, probes: values for the config's keys
            of these names.
        out: root of the dataset.
        settings: `KEY=VALUE` texts for further keys of the config.
        engine, address, workers: engine that makes the samples, address of its cluster, and number of its workers.
        shard: `I/N` for the I-th of N parts of the split; None for all of it.
        in_subprocess: whether a single worker also runs in a separate process.
        force: whether an existing split with another configuration is replaced.

    Raises:
        GearError: the number of workers is below 1; the number is `auto` for an engine on other machines; or the shard
            is not `I/N`.
    """

    task: str | None = None
    config: str | Path | None = None
    town: str | Path | None = None
    scene: str | None = None
    split: str | None = None
    samples: int | str | None = None
    seed: int | str | None = None
    weather: str | None = None
    patch: str | Path | None = None
    renderer: str | None = None
    quality: str | None = None
    out: str | Path | None = None
    probes: bool | None = None
    settings: tuple[str, ...] = ()
    engine: str = DEFAULT
    address: str | None = None
    workers: Workers = 1
    shard: str | None = None
    in_subprocess: bool = False
    force: bool = False

    def __post_init__(self) -> None:
        if self.workers != "auto" and self.workers < 1:
            raise GearError(f"workers must be at least 1, got {self.workers}")
        if self.workers == "auto" and self.engine != DEFAULT:
            raise GearError(f"--workers auto counts this machine's cores; give --engine {self.engine} a number")
        self.chosen_shard()

    def chosen_shard(self) -> Shard | None:
        """Returns the part of the split that is collected; None for the whole split.

        Raises:
            GearError: the shard is not `I/N` with 1 ≤ I ≤ N.
        """
        return None if self.shard is None else Shard.parse(self.shard)

    def loaded(self) -> CollectionConfig:
        """Returns the collection config: the values of the config file, overridden by the arguments of this
        request.

        Raises:
            ConfigError: a value cannot be read.
        """
        given = {
            "task": self.task,
            "town": self.town,
            "scene": self.scene,
            "split": self.split,
            "samples": self.samples,
            "seed": self.seed,
            "weather": self.weather,
            "patch": self.patch,
            "renderer": self.renderer,
            "quality": self.quality,
            "root": self.out,
            "probes": None if self.probes is None else str(self.probes).lower(),
        }
        flags = {key: None if value is None else str(value) for key, value in given.items()}
        return load_collection(None if self.config is None else str(self.config), flags, self.settings)
