"""How sure a metric is: bootstrap over samples (Efron 1979), 95 % by percentiles; sign flips for pairs of samples.

Samples that show the same street are a cluster: they are drawn, and their differences flipped, together.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from gear.contracts.evaluation import Additive, Draws, Limited, Resampled
from gear.contracts.tasks import Evaluator
from gear.values.rng import derive_rng

PERCENTILES = (2.5, 97.5)

FLIPS = 9_999
"""Ways of flipping signs that are drawn where there are more: the smallest p is then 0.0001."""

FLIPS_AT_ONCE = 1_000
"""Bounds the memory that a test takes."""

ROUNDING = 1e-9
"""Sums that differ by less than this share of what they are made of are equal."""

FILLED = -1
"""Where a draw of clusters comes to fewer samples than another one, in place of a sample's number."""

AnyEvaluator = Evaluator[Any, Any]
Values = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Metrics:
    """The metrics of one evaluator over one dataset.

    Attributes:
        overall: over all samples.
        spread: (R,) over resampled ones, for the metrics that have any.
        ceilings: what perfect predictions would come to, where that is less than 1.
    """

    overall: Mapping[str, float]
    spread: Mapping[str, Values]
    ceilings: Mapping[str, float]

    def interval(self, name: str) -> tuple[float, float] | None:
        """Bounds of 95 %, or None where there is nothing to tell."""
        return bounds(self.spread[name]) if name in self.spread else None


def draw(count: int, resamples: int, seed: int) -> Draws:
    """(resamples, count) numbers of samples; the same for every dataset of this size, so that twins stay paired.

    (0, count) of fewer than two samples: one does not say how far others lie from it.
    """
    rows = resamples if count > 1 else 0
    return derive_rng(seed, "bootstrap", count).integers(0, max(count, 1), (rows, count), dtype=np.int64)


def draw_clusters(clusters: Sequence[Hashable], resamples: int, seed: int) -> Draws:
    """(resamples, N) numbers of samples: clusters are drawn, and with each all of its samples (Field and Welsh 2007).

    Where no two samples are of one cluster, this is `draw`. Where clusters differ in size, so do draws: `FILLED` is not
    a sample.

    Args:
        clusters: of each sample, the one that it belongs to.
        resamples: so many draws.
        seed: of them.
    """
    owners = _numbered(clusters)
    sizes = np.bincount(owners)
    members = np.full((len(sizes), sizes.max(initial=0)), FILLED, np.int64)
    members[np.arange(members.shape[1]) < sizes[:, None]] = np.argsort(owners, kind="stable")
    drawn = draw(len(members), resamples, seed)
    return members[drawn].reshape(len(drawn), members.size)


def _numbered(clusters: Sequence[Hashable]) -> npt.NDArray[np.int64]:
    """Their numbers, in the order in which they first occur."""
    known: dict[Hashable, int] = {}
    return np.array([known.setdefault(one, len(known)) for one in clusters], np.int64)


def gather(
    fresh: Callable[[], AnyEvaluator],
    parts: Sequence[AnyEvaluator],
    draws: Draws,
    held: Callable[[Any], dict[str, float]] = dict,
) -> Metrics:
    """Metrics over evaluators that have seen one sample each.

    Args:
        fresh: makes an empty evaluator.
        parts: in order of samples.
        draws: (R, N), as drawn.
        held: takes what an evaluator says of all parts, and holds it to the contract.
    """
    whole = fresh()
    for part in parts:
        whole.merge(part)
    overall = held(whole.result())
    ceilings = dict(whole.ceilings()) if isinstance(whole, Limited) else {}
    if not draws.size:
        return Metrics(overall=overall, spread={}, ceilings=ceilings)
    spread: dict[str, Values] = {}
    counts = (draws != FILLED).sum(axis=1)
    for count in np.unique(counts):  # evaluators want as many samples in every draw
        rows = np.flatnonzero(counts == count)
        block = draws[rows]
        block = block[block != FILLED].reshape(len(rows), count)
        for name, values in _spread(fresh, whole, parts, block, overall).items():
            spread.setdefault(name, np.full(len(draws), np.nan))[rows] = values
    return Metrics(overall=overall, spread=spread, ceilings=ceilings)


def _spread(
    fresh: Callable[[], AnyEvaluator],
    whole: AnyEvaluator,
    parts: Sequence[AnyEvaluator],
    draws: Draws,
    names: Iterable[str],
) -> Mapping[str, Values]:
    """(R,) metrics over each draw, by the quickest way that the evaluator of all parts has."""
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
    """The sums over each draw: how often it has a picture, times the picture's own."""
    often = np.zeros((len(draws), len(parts)))
    np.add.at(often, (np.arange(len(draws))[:, None], draws), 1)
    every = [part.totals() for part in parts]
    # Whole numbers stay exact in float64 up to 2**53, which is more pixels than anybody has.
    stacked = {name: np.stack([one[name] for one in every]).astype(np.float64) for name in every[0]}
    return {name: np.tensordot(often, sums, 1) for name, sums in stacked.items()}


def bounds(values: Values) -> tuple[float, float] | None:
    """Bounds of 95 % of the known values."""
    known = values[np.isfinite(values)]
    if not len(known):
        return None
    low, high = np.percentile(known, PERCENTILES)
    return float(low), float(high)


def auroc(positives: Sequence[float], negatives: Sequence[float]) -> float:
    """Area under the ROC curve: how often a positive's score is above a negative's, ties half; NaN without either."""
    if not len(positives) or not len(negatives):
        return float("nan")
    ranked = np.sort(np.asarray(negatives))
    below, not_above = (int(np.searchsorted(ranked, positives, side).sum()) for side in ("left", "right"))
    pairs = len(positives) * len(negatives)
    return below / pairs + 0.5 * ((not_above - below) / pairs)


def auroc_interval(positives: Sequence[float], negatives: Sequence[float], draws: Draws) -> tuple[float, float] | None:
    """Its bounds over the pairs of twins that `draws` chooses."""
    high, low = np.asarray(positives), np.asarray(negatives)
    known = [drawn[drawn != FILLED] for drawn in draws]
    return bounds(np.array([auroc(high[drawn], low[drawn]) for drawn in known]))


def clustered(differences: Values, clusters: Sequence[Hashable]) -> Values:
    """(C, F) sums over the clusters of (N, F) differences, for `paired_p`: the signs of one cluster flip together.

    NaN where no difference of a cluster is known; what only rounding keeps from 0 is 0.
    """
    owners = _numbered(clusters)
    known = np.where(np.isnan(differences), 0.0, differences)
    sums, sizes, counts = (np.zeros((owners.max(initial=-1) + 1, differences.shape[1])) for _ in range(3))
    for total, values in ((sums, known), (sizes, np.abs(known)), (counts, ~np.isnan(differences))):
        np.add.at(total, owners, values)
    return np.where(counts > 0, np.where(np.abs(sums) > ROUNDING * sizes, sums, 0.0), np.nan)


def paired_p(differences: Values, seed: int) -> Values:
    """Two-sided p of the mean of paired differences, by flipping their signs.

    Were it all the same which of two twins a sample is of, each difference would be as likely with the other sign. p is
    the share of all sign patterns that bring the mean at least as far from 0 as it is (Fisher, The Design of
    Experiments, 1935, sec. 21). Up to 13 pairs every pattern is tried: p is exact. Beyond, `FLIPS` are drawn, and the
    pattern that was found is counted with them, so that p is never 0 and never too small (Phipson and Smyth 2010).
    Unlike Wilcoxon's test this looks at the mean, which is what is reported, and has no trouble with ties.

    Args:
        differences: (N, F), a column a metric; NaN where a sample has no value and does not count. Where some of them
            are not independent, of clusters (`clustered`).
        seed: of the drawn patterns.

    Returns:
        (F,) in 0..1; NaN where no difference is known.
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
    """(F,) shares of the sign patterns of (N, F) numbers that bring their sums at least as far from 0 as they are."""
    least = np.abs(known.sum(axis=0)) - ROUNDING * np.abs(known).sum(axis=0)
    as_far, tried = np.zeros(known.shape[1]), 0
    for signs in _sign_patterns(len(known), seed):
        as_far += (np.abs(signs @ known) >= least).sum(axis=0)
        tried += len(signs)
    return np.asarray(as_far / tried)


def _is_exact(count: int) -> bool:
    """Whether so many pairs have few enough sign patterns to try them all."""
    return count < FLIPS.bit_length()


def _sign_patterns(count: int, seed: int) -> Iterator[Values]:
    """Blocks of (R, count) of -1 and 1: all patterns, or the one without a flip and `FLIPS` drawn ones."""
    if _is_exact(count):
        flipped = np.arange(2**count)[:, None] >> np.arange(count) & 1
        yield np.asarray(1 - 2 * flipped, np.float64)
        return
    yield np.ones((1, count))
    rng = derive_rng(seed, "sign flips", count)
    for begin in range(0, FLIPS, FLIPS_AT_ONCE):
        flipped = rng.integers(0, 2, (min(FLIPS_AT_ONCE, FLIPS - begin), count))
        yield np.asarray(1 - 2 * flipped, np.float64)
