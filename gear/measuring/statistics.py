"""Uncertainty of metrics: confidence intervals by the jackknife, and a permutation test for paired samples.

The samples of one street form a cluster: they are left out together, and the signs of their differences are flipped
together.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from gear.contracts.evaluation import Additive, Counting, Draws, Limited, Ranged, Resampled
from gear.contracts.tasks import Evaluator
from gear.measuring.intervals import (
    LEFT_OUT,
    REAL,
    Interval,
    Values,
    combined_interval,
    interval_at_limit,
    is_constant,
    jackknife_interval,
    leave_one_out,
    numbered,
    separated_interval,
)
from gear.values.rng import derive_rng

FLIPS = 9_999
"""Number of sign patterns that the test draws if there are too many to try all; the smallest possible p is 0.0001."""

FLIPS_AT_ONCE = 1_000
"""Number of sign patterns that the test processes at a time, which bounds its memory."""

SHARE = (0.0, 1.0)
"""Range of a share."""

ROUNDING = 1e-9
"""Relative difference up to which two sums of differences count as equal."""

AnyEvaluator = Evaluator[Any, Any]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Metrics:
    """The metrics of one report over one dataset.

    Attributes:
        overall: metrics over all samples, by name.
        replicates: (C,) values of a metric, each computed without one of the C clusters, by name of the metric.
        ceilings: values that perfect predictions of the same samples would reach, for metrics where this is below 1.
        limits: smallest and largest possible value of a metric, by name, if the evaluator states them.
        support: number of clusters that show what a metric is about, by name, for shares that are exactly 0 or 1 and
            for counts that are 0, with and without each cluster. For example, the AP of a class rests on the clusters
            that show the class.
    """

    overall: Mapping[str, float]
    replicates: Mapping[str, Values]
    ceilings: Mapping[str, float]
    limits: Mapping[str, Interval] = field(default_factory=dict)
    support: Mapping[str, int] = field(default_factory=dict)

    def interval(self, name: str) -> Interval | None:
        """The lower and upper end of a metric's 95 % confidence interval.

        Metrics that `support` names have exact intervals (`interval_at_limit`); all others have intervals by the
        jackknife.

        Args:
            name: name of the metric.

        Returns:
            The ends; None if they are undefined: there are no replicates, there are fewer than two clusters, the metric
            is undefined without one of them, or the metric and all replicates lie at one of its limits. For example, an
            error of 0 on all samples does not tell how large the error is on others.
        """
        if name not in self.replicates:
            return None
        value, limits = self.overall[name], self.limits.get(name, REAL)
        if name in self.support:
            return interval_at_limit(value, self.support[name], limits)
        interval = jackknife_interval(value, self.replicates[name], limits)
        return None if interval == (value, value) and value in limits else interval


def difference_interval(one: Metrics, other: Metrics, name: str) -> Interval | None:
    """The 95 % confidence interval of the difference of a metric between two datasets with the same scenes.

    Each jackknife replicate leaves the same cluster out of both datasets, so the interval is that of the paired
    difference. If one of the metrics is a share of exactly 0 or 1, its replicates show no spread, and the interval is
    combined from the intervals of both.

    Args:
        one, other: metrics of the two datasets with their jackknife replicates.
        name: name of the metric.

    Returns:
        Lower and upper end of `one` minus `other`; None if a metric has no replicates or no interval, or if it is
        undefined without one of the clusters.
    """
    if name not in one.replicates or name not in other.replicates:
        return None
    if name in one.support or name in other.support:
        ends, other_ends = one.interval(name), other.interval(name)
        if ends is None or other_ends is None:
            return None
        return combined_interval(one.overall[name], ends, other.overall[name], other_ends)
    here, there = one.limits.get(name, REAL), other.limits.get(name, REAL)
    with np.errstate(invalid="ignore"):  # inf - inf is NaN: such a metric has no interval
        replicates = one.replicates[name] - other.replicates[name]
    limits = (here[0] - there[1], here[1] - there[0])
    return jackknife_interval(one.overall[name] - other.overall[name], replicates, limits)


def gather(
    fresh: Callable[[], AnyEvaluator],
    parts: Sequence[AnyEvaluator],
    draws: Draws,
    held: Callable[[Any], dict[str, float]] = dict,
) -> Metrics:
    """Merges evaluators of single samples and computes their metrics, with the replicates for intervals.

    Args:
        fresh: returns a new, empty evaluator.
        parts: one evaluator for each sample, in order.
        draws: (R, N) indices of samples, padded with `LEFT_OUT`; one replicate is computed from each row.
        held: checks the metrics that an evaluator returns.
    """
    whole = fresh()
    for part in parts:
        whole.merge(part)
    overall = held(whole.result())
    ceilings = dict(whole.ceilings()) if isinstance(whole, Limited) else {}
    limits = {name: whole.range_of(name) for name in overall} if isinstance(whole, Ranged) else {}
    replicates = _replicates(fresh, whole, parts, draws, overall)
    counted = whole.counted() if isinstance(whole, Counting) else frozenset()
    at_limit = [
        name
        for name, values in replicates.items()
        if len(values) > 1 and is_constant(values) and _is_at_limit(overall[name], limits.get(name), name in counted)
    ]
    support = {}
    if at_limit:
        alone = _replicates(fresh, whole, parts, _complement(draws), at_limit)
        support = {name: max(1, int(np.isfinite(alone[name]).sum())) for name in at_limit}
    return Metrics(overall=overall, replicates=replicates, ceilings=ceilings, limits=limits, support=support)


def _is_at_limit(value: float, limits: Interval | None, is_count: bool) -> bool:
    """Whether a metric has an exact interval: a share of 0 or 1, or a number of events of 0."""
    return value in SHARE if limits == SHARE else is_count and value == 0


def _complement(draws: Draws) -> Draws:
    """(R, N) indices of the samples that each row of `draws` leaves out, padded with `LEFT_OUT`."""
    left_out = np.full_like(draws, LEFT_OUT)
    for row, drawn in zip(left_out, draws, strict=True):
        missing = np.setdiff1d(np.arange(draws.shape[1]), drawn)
        row[: len(missing)] = missing
    return left_out


def _replicates(
    fresh: Callable[[], AnyEvaluator],
    whole: AnyEvaluator,
    parts: Sequence[AnyEvaluator],
    draws: Draws,
    names: Iterable[str],
) -> dict[str, Values]:
    """(R,) metrics over each row of `draws`, which may be padded with `LEFT_OUT`; NaN where a metric is undefined."""
    replicates: dict[str, Values] = {}
    counts = (draws != LEFT_OUT).sum(axis=1)
    for count in np.unique(counts):  # evaluators want as many samples in every draw
        rows = np.flatnonzero(counts == count)
        block = draws[rows]
        block = block[block != LEFT_OUT].reshape(len(rows), count)
        for name, values in _of_equal_size(fresh, whole, parts, block, names).items():
            replicates.setdefault(name, np.full(len(draws), np.nan))[rows] = values
    return replicates


def _of_equal_size(
    fresh: Callable[[], AnyEvaluator],
    whole: AnyEvaluator,
    parts: Sequence[AnyEvaluator],
    draws: Draws,
    names: Iterable[str],
) -> Mapping[str, Values]:
    """(R,) metrics over each draw, by the fastest method that the evaluator supports."""
    if isinstance(whole, Resampled):
        return whole.resampled(draws)
    if isinstance(whole, Additive):
        return whole.metrics(_added(parts, draws))
    rows = []
    for drawn in draws:
        one = fresh()
        for index in drawn:
            one.merge(parts[index])
        rows.append(one.result())
    return {name: np.array([row.get(name, np.nan) for row in rows]) for name in names}


def _added(parts: Sequence[Any], draws: Draws) -> dict[str, npt.NDArray[Any]]:
    """The sums over each draw: the sums of each sample times its frequency in the draw."""
    often = np.zeros((len(draws), len(parts)))
    np.add.at(often, (np.arange(len(draws))[:, None], draws), 1)
    every = [part.totals() for part in parts]
    # Whole numbers stay exact in float64 up to 2**53, more pixels than any dataset has.
    stacked = {name: np.stack([one[name] for one in every]).astype(np.float64) for name in every[0]}
    return {name: np.tensordot(often, sums, 1) for name, sums in stacked.items()}


def auroc(positives: Sequence[float], negatives: Sequence[float]) -> float:
    """The area under the ROC curve: the share of pairs in which the positive sample scores above the negative one.

    Ties count half.

    Args:
        positives: scores of samples with the patch.
        negatives: scores of samples without the patch.

    Returns:
        The area in 0..1; NaN without positives or negatives.
    """
    if not len(positives) or not len(negatives):
        return float("nan")
    ranked = np.sort(np.asarray(negatives))
    below, not_above = (int(np.searchsorted(ranked, positives, side).sum()) for side in ("left", "right"))
    pairs = len(positives) * len(negatives)
    return below / pairs + 0.5 * ((not_above - below) / pairs)


def auroc_interval(
    positives: Sequence[float], negatives: Sequence[float], clusters: Sequence[Hashable]
) -> Interval | None:
    """The 95 % confidence interval of the area under the ROC curve, by the jackknife over clusters.

    Args:
        positives, negatives: (N,) scores of the same N scenes with and without the patch.
        clusters: the cluster of each scene.

    Returns:
        Lower and upper end; None for fewer than two clusters, or if the area is undefined without one of them.
    """
    high, low = np.asarray(positives, np.float64), np.asarray(negatives, np.float64)
    kept = [row[row != LEFT_OUT] for row in leave_one_out(clusters)]
    value = auroc(positives, negatives)
    if len(kept) > 1 and value in (0.0, 1.0):
        return separated_interval(value, len(kept))
    replicates = np.array([auroc(high[row], low[row]) for row in kept])
    return jackknife_interval(value, replicates, (0.0, 1.0), lost_degrees=1)  # 2 covers 97.8 % of eight scenes


def clustered(differences: Values, clusters: Sequence[Hashable]) -> Values:
    """Adds up differences within each cluster of samples, as the input of `paired_p`.

    The test flips the sign of a whole cluster, because the samples of a cluster are not independent.

    Args:
        differences: (N, F) differences of N samples and F metrics; NaN if a sample has none.
        clusters: the cluster of each sample.

    Returns:
        (C, F) sums. A sum is NaN if all differences of the cluster are NaN, and 0 if it differs from 0 only by
        rounding.
    """
    owners = numbered(clusters)
    known = np.where(np.isnan(differences), 0.0, differences)
    sums, sizes, counts = (np.zeros((owners.max(initial=-1) + 1, differences.shape[1])) for _ in range(3))
    for total, values in ((sums, known), (sizes, np.abs(known)), (counts, ~np.isnan(differences))):
        np.add.at(total, owners, values)
    return np.where(counts > 0, np.where(np.abs(sums) > ROUNDING * sizes, sums, 0.0), np.nan)


def paired_p(differences: Values, seed: int) -> Values:
    """Two-sided p-value of the mean of paired differences, by a sign-flip permutation test.

    Under the null hypothesis each difference is equally likely with either sign. p is the share of all sign patterns
    for which the mean is at least as far from 0 as the observed one (Fisher, The Design of Experiments, 1935, sec. 21).
    With up to 13 pairs all patterns are tried and p is exact. With more pairs, `FLIPS` patterns are drawn and the
    observed pattern is counted as well, so p is never too small (Phipson and Smyth, 2010). In contrast to Wilcoxon's
    test, this test is about the mean, which is the reported number, and it handles ties.

    Args:
        differences: (N, F) differences, one column per metric; NaN if a sample has none. If samples are not
            independent, these are sums over clusters (`clustered`).
        seed: seed of the drawn patterns.

    Returns:
        (F,) p-values in 0..1; NaN if all differences are NaN.
    """
    is_known = ~np.isnan(differences)
    pairs = is_known.sum(axis=0)
    found = np.where(pairs > 0, _as_far(np.where(is_known, differences, 0.0), seed), np.nan)
    if not _is_exact(len(differences)):
        for metric in np.flatnonzero(pairs):
            if _is_exact(int(pairs[metric])):
                found[metric] = _as_far(differences[is_known[:, metric], metric, None], seed)[0]
    return found


def _as_far(known: Values, seed: int) -> Values:
    """(F,) shares of the sign patterns of (N, F) numbers for which the sums are at least as far from 0 as the observed
    ones.
    """
    least = np.abs(known.sum(axis=0)) - ROUNDING * np.abs(known).sum(axis=0)
    as_far, tried = np.zeros(known.shape[1]), 0
    for signs in _sign_patterns(len(known), seed):
        as_far += (np.abs(signs @ known) >= least).sum(axis=0)
        tried += len(signs)
    return np.asarray(as_far / tried)


def _is_exact(count: int) -> bool:
    """Whether a number of pairs is small enough for all sign patterns to be tried."""
    return count < FLIPS.bit_length()


def _sign_patterns(count: int, seed: int) -> Iterator[Values]:
    """Yields blocks of (R, count) values -1 and 1: all patterns, or the one without a flip and `FLIPS` drawn ones."""
    if _is_exact(count):
        flipped = np.arange(2**count)[:, None] >> np.arange(count) & 1
        yield np.asarray(1 - 2 * flipped, np.float64)
        return
    yield np.ones((1, count))
    rng = derive_rng(seed, "sign flips", count)
    for begin in range(0, FLIPS, FLIPS_AT_ONCE):
        flipped = rng.integers(0, 2, (min(FLIPS_AT_ONCE, FLIPS - begin), count))
        yield np.asarray(1 - 2 * flipped, np.float64)
