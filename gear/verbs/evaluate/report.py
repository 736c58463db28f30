"""What an evaluation found, as values, JSON and a table."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from gear.measuring.metric_json import known_json
from gear.values.serial import Json


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A metric with its bounds of 95 %.

    Attributes:
        value: NaN where nothing counts.
        interval: bounds by bootstrap over samples, or None.
        ceiling: what perfect predictions of the same samples would come to, for metrics that count up to 1.
    """

    value: float
    interval: tuple[float, float] | None = None
    ceiling: float = 1.0

    def as_json(self) -> Json:
        """null for what is not finite; the ceiling is left out where it is 1."""
        low, high = self.interval or (math.nan, math.nan)
        value = known_json({"value": self.value, "low": low, "high": high})
        return value | ({"ceiling": self.ceiling} if self.ceiling < 1 else {})


Metrics = Mapping[str, Mapping[str, Estimate]]
"""By report (`task` is the task's own evaluator), then by metric."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RowReport:
    """One dataset.

    Attributes:
        name: folder of the row in the evaluation.
        dataset: root of the dataset.
        facts: its split, town, scene, weather, patch and keys; JSON.
        samples: how many it has.
        made: how many of them this run predicted.
        damaged: what a former run had kept and could not be read; a line for each sample that was predicted again.
        metrics: over all samples.
        cost: mean seconds a sample: `model_s`, `defense_s`.
        defense: mean metrics of the defense's mask; empty without one.
        per_sample: each sample's own metrics; JSON.
    """

    name: str
    dataset: Path
    facts: Json
    samples: int
    made: int
    damaged: tuple[str, ...]
    metrics: Metrics
    cost: Mapping[str, float]
    defense: Mapping[str, float]
    per_sample: Json

    @property
    def patch(self) -> str:
        """`none`, `random`, or the patch's name and hash."""
        return str(self.facts["patch"])

    def as_json(self) -> Json:
        """As written into results.json."""
        return {
            "name": self.name,
            "dataset": self.facts,
            "samples": self.samples,
            "metrics": metrics_json(self.metrics),
            "cost": dict(self.cost),
            "defense": known_json(self.defense),
            "per_sample": self.per_sample,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Together:
    """Several datasets with patches of one label as one.

    Attributes:
        patch: the label.
        rows: names of their rows.
        samples: of all of them.
        metrics: over all samples.
    """

    patch: str
    rows: tuple[str, ...]
    samples: int
    metrics: Metrics

    def as_json(self) -> Json:
        """As written into results.json."""
        return {
            "patch": self.patch,
            "rows": list(self.rows),
            "samples": self.samples,
            "metrics": metrics_json(self.metrics),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class PairedTest:
    """Whether the samples' own metrics differ between twins by more than chance.

    Attributes:
        mean: of the differences, over the pairs; NaN without any.
        p: two-sided, by `gear.measuring.statistics.paired_p`; NaN without pairs.
        pairs: samples that have a metric in both.
    """

    mean: float
    p: float
    pairs: int

    def as_json(self) -> Json:
        """null for NaN."""
        return {**known_json({"mean": self.mean, "p": self.p}), "pairs": self.pairs}


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """One dataset against its twin, sample by sample.

    Attributes:
        row, against: names of the rows; what is said is `row` minus `against`.
        metrics: of the differences.
        auroc: how well the defense's score tells the rows apart, or None without scores.
        paired: tests of the metrics that single samples have, by report, then by metric.
    """

    row: str
    against: str
    metrics: Metrics
    auroc: Estimate | None
    paired: Mapping[str, Mapping[str, PairedTest]]

    def as_json(self) -> Json:
        """As written into results.json."""
        return {
            "row": self.row,
            "against": self.against,
            "metrics": metrics_json(self.metrics),
            "auroc": None if self.auroc is None else self.auroc.as_json(),
            "paired": {
                report: {name: one.as_json() for name, one in tests.items()} for report, tests in self.paired.items()
            },
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Pool:
    """Several datasets counted as one, by whoever evaluates them.

    Attributes:
        name: of the pool.
        rows: names of the datasets' rows.
        samples: of all of them.
        metrics: over all samples.
        cost: mean seconds a sample: `model_s`, `defense_s`.
        defense: mean metrics of the defense's mask; empty without one.
        differences: to the pools `none` and `random`, where these show the same scenes; `row` and `against` name pools.
    """

    name: str
    rows: tuple[str, ...]
    samples: int
    metrics: Metrics
    cost: Mapping[str, float]
    defense: Mapping[str, float]
    differences: tuple[Difference, ...]

    def as_json(self) -> Json:
        """As written into results.json."""
        return {
            "name": self.name,
            "rows": list(self.rows),
            "samples": self.samples,
            "metrics": metrics_json(self.metrics),
            "cost": dict(self.cost),
            "defense": known_json(self.defense),
            "differences": [one.as_json() for one in self.differences],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluateReport:
    """A model, with or without a defense, over datasets.

    Attributes:
        out: folder of results.json, table.txt and the predictions.
        facts: model, defense, task, seed, versions, notes for whoever reads the metrics; JSON.
        rows: the datasets, in the order given.
        together: datasets that differ in more than their patch, by the patch's label.
        differences: between twins.
        pools: datasets that were to be counted as one.
    """

    out: Path
    facts: Json
    rows: tuple[RowReport, ...]
    together: tuple[Together, ...]
    differences: tuple[Difference, ...]
    pools: tuple[Pool, ...] = ()

    def as_json(self) -> Json:
        """The content of results.json."""
        return {
            "format": "gear-evaluation",
            "version": 1,
            **self.facts,
            "rows": [row.as_json() for row in self.rows],
            "together": [one.as_json() for one in self.together],
            "differences": [one.as_json() for one in self.differences],
            **({"pools": [one.as_json() for one in self.pools]} if self.pools else {}),
        }

    def row(self, patch: str) -> RowReport:
        """The first dataset with a patch of this label.

        Raises:
            KeyError: there is none.
        """
        for row in self.rows:
            if row.patch == patch:
                return row
        raise KeyError(patch)


def metrics_json(metrics: Metrics) -> Json:
    """By report, then by metric."""
    return {report: {name: one.as_json() for name, one in rows.items()} for report, rows in metrics.items()}
