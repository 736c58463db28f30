"""The results of an evaluation, as dataclasses and as JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from gear.measuring.metric_json import known_json
from gear.measuring.statistics import Metrics as GatheredMetrics
from gear.metrics.object_changes import ObjectChange
from gear.values.serial import Json, to_json

ALARMS = "alarms"
"""Metric: share of pictures whose defense score is an alarm; for clean pictures, the rate of false alarms."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """The value of a metric with its 95 % interval.

    Attributes:
        value: value of the metric; NaN if it is undefined.
        interval: lower and upper end of the interval; None if unknown.
        ceiling: value that perfect predictions reach on the same samples; less than 1 if a dataset has too few objects.
        is_from_few: whether the interval rests on fewer than `FEWEST_CLUSTERS` streets, so that it is too narrow.
    """

    value: float
    interval: tuple[float, float] | None = None
    ceiling: float = 1.0
    is_from_few: bool = False

    def as_json(self) -> Json:
        """Returns `value`, `low` and `high` as JSON; numbers that are not finite become null. A `ceiling` of 1 is left
        out, and so is `from_few_streets` unless there is an interval and it rests on fewer than three streets.
        """
        low, high = self.interval or (math.nan, math.nan)
        value = known_json({"value": self.value, "low": low, "high": high})
        is_marked = self.is_from_few and self.interval is not None
        ceiling = {"ceiling": self.ceiling} if self.ceiling < 1 else {}
        return value | ceiling | ({"from_few_streets": True} if is_marked else {})


Metrics = Mapping[str, Mapping[str, Estimate]]
"""Metrics by name of the report (`task` is the task's own evaluator), then by name of the metric."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RowReport:
    """The results of one dataset.

    Attributes:
        name: name of the dataset's folder in the evaluation.
        dataset: root of the dataset.
        facts: root, town, scene, split, patch and content hashes of the dataset; JSON.
        samples: number of samples.
        made: number of samples predicted in this run.
        damaged: one line per stored prediction that could not be read and was made again.
        metrics: metrics over all samples, by name of the report (a group of metrics) and of the metric.
        cost: mean seconds per sample: `model_s`, `defense_s`.
        defense: mean metrics of the defense's masks, and the share of pictures that raise its alarm; empty without a
            defense.
        per_sample: metrics of each single sample; JSON.
        pictures: path of the sheet of pictures relative to the evaluation's folder; None without a sheet.
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
    pictures: str | None = None

    @property
    def patch(self) -> str:
        """The label of the dataset's patch: `none`, `random`, or a name with a hash."""
        return str(self.facts["patch"])

    def as_json(self) -> Json:
        """Returns the entry of this dataset in results.json; the keys are `name`, `dataset` (its metadata), `samples`,
        `metrics`, `cost`, `defense`, `per_sample`, and with a sheet `pictures`.
        """
        return {
            "name": self.name,
            "dataset": self.facts,
            "samples": self.samples,
            "metrics": metrics_json(self.metrics),
            "cost": dict(self.cost),
            "defense": known_json(self.defense),
            "per_sample": self.per_sample,
            **({} if self.pictures is None else {"pictures": self.pictures}),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class CombinedRow:
    """Several datasets with patches of the same label, evaluated as one.

    Attributes:
        patch: label of the patches.
        rows: names of the datasets (`RowReport.name`).
        samples: number of samples in all these datasets.
        metrics: metrics over all samples, by name of the report (a group of metrics) and of the metric.
    """

    patch: str
    rows: tuple[str, ...]
    samples: int
    metrics: Metrics

    def as_json(self) -> Json:
        """Returns the entry of these datasets in results.json: `patch`, `rows`, `samples` and `metrics`."""
        return {
            "patch": self.patch,
            "rows": list(self.rows),
            "samples": self.samples,
            "metrics": metrics_json(self.metrics),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class PairedTest:
    """A paired test of a metric that is defined for single samples, between twins: datasets that differ only in
    their patch.

    Attributes:
        mean: mean difference over the pairs of samples; NaN without pairs.
        p: two-sided p-value of a paired permutation test (`gear.measuring.statistics.paired_p`); NaN without pairs.
        pairs: number of samples with a value in both datasets.
    """

    mean: float
    p: float
    pairs: int

    def as_json(self) -> Json:
        """Returns `mean`, `p` and `pairs` as JSON, with null for NaN."""
        return {**known_json({"mean": self.mean, "p": self.p}), "pairs": self.pairs}


@dataclass(frozen=True, slots=True, kw_only=True)
class ChangeCount:
    """How often one kind of change, such as a hidden object, happens between a dataset and its twin, the same
    samples with another patch.

    Attributes:
        count: number of such changes from the twin to the dataset.
        reverse: number of the same changes in the opposite direction; by chance alone, both numbers would be equal on
            average.
        rate: `count` divided by the number of objects that are detected in the twin; for invented detections, divided
            by the number of pictures.
        paired: test of `count` minus `reverse` per picture.
    """

    count: int
    reverse: int
    rate: Estimate
    paired: PairedTest

    def as_json(self) -> Json:
        """Returns the entry of this kind of change in results.json: `count`, `reverse`, `rate` and `paired`."""
        return {
            "count": self.count,
            "reverse": self.reverse,
            "rate": self.rate.as_json(),
            "paired": self.paired.as_json(),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class DistanceBin:
    """Objects within a range of distances from the patch, and how many of them are lost.

    Only objects that are detected in the twin, the same sample with another patch, are counted.

    Attributes:
        low, high: the distances are at least `low` and less than `high`, in metres or pixels.
        found: number of these objects.
        lost: number of these objects that are hidden, misclassified or moved in the dataset itself, by kind.
        rate: share of these objects that are lost.
    """

    low: float
    high: float
    found: int
    lost: Mapping[str, int]
    rate: Estimate

    def as_json(self) -> Json:
        """Returns the entry of this bin in results.json: `low`, `high` (null for the last bin), `found`, the number of
        lost objects of each kind, and `rate`.
        """
        limits = known_json({"low": self.low, "high": self.high})
        return {**limits, "found": self.found, **self.lost, "rate": self.rate.as_json()}


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectChanges:
    """How the detections differ between a dataset and its twin, the same samples with another patch.

    Attributes:
        found: number of objects that are detected in the twin.
        counts: numbers of changes by kind and position relative to the patch: `hidden`, `hidden_on_patch`,
            `hidden_elsewhere`, ….
        changes: (index of the sample, change) of every single change; empty for a pool of datasets.
        by_distance: objects by their distance from the patch, in bins of `metres` and of `pixels`; pictures without a
            visible patch are left out.
    """

    found: int
    counts: Mapping[str, ChangeCount]
    changes: tuple[tuple[int, ObjectChange], ...]
    by_distance: Mapping[str, tuple[DistanceBin, ...]]

    def as_json(self) -> Json:
        """Returns the entry of the object changes in results.json: `found`, `counts`, `by_distance`, and `changes` with
        the index of the `sample`.
        """
        return {
            "found": self.found,
            "counts": {name: one.as_json() for name, one in self.counts.items()},
            "by_distance": {unit: [one.as_json() for one in bins] for unit, bins in self.by_distance.items()},
            "changes": [{"sample": index, **to_json(one)} for index, one in self.changes],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """The difference between a dataset and its twin (the same samples with another patch), sample by sample.

    Attributes:
        row, against: names of the dataset and of the twin; differences are `row` minus `against`.
        metrics: differences of the metrics, by name of the report (a group of metrics) and of the metric.
        auroc: area under the ROC curve of the defense's score, which should be high for samples of `row` and low for
            those of `against`; None without scores.
        paired: tests of the metrics that are defined for single samples, by report and metric.
        objects: changes of the detected objects; None for tasks without objects.
    """

    row: str
    against: str
    metrics: Metrics
    auroc: Estimate | None
    paired: Mapping[str, Mapping[str, PairedTest]]
    objects: ObjectChanges | None = None

    def as_json(self) -> Json:
        """Returns the entry of the difference in results.json: `row`, `against`, `metrics`, `auroc`, `paired`, and for
        tasks with objects `objects`.
        """
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
    """Several datasets that the user asked to evaluate as one.

    Attributes:
        name: name of the pool.
        rows: names of the datasets (`RowReport.name`).
        samples: number of samples in all these datasets.
        metrics: metrics over all samples, by report and name.
        cost: mean seconds per sample: `model_s`, `defense_s`.
        defense: mean metrics of the defense's masks, and the share of pictures that raise its alarm; empty without a
            defense.
        differences: differences to the pools `none` and `random`, if these show the same scenes; `row` and `against`
            are names of pools.
        gathered: the metrics of each report with their jackknife replicates, for differences to other evaluations of
            the same scenes; not part of results.json.
    """

    name: str
    rows: tuple[str, ...]
    samples: int
    metrics: Metrics
    cost: Mapping[str, float]
    defense: Mapping[str, float]
    differences: tuple[Difference, ...]
    gathered: Mapping[str, GatheredMetrics] = field(default_factory=dict, repr=False)

    def as_json(self) -> Json:
        """Returns the entry of the pool in results.json: `name`, `rows`, `samples`, `metrics`, `cost`, `defense` and
        `differences`.
        """
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
        out: folder of results.json, table.txt, report.html, pictures and predictions.
        facts: model, defense, task, seed, versions, and notes for the reader of the metrics; JSON.
        rows: results of the datasets, in the order of the arguments.
        together: one entry per label of a patch (`none`, `random`, ...) that several datasets share, such as datasets
            of several scenes, with the metrics over all of them.
        differences: differences between twins, datasets that differ only in their patch.
        pools: results of the groups of datasets that the user asked to evaluate as one.
    """

    out: Path
    facts: Json
    rows: tuple[RowReport, ...]
    together: tuple[CombinedRow, ...]
    differences: tuple[Difference, ...]
    pools: tuple[Pool, ...] = ()

    def as_json(self) -> Json:
        """Returns the content of results.json: the entries of `facts`, and the lists `rows`, `together`, `differences`,
        and `pools` if there are any.
        """
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
        """Returns the results of the first dataset whose patch has this label, such as `none` or `random`.

        Args:
            patch: label of the patch.

        Raises:
            KeyError: no dataset has such a patch.
        """
        for row in self.rows:
            if row.patch == patch:
                return row
        raise KeyError(patch)


def metrics_json(metrics: Metrics) -> Json:
    """Returns metrics as JSON, by report and name."""
    return {report: {name: one.as_json() for name, one in rows.items()} for report, rows in metrics.items()}
