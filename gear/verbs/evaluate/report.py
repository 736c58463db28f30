"""The results of an evaluation, as values and JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from gear.measuring.metric_json import known_json
from gear.metrics.object_changes import ObjectChange
from gear.values.serial import Json, to_json

ALARMS = "alarms"
"""Metric: share of a dataset's pictures whose score is an alarm; for clean pictures the rate of false alarms."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A metric with its 95 % interval.

    Attributes:
        value: value of the metric; NaN if it is undefined.
        interval: lower and upper bound, or None.
        ceiling: value of perfect predictions on the same samples, for metrics of at most 1.
    """

    value: float
    interval: tuple[float, float] | None = None
    ceiling: float = 1.0

    def as_json(self) -> Json:
        """The estimate as JSON: null for values that are not finite, and without a ceiling of 1."""
        low, high = self.interval or (math.nan, math.nan)
        value = known_json({"value": self.value, "low": low, "high": high})
        return value | ({"ceiling": self.ceiling} if self.ceiling < 1 else {})


Metrics = Mapping[str, Mapping[str, Estimate]]
"""By report (`task` is the task's own evaluator), then by metric."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RowReport:
    """The results of one dataset.

    Attributes:
        name: name of its folder in the evaluation.
        dataset: root of the dataset.
        facts: its split, town, scene, weather, patch and keys; JSON.
        samples: number of samples.
        made: number of samples predicted in this run.
        damaged: one line per stored prediction that could not be read and was made again.
        metrics: metrics over all samples.
        cost: mean seconds per sample: `model_s`, `defense_s`.
        defense: mean metrics of the defense's masks; empty without a defense.
        per_sample: metrics of each single sample; JSON.
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
        """The label of the dataset's patch: `none`, `random`, or a name with a hash."""
        return str(self.facts["patch"])

    def as_json(self) -> Json:
        """The entry of the row in results.json."""
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
    """Several datasets with patches of one label, counted as one.

    Attributes:
        patch: label of the patches.
        rows: names of the datasets' rows.
        samples: number of samples of all of them.
        metrics: metrics over all samples.
    """

    patch: str
    rows: tuple[str, ...]
    samples: int
    metrics: Metrics

    def as_json(self) -> Json:
        """The entry in results.json."""
        return {
            "patch": self.patch,
            "rows": list(self.rows),
            "samples": self.samples,
            "metrics": metrics_json(self.metrics),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class PairedTest:
    """A paired test between twins of a metric that is defined for single samples.

    Attributes:
        mean: mean difference over the pairs; NaN without pairs.
        p: two-sided p-value of `gear.measuring.statistics.paired_p`; NaN without pairs.
        pairs: number of samples with a value in both datasets.
    """

    mean: float
    p: float
    pairs: int

    def as_json(self) -> Json:
        """The test as JSON, with null for NaN."""
        return {**known_json({"mean": self.mean, "p": self.p}), "pairs": self.pairs}


@dataclass(frozen=True, slots=True, kw_only=True)
class ChangeCount:
    """How often one kind of change happens between twins.

    Attributes:
        count: number of such changes from `against` to `row`.
        reverse: number of such changes from `row` to `against`, which chance alone makes as likely.
        rate: `count` as a share of the objects found in `against`; of invented detections, per picture.
        paired: test of `count` minus `reverse` per picture.
    """

    count: int
    reverse: int
    rate: Estimate
    paired: PairedTest

    def as_json(self) -> Json:
        """The entry of the change in results.json."""
        return {
            "count": self.count,
            "reverse": self.reverse,
            "rate": self.rate.as_json(),
            "paired": self.paired.as_json(),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class DistanceBin:
    """The objects found in the twin that lie at some distance from the patch, and how many of them are lost.

    Attributes:
        low, high: distances in the bin are at least `low` and less than `high`.
        found: number of objects found in `against`.
        lost: number of those that are hidden, misclassified or moved, by kind.
        rate: the lost objects as a share of `found`.
    """

    low: float
    high: float
    found: int
    lost: Mapping[str, int]
    rate: Estimate

    def as_json(self) -> Json:
        """The entry of the bin in results.json; null for a bin without an upper end."""
        limits = known_json({"low": self.low, "high": self.high})
        return {**limits, "found": self.found, **self.lost, "rate": self.rate.as_json()}


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectChanges:
    """What became of the objects that are found in the twin, and which detections are invented.

    Attributes:
        found: number of objects found in `against`.
        counts: by kind (`gear.metrics.object_changes`) and place: `hidden`, `hidden_on_patch`, `hidden_elsewhere`, ….
        changes: every change, with the index of its sample; empty for a pool.
        by_distance: objects by their distance from the patch, in bins of `metres` and of `pixels`; objects of pictures
            without a visible patch are in no bin.
    """

    found: int
    counts: Mapping[str, ChangeCount]
    changes: tuple[tuple[int, ObjectChange], ...]
    by_distance: Mapping[str, tuple[DistanceBin, ...]]

    def as_json(self) -> Json:
        """The entry of the objects in results.json."""
        return {
            "found": self.found,
            "counts": {name: one.as_json() for name, one in self.counts.items()},
            "by_distance": {unit: [one.as_json() for one in bins] for unit, bins in self.by_distance.items()},
            "changes": [{"sample": index, **to_json(one)} for index, one in self.changes],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """The difference between a dataset and its twin, sample by sample.

    Attributes:
        row, against: names of the rows; differences are `row` minus `against`.
        metrics: differences of the metrics.
        auroc: area under the ROC curve of the defense's score as a detector of `row` among both, or None without
            scores.
        paired: tests of the metrics that are defined for single samples, by report and metric.
        objects: what happens to objects between the twins; None for tasks without objects.
    """

    row: str
    against: str
    metrics: Metrics
    auroc: Estimate | None
    paired: Mapping[str, Mapping[str, PairedTest]]
    objects: ObjectChanges | None = None

    def as_json(self) -> Json:
        """The entry of the difference in results.json."""
        return {
            "row": self.row,
            "against": self.against,
            "metrics": metrics_json(self.metrics),
            "auroc": None if self.auroc is None else self.auroc.as_json(),
            "paired": {
                report: {name: one.as_json() for name, one in tests.items()} for report, tests in self.paired.items()
            },
            **({} if self.objects is None else {"objects": self.objects.as_json()}),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Pool:
    """Several datasets that are evaluated as one at the user's request.

    Attributes:
        name: name of the pool.
        rows: names of the datasets' rows.
        samples: number of samples of all of them.
        metrics: metrics over all samples.
        cost: mean seconds per sample: `model_s`, `defense_s`.
        defense: mean metrics of the defense's masks; empty without a defense.
        differences: differences to the pools `none` and `random`, if these show the same scenes; `row` and `against`
            are names of pools.
    """

    name: str
    rows: tuple[str, ...]
    samples: int
    metrics: Metrics
    cost: Mapping[str, float]
    defense: Mapping[str, float]
    differences: tuple[Difference, ...]

    def as_json(self) -> Json:
        """The entry of the pool in results.json."""
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
    """The results of a model, with or without a defense, on datasets.

    Attributes:
        out: folder of results.json, table.txt and the predictions.
        facts: model, defense, task, seed, versions, and notes for the reader of the metrics; JSON.
        rows: results of the datasets, in the order given.
        together: one entry per label of a patch (`none`, `random`, ...), with the metrics over all datasets of that
            label; for datasets that are not twins, such as those of several scenes.
        differences: differences between twins.
        pools: datasets counted as one at the user's request.
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
            KeyError: no dataset shows such a patch.
        """
        for row in self.rows:
            if row.patch == patch:
                return row
        raise KeyError(patch)


def metrics_json(metrics: Metrics) -> Json:
    """Metrics as JSON, by report and name."""
    return {report: {name: one.as_json() for name, one in rows.items()} for report, rows in metrics.items()}
