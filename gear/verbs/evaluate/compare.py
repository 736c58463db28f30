"""Computes the metrics of datasets from their samples, and compares twins, datasets that differ only in their patch."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from gear.contracts.tasks import CONTROLS, NO_PATCH
from gear.dataset.reading import Dataset, scenes_of
from gear.measuring.intervals import FEWEST_CLUSTERS, Values, leave_one_out
from gear.measuring.scoring import SampleResult, Scorer
from gear.measuring.statistics import (
    Metrics,
    auroc,
    auroc_interval,
    clustered,
    difference_interval,
    gather,
    paired_p,
)
from gear.verbs.evaluate.report import ALARMS, CombinedRow, Difference, Estimate, ObjectChanges, PairedTest, RowReport
from gear.verbs.evaluate.twin_objects import object_changes

ALARM = 0.5
"""A picture whose defense score is above this value raises an alarm."""

Street = tuple[str, int, int]
"""Identifier of what a sample shows, independently of weather and patch: `town/scene`, seed and sample index."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class EvaluatedDataset:
    """One dataset with the stored scores of its samples.

    Attributes:
        name: name of the dataset's folder in the evaluation.
        dataset: the dataset.
        scorer: the metrics, which are computed from the scores of the samples.
        results: stored scores of the samples, in order.
        streets: the scene content that each sample shows, independently of weather and patch; samples of one street are
            not statistically independent.
        made: number of samples predicted in this run.
        damaged: one line per stored prediction that could not be read and was made again.
        known: cache of computed metrics by report and number of samples, because computing them is slow.
    """

    name: str
    dataset: Dataset[Any]
    scorer: Scorer
    results: list[SampleResult]
    streets: list[Street]
    made: int
    damaged: tuple[str, ...]
    known: dict[tuple[str, int], Metrics] = field(default_factory=dict, repr=False)

    def gathered(self, report: str, count: int | None = None) -> Metrics:
        """Returns the metrics of one report over the first `count` samples, or over all samples by default."""
        results = self.results[:count]
        key = (report, len(results))
        if key not in self.known:
            parts = [result.parts[report] for result in results]
            metric = self.scorer.reports[report]
            checked = partial(metric.checked, method="result")
            draws = leave_one_out(self.streets[:count])
            with metric.blamed("result"):
                self.known[key] = gather(metric.make, parts, draws, checked)
        return self.known[key]

    @property
    def patch(self) -> str:
        """Label of the patch in the dataset's pictures: `none`, `random`, or a name with a hash."""
        return self.dataset.plan.info.patch_label


def streets_of(dataset: Dataset[Any]) -> list[Street]:
    """Returns for each sample an identifier of the scene content that it shows (its street).

    Weather, renderer and patch are not part of the identifier, because the positions of cars do not depend on them.

    Args:
        dataset: the dataset.
    """
    return [(*scenes_of(dataset), number) for number in range(len(dataset))]


def row_report(row: EvaluatedDataset) -> RowReport:
    """Returns the results of one dataset: metrics with intervals, times, and the scores of single samples.

    Args:
        row: the evaluated dataset.
    """
    results = row.results
    plan = row.dataset.plan
    return RowReport(
        name=row.name,
        dataset=row.dataset.root,
        facts={
            "root": str(row.dataset.root),
            "town": plan.info.town,
            "scene": plan.info.scene,
            "split": plan.info.split,
            "patch": plan.info.patch_label,
            "content_key": plan.content_key,
            "twin_key": plan.twin_key,
        },
        samples=len(results),
        made=row.made,
        damaged=row.damaged,
        metrics=metrics_of(row),
        cost=mean_cost(results),
        defense=mask_means(results, has_patch=plan.info.patch_label != NO_PATCH),
        per_sample=[
            {k: v for k, v in result.as_json().items() if k not in {"facts", "objects", "defended"}}
            for result in results
        ],
    )


def mean_cost(results: Sequence[SampleResult]) -> dict[str, float]:
    """Returns the mean seconds per sample of the model (`model_s`) and of the defense (`defense_s`).

    Args:
        results: results of the samples.
    """
    return {key: float(np.mean([result.cost[key] for result in results])) for key in ("model_s", "defense_s")}


def mask_means(results: Sequence[SampleResult], *, has_patch: bool) -> dict[str, float]:
    """Returns the mean metrics of a defense's masks, and the share of pictures that raise its alarm.

    Metrics of masks are left out if the defense returns no masks, and the alarm if it returns no scores. Without a
    patch, the only metric of masks is `mask_area`, the share of the picture that is masked by mistake.

    Args:
        results: results of the samples of one dataset.
        has_patch: whether the dataset contains a patch.
    """
    masks = [result.mask for result in results if result.mask is not None]
    scores = [result.score for result in results if result.score is not None]
    alarms = {ALARMS: float(np.mean(np.array(scores) > ALARM))} if scores else {}
    keys = [key for key in (masks[0] if masks else {}) if key == "mask_area" or has_patch]
    return {key: _known_mean([mask[key] for mask in masks]) for key in keys} | alarms


def drive_note(dataset: Dataset[Any]) -> str | None:
    """Returns a warning if the samples are frames of sequences, because intervals and tests treat them as independent;
    otherwise None.

    Args:
        dataset: the dataset.

    Returns:
        The line of text; None if the samples are single pictures.
    """
    last = dataset.sidecar(-1).record
    if not last.frame:
        return None
    drives = last.sequence + 1
    return (
        f"{dataset.root}: {len(dataset)} samples are frames of {drives} drive{'s' * (drives > 1)}, each like the one "
        "before; intervals are too narrow and p too small for more than these frames"
    )


def together(rows: Sequence[EvaluatedDataset]) -> Iterable[CombinedRow]:
    """Combines datasets of several scenes or weathers that have patches with the same label, and yields one result per
    label. Labels with a single dataset, and datasets with different task options, are left out.

    Args:
        rows: all evaluated datasets.
    """
    for patch, members in labelled(rows).items():
        one = as_one(patch, members)
        yield CombinedRow(
            patch=patch,
            rows=tuple(row.name for row in members),
            samples=len(one.results),
            metrics=metrics_of(one),
        )


def labelled(rows: Sequence[EvaluatedDataset]) -> dict[str, list[EvaluatedDataset]]:
    """The datasets that `together` combines, by the label of their patches.

    Args:
        rows: all evaluated datasets.
    """
    groups: dict[str, list[EvaluatedDataset]] = {}
    for row in rows:
        groups.setdefault(row.patch, []).append(row)
    return {
        patch: members
        for patch, members in groups.items()
        if len(members) > 1 and all(row.dataset.plan.options == members[0].dataset.plan.options for row in members)
    }


def metrics_of(row: EvaluatedDataset) -> dict[str, dict[str, Estimate]]:
    """Returns the metrics over all samples of a dataset with their 95 % intervals.

    Args:
        row: the evaluated dataset.

    Returns:
        The estimates by name of the report (a group of metrics) and name of the metric.
    """
    metrics = {}
    for report in row.scorer.reports:
        one = row.gathered(report)
        metrics[report] = {
            name: Estimate(
                value=value,
                interval=one.interval(name),
                ceiling=one.ceilings.get(name, 1.0),
                is_from_few=_are_few(row.streets),
            )
            for name, value in one.overall.items()
        }
    return metrics


def as_one(name: str, members: Sequence[EvaluatedDataset]) -> EvaluatedDataset:
    """Combines several evaluated datasets into one; its other properties, such as task and reports, are those of the
    first dataset.

    Args:
        name: name of the new row.
        members: the datasets.
    """
    results = [result for row in members for result in row.results]
    streets = [street for row in members for street in row.streets]
    return replace(members[0], name=name, results=results, streets=streets, known={})


def compared(rows: Sequence[EvaluatedDataset], seed: int) -> Iterable[Difference]:
    """Yields the difference between every dataset with a patch and its twins, the same samples without a patch and
    with a random patch.

    Args:
        rows: all evaluated datasets.
        seed: seed of the permutation tests.
    """
    for row, other in twin_pairs(rows):
        yield difference(row, other, seed)


def twin_pairs(rows: Sequence[EvaluatedDataset]) -> list[tuple[EvaluatedDataset, EvaluatedDataset]]:
    """The datasets that `compared` compares: each with its twins without a patch and with a random patch.

    Args:
        rows: all evaluated datasets.
    """
    return [
        (row, other)
        for row in rows
        for control in CONTROLS[: CONTROLS.index(row.patch) if row.patch in CONTROLS else len(CONTROLS)]
        for other in rows
        if other.patch == control and other.dataset.plan.twin_key == row.dataset.plan.twin_key
    ]


def difference(row: EvaluatedDataset, other: EvaluatedDataset, seed: int) -> Difference:
    """Computes the metrics of a dataset minus those of its twin, over the samples that both have.

    Args:
        row: the dataset.
        other: its twin: the same samples with another patch.
        seed: seed of the permutation tests.
    """
    count = min(len(row.results), len(other.results))
    patched, twin, streets = row.results[:count], other.results[:count], row.streets[:count]
    return Difference(
        row=row.name,
        against=other.name,
        metrics={
            report: _paired(row.gathered(report, count), other.gathered(report, count), is_from_few=_are_few(streets))
            for report in row.scorer.reports
        },
        auroc=_auroc(patched, twin, streets),
        paired={report: _tested(patched, twin, streets, report, seed) for report in row.scorer.reports},
        objects=_objects(patched, twin, streets, seed),
    )


def _objects(
    patched: list[SampleResult], twin: list[SampleResult], streets: list[Street], seed: int
) -> ObjectChanges | None:
    """Returns how the detections of each object differ between twins; None for tasks without objects."""
    outcomes, twins = (
        [result.outcomes for result in results if result.outcomes is not None] for results in (patched, twin)
    )
    return object_changes([result.index for result in patched], outcomes, twins, streets, seed) if outcomes else None


def _are_few(streets: Sequence[Street]) -> bool:
    """Whether there are too few different streets for intervals that hold what they promise."""
    return len(set(streets)) < FEWEST_CLUSTERS


def _paired(one: Metrics, other: Metrics, *, is_from_few: bool) -> dict[str, Estimate]:
    found = {}
    for name in one.overall:
        if name in other.overall:
            change = one.overall[name] - other.overall[name]
            interval = difference_interval(one, other, name)
            found[name] = Estimate(value=change, interval=interval, is_from_few=is_from_few)
    return found


def _tested(
    patched: list[SampleResult], twin: list[SampleResult], streets: list[Street], report: str, seed: int
) -> dict[str, PairedTest]:
    """Returns a paired test for every metric of the report that is defined for single samples."""
    names = list(dict.fromkeys(name for result in patched for name in result.metrics[report]))
    ours, theirs = (
        np.array([[result.metrics[report].get(name, np.nan) for name in names] for result in results], np.float64)
        for results in (patched, twin)
    )
    differences = _finite(ours) - _finite(theirs)
    found = paired_p(clustered(differences, streets), seed)
    return {
        name: PairedTest(mean=_known_mean(values), p=float(p), pairs=int(np.isfinite(values).sum()))
        for name, values, p in zip(names, differences.T, found, strict=True)
    }


def _auroc(patched: list[SampleResult], twin: list[SampleResult], streets: list[Street]) -> Estimate | None:
    high = [result.score for result in patched if result.score is not None]
    low = [result.score for result in twin if result.score is not None]
    if len(high) != len(patched) or len(low) != len(twin):
        return None
    interval = auroc_interval(high, low, streets)
    return Estimate(value=auroc(high, low), interval=interval, is_from_few=_are_few(streets))


def _finite(values: Values) -> Values:
    return np.where(np.isfinite(values), values, np.nan)


def _known_mean(values: Sequence[float]) -> float:
    known = [value for value in values if value == value]
    return float(np.mean(known)) if known else float("nan")
