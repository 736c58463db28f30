"""The record of a benchmark result (`gear-record`, version 1): one JSON file with everything that is needed to measure
the result again.

Records come from strangers. Every text, number and list is checked when a record is read, and nothing in a record is
run: plugins are only looked up by name among the installed ones.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import Literal

from gear.contracts.specs import Gradient
from gear.leaderboard.drive_claims import DriveClaim
from gear.leaderboard.field_checks import (
    check_name,
    check_number,
    check_plain,
    check_plugin_name,
    check_sha256,
    check_text,
)
from gear.values.errors import FieldError
from gear.values.serial import Json

FORMAT, VERSION = "gear-record", 1

MOST_DATASETS, MOST_SAMPLES, MOST_RESULTS, MOST_KINDS = 4_000, 20_000, 4_000, 64

Kind = Literal["model", "defense", "attack"]
"""What a record claims: the results of a network alone, the results of a defense, or an attack against a row of others.
"""

Knowledge = Literal["white-box", "black-box"]
"""What an attack knows of the network: its gradients, or only its answers."""


def canonical(value: Json) -> bytes:
    """Encodes the JSON `value` canonically: sorted keys, one entry per line, UTF-8, and a newline at the end."""
    return (json.dumps(value, sort_keys=True, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()


def digest(value: Json) -> str:
    """The SHA-256 of the canonical form of a JSON value."""
    return hashlib.sha256(canonical(value)).hexdigest()


@dataclass(frozen=True, slots=True, kw_only=True)
class Plugin:
    """A plugin as it was installed when the result was measured.

    Attributes:
        name, package, version: name of the plugin, and name and version of its package.
        options: all options, including defaults; no option is a path.
        code_sha256: SHA-256 over the files of the package's code.
        wheel_sha256: SHA-256 of the wheel from which the package was installed; None if pip did not note it.
        weights_sha256: SHA-256 over a network's parameters; None for other plugins.
    """

    name: str
    package: str
    version: str
    options: Json
    code_sha256: str
    wheel_sha256: str | None = None
    weights_sha256: str | None = None

    def __post_init__(self) -> None:
        for field in ("package", "version"):
            check_name(field, getattr(self, field))
        check_plugin_name("name", self.name)
        check_plain("options", self.options)
        check_sha256("code_sha256", self.code_sha256)
        for field in ("wheel_sha256", "weights_sha256"):
            if getattr(self, field) is not None:
                check_sha256(field, getattr(self, field))

    @property
    def identity(self) -> tuple[str, str, str, str, str | None]:
        """Name, package, version, and hashes of the options and of the weights; plugins that agree in these belong to
        the same row of the leaderboard.
        """
        return self.name, self.package, self.version, digest(self.options), self.weights_sha256


@dataclass(frozen=True, slots=True, kw_only=True)
class Benchmark:
    """The benchmark that was run, reduced to the recorded network and defense.

    Attributes:
        name: name of the config.
        config: the bench config with every default filled in; no value is a path.
        sha256: SHA-256 of the config's canonical form.
    """

    name: str
    config: Json
    sha256: str

    def __post_init__(self) -> None:
        check_name("name", self.name)
        if not isinstance(self.config, dict):
            raise FieldError("config", "expected a mapping")
        check_plain("config", self.config)
        if digest(self.config) != self.sha256:
            raise FieldError("sha256", "is not the hash of the config")

    @property
    def seed(self) -> int:
        """The seed of all random draws of the benchmark."""
        seed = self.config.get("seed", 0)
        return seed if isinstance(seed, int) else 0

    @property
    def data_key(self) -> str:
        """A hash that is equal for benchmarks whose results are comparable: same scenes, weathers and numbers of
        pictures.

        Attacks, networks, defenses and the seed may differ.
        """
        same = {key: self.config.get(key) for key in ("places", "weathers", "samples", "collect")}
        tasks = self.config.get("tasks")
        collect = (
            {k: v.get("collect") for k, v in tasks.items() if isinstance(v, dict)} if isinstance(tasks, dict) else {}
        )
        return digest(same | {"tasks": collect})


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """The recorded network, with its defense if there is one.

    Attributes:
        kind: what the record claims: results of a network alone (`model`), of a defense (`defense`), or of an attack on
            an entry of others (`attack`).
        task: name of the task plugin.
        metric: metric by which rows are ranked, such as `miou`.
        lower_is_better: whether the metric is an error.
        network, defense: the plugins; `defense` is None for a network alone.
        gradient: how gradients pass the defense; None without a defense.
        is_random: whether the defense gives other pictures, masks or scores for another state of its random generator.
        licence, authors, paper, trained_on: metadata of the entry's package; empty if it states none.
    """

    kind: Kind
    task: str
    metric: str
    lower_is_better: bool
    network: Plugin
    defense: Plugin | None
    gradient: Gradient | None
    is_random: bool
    licence: str = ""
    authors: str = ""
    paper: str = ""
    trained_on: str = ""

    def __post_init__(self) -> None:
        check_plugin_name("task", self.task)
        check_name("metric", self.metric)
        if (self.defense is None) != (self.gradient is None):
            raise FieldError("gradient", "is stated exactly for entries with a defense")
        if self.kind == "defense" and self.defense is None:
            raise FieldError("defense", "is missing in the record of a defense")
        if self.kind == "model" and self.defense is not None:
            raise FieldError("kind", "is model, but the network is behind a defense")
        for field in ("licence", "authors", "paper", "trained_on"):
            check_text(field, getattr(self, field))

    @property
    def row(self) -> tuple[object, ...]:
        """The identity of the leaderboard's row: task, network and defense."""
        return self.task, self.network.identity, None if self.defense is None else self.defense.identity


@dataclass(frozen=True, slots=True, kw_only=True)
class AttackFacts:
    """The attack that made the patches.

    Attributes:
        plugin: the attack plugin.
        knowledge: `white-box` if the attack uses gradients of the network, `black-box` if only its predictions.
        steps: number of optimisation steps; 0 if queries are limited instead.
        queries: largest number of forward passes; 0 for attacks that count steps.
        restarts: number of restarts from other random patches.
    """

    plugin: Plugin
    knowledge: Knowledge
    steps: int
    queries: int
    restarts: int = 0

    def __post_init__(self) -> None:
        for field in ("steps", "queries", "restarts"):
            check_number(field, getattr(self, field), low=0, high=1e9)


@dataclass(frozen=True, slots=True, kw_only=True)
class Data:
    """One dataset on which the entry was measured or calibrated.

    Attributes:
        scene, weather, patch: names of the scene, the weather and the kind of patch in the benchmark.
        samples: number of samples.
        content_key, twin_key: hashes of everything that decides the bytes of the dataset, with and without its patch.
        manifest_sha256: SHA-256 of the dataset's manifest, which lists the hashes of all files.
    """

    scene: str
    weather: str
    patch: str
    samples: int
    content_key: str
    twin_key: str
    manifest_sha256: str

    def __post_init__(self) -> None:
        for field in ("scene", "weather", "patch"):
            check_name(field, getattr(self, field))
        check_number("samples", self.samples, low=1, high=MOST_SAMPLES)
        for field in ("content_key", "twin_key", "manifest_sha256"):
            check_sha256(field, getattr(self, field))


@dataclass(frozen=True, slots=True, kw_only=True)
class PatchFacts:
    """The patches of one scene.

    Attributes:
        scene: name of the scene in the benchmark.
        target: name of the attacked network, or `<network>+<defense>` for an adaptive attack.
        sha256: SHA-256 of each picture, in the order of the surfaces; the pictures are `patches/<sha256>.png`.
        gain: how much larger the attack's objective is with these patches than with random ones, on pictures on which
            the patches were not optimised; None if it was not measured.
        gradient_kept: share of the predicted rise of the objective along its gradient that really follows; a low value
            is a sign of masked gradients. None if it was not measured.
    """

    scene: str
    target: str
    sha256: tuple[str, ...]
    gain: float | None = None
    gradient_kept: float | None = None

    def __post_init__(self) -> None:
        for field in ("scene", "target"):
            check_name(field, getattr(self, field))
        if not 1 <= len(self.sha256) <= 64:
            raise FieldError("sha256", "expected 1 to 64 hashes")
        for one in self.sha256:
            check_sha256("sha256", one)
        for field in ("gain", "gradient_kept"):
            if getattr(self, field) is not None:
                check_number(field, getattr(self, field), low=-1e12, high=1e12)


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """One number of the results: a metric over all scenes with one kind of patch.

    Attributes:
        patch: kind of patch: `none`, `random`, `patch`, `adaptive patch`, or `patch of NAME` for transfer.
        name: name of the metric; `auroc` is that of the defense's score.
        value, low, high: the value and its 95 % interval; None where undefined.
        n: number of samples.
        ceiling: value that perfect predictions reach.
        from_few_streets: whether the interval rests on fewer than three streets, so that it may be too narrow.
    """

    patch: str
    name: str
    value: float | None
    low: float | None
    high: float | None
    n: int
    ceiling: float = 1.0
    from_few_streets: bool = False

    def __post_init__(self) -> None:
        check_name("patch", self.patch)
        check_name("name", self.name)
        check_number("n", self.n, low=1, high=1e9)
        for field in ("value", "low", "high", "ceiling"):
            if getattr(self, field) is not None:
                check_number(field, getattr(self, field), low=-1e12, high=1e12)
        if self.value is None:
            return
        low, high = (self.value if end is None else end for end in (self.low, self.high))
        if not low <= self.value + 1e-9 or not self.value <= high + 1e-9:
            raise FieldError("value", f"{self.value:g} lies outside its interval [{low:g}, {high:g}]")


@dataclass(frozen=True, slots=True, kw_only=True)
class SampleResult:
    """The result of one sample, by which a check compares.

    Attributes:
        data: number of the dataset in `Record.data`.
        index: index of the sample in the dataset.
        sha256: SHA-256 over the files of the prediction.
        value: metric of this sample alone; None if it is undefined.
        score: the defense's score in 0..1; None without a score.
    """

    data: int
    index: int
    sha256: str
    value: float | None
    score: float | None

    def __post_init__(self) -> None:
        check_number("data", self.data, low=0, high=MOST_DATASETS)
        check_number("index", self.index, low=0, high=MOST_SAMPLES)
        check_sha256("sha256", self.sha256)
        for field in ("value", "score"):
            if getattr(self, field) is not None:
                check_number(field, getattr(self, field), low=-1e12, high=1e12)


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """A whole record.

    Attributes:
        benchmark: the benchmark.
        entry: network and defense.
        attack: the attack that made the patches.
        environment: versions of packages, renderer and device, by name.
        data: datasets on which the entry was measured; at most 64 kinds of patches.
        calibration: datasets on which the defense was calibrated; empty for a defense without calibration.
        patches: patches of each scene and each attacked target.
        results: numbers of the entry: its metrics for each kind of patch.
        reference: the same numbers of the network without a defense.
        sample_metric: name of the metric of single samples in `samples`.
        samples: results of single samples: each sample of each dataset once.
        cost_s: mean seconds per picture, of `model` and `defense`.
        checked_by: always empty: a record cannot say that it was checked.
        controller: the controller that drove the car in `drives`; None without drives.
        drives: outcomes of drives in the closed loop, from which the collision rates follow; each drive once.
    """

    benchmark: Benchmark
    entry: Entry
    attack: AttackFacts
    environment: dict[str, str]
    data: tuple[Data, ...]
    calibration: tuple[Data, ...]
    patches: tuple[PatchFacts, ...]
    results: tuple[Figure, ...]
    reference: tuple[Figure, ...]
    sample_metric: str
    samples: tuple[SampleResult, ...]
    cost_s: dict[str, float]
    checked_by: tuple[str, ...] = ()
    controller: Plugin | None = None
    drives: tuple[DriveClaim, ...] = ()

    def __post_init__(self) -> None:
        if (self.controller is None) != (not self.drives):
            raise FieldError("controller", "is stated exactly for records with drives")
        if len({one.key for one in self.drives}) != len(self.drives):
            raise FieldError("drives", "has a drive twice")
        most = {
            "drives": MOST_SAMPLES,
            "data": MOST_DATASETS,
            "calibration": 64,
            "patches": MOST_DATASETS,
            "results": MOST_RESULTS,
        }
        for field, count in (most | {"reference": MOST_RESULTS, "samples": MOST_SAMPLES, "environment": 40}).items():
            if len(getattr(self, field)) > count:
                raise FieldError(field, f"has more than {count} entries")
        if self.checked_by:
            raise FieldError("checked_by", "must be empty: a record cannot say that it was checked")
        check_text("sample_metric", self.sample_metric)
        for name, text in self.environment.items():
            check_name("environment", name)
            check_text(f"environment.{name}", text)
        for name, seconds in self.cost_s.items():
            check_name("cost_s", name)
            check_number(f"cost_s.{name}", seconds, low=0, high=1e9)
        for number, one in enumerate(self.samples):
            if one.data >= len(self.data) or one.index >= self.data[one.data].samples:
                raise FieldError(f"samples[{number}]", "is a sample of a dataset that is not listed")
        each = {(one.data, one.index) for one in self.samples}
        if not len(self.samples) == len(each) == sum(one.samples for one in self.data):
            raise FieldError("samples", "must hold every sample of every dataset exactly once")
        if len(self.kinds()) > MOST_KINDS:
            raise FieldError("data", f"has more than {MOST_KINDS} kinds of patches")
        counted = {kind: sum(one.samples for one in self.data if one.patch == kind) for kind in self.kinds()}
        for figure in self.results:
            if figure.n != counted.get(figure.patch):
                raise FieldError("results", f"{figure.n} samples with {figure.patch}, the datasets have another number")
        if len({(one.patch, one.name) for one in self.results}) != len(self.results):
            raise FieldError("results", "has a figure twice")

    def kinds(self) -> tuple[str, ...]:
        """The kinds of patches in the datasets, each once, in their order."""
        return tuple(dict.fromkeys(one.patch for one in self.data))

    def figure(self, patch: str, name: str = "", *, is_reference: bool = False) -> Figure | None:
        """One number of the results, or of those of the network without a defense; None if it is missing or undefined.

        Args:
            patch: kind of patch, such as `none` or `adaptive patch`.
            name: name of the metric; by default the ranked metric.
            is_reference: whether the number is that of the network without a defense.
        """
        wanted = name or self.entry.metric
        every = self.reference if is_reference else self.results
        return next((f for f in every if (f.patch, f.name) == (patch, wanted) and f.value is not None), None)
