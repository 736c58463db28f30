"""95 % confidence intervals of metrics by the jackknife: the change of a metric when one street is left out.

The samples of one street form a cluster, because they are not independent. The metric is computed once without each
cluster. The spread of these replicates gives the standard error (Tukey, 1958; Efron and Stein, Annals of Statistics
1981). Student's t gives the width, with degrees of freedom for replicates of unequal weight (Satterthwaite, Biometrics
1946). One more degree is subtracted because the skewness is estimated as well: without this, the intervals of six
pictures with a skewness of 3.7 contain the true value in 91 % of the cases instead of 92.5 %. Hall's transformation
(Journal of the Royal Statistical Society B, 1992) corrects for skewness: errors in metres have a long tail to the
right, and shares near 1 a long tail to the left, so the interval is longer on that side.

The bootstrap is not used, because a mean over classes, such as mIoU or mAP, leaves out classes that no drawn sample
shows. Resamples show fewer classes than the dataset, so bootstrap percentiles are biased, and they are too narrow for
few streets. docs/results/intervals.md shows how often the intervals of several methods contain a known true value in
simulations (`benchmarks/coverage.py`).

The interval is valid for the classes that the dataset shows, and not for any other classes.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence

import numpy as np
import numpy.typing as npt

from gear.contracts.evaluation import Draws

LEFT_OUT = -1
"""Value in the index arrays of the jackknife that stands for no sample; rows are padded with it."""

MOST_GROUPS = 500
"""Largest number of jackknife replicates. If there are more clusters, each replicate leaves out a group of clusters
(delete-a-group jackknife).
"""

FEWEST_CLUSTERS = 3
"""Smallest number of clusters for which intervals cover the true value in at least 92 % of simulated datasets.

With two clusters they cover it in 72 % (AUROC) to 94 % (mIoU) of them (`benchmarks/coverage.py`,
docs/results/intervals.md), so tables mark these intervals.
"""

CONFIDENCE = 0.95

REAL = (-math.inf, math.inf)
"""Range (smallest value, largest value) of a metric without bounds."""

NEGLIGIBLE = 1e-12
"""Largest relative difference between jackknife replicates that is attributed to rounding."""

Values = npt.NDArray[np.float64]
Interval = tuple[float, float]


def numbered(clusters: Sequence[Hashable]) -> npt.NDArray[np.int64]:
    """The (N,) cluster numbers of N samples: clusters are numbered from 0 in the order of their first sample."""
    known: dict[Hashable, int] = {}
    return np.array([known.setdefault(one, len(known)) for one in clusters], np.int64)


def leave_one_out(clusters: Sequence[Hashable]) -> Draws:
    """Index sets for the jackknife: each row holds the indices of all samples outside one cluster.

    Args:
        clusters: the cluster of each of the N samples.

    Returns:
        (C, N) indices, padded with `LEFT_OUT`: one row per cluster, or per group of clusters if there are more than
        `MOST_GROUPS`. There are no rows for fewer than two clusters, whose spread is unknown.
    """
    owners = numbered(clusters) % MOST_GROUPS
    count = int(owners.max(initial=-1)) + 1
    rows = np.full((count if count > 1 else 0, len(owners)), LEFT_OUT, np.int64)
    for group, row in enumerate(rows):
        kept = np.flatnonzero(owners != group)
        row[: len(kept)] = kept
    return rows


def jackknife_interval(
    value: float, replicates: Values, limits: Interval = REAL, *, lost_degrees: int = 2
) -> Interval | None:
    """The 95 % confidence interval of a metric.

    If all replicates are equal, both ends are the metric's value itself; see `interval_at_limit`.

    Args:
        value: the metric over all samples.
        replicates: (C,) values of the metric, each computed without one of the C clusters.
        limits: smallest and largest possible value of the metric, to which the interval is clipped.
        lost_degrees: number of degrees of freedom that are subtracted from the number of clusters: 2 for estimating
            mean and skewness, 1 for estimating the mean alone.

    Returns:
        Lower and upper end; None for fewer than two clusters, or if the metric is undefined without one of them.
    """
    count = len(replicates)
    if count < 2 or not math.isfinite(value) or not np.isfinite(replicates).all():
        return None
    if is_constant(replicates):
        return value, value
    changes = replicates.mean() - replicates  # a cluster with a large metric has a positive change
    squares = np.square(changes)
    error = math.sqrt((count - 1) / count * squares.sum())
    skewness = float((changes**3).mean() / squares.mean() ** 1.5) / math.sqrt(count)
    reach = _students_t(_degrees_of_freedom(squares, lost_degrees))
    below, above = _unskewed(reach, skewness) * error, _unskewed(-reach, skewness) * error
    return max(limits[0], value - below), min(limits[1], value - above)


def is_constant(replicates: Values) -> bool:
    """Whether replicates are finite and differ by no more than rounding."""
    if not np.isfinite(replicates).all():
        return False
    return bool(np.abs(replicates - replicates.mean()).max() <= NEGLIGIBLE * np.abs(replicates).max())


def _unskewed(quantile: float, skewness: float) -> float:
    """The inverse of Hall's transformation, which maps a quantile of Student's t to a quantile of the studentised mean
    of a skewed distribution.

    Hall's transformation of a studentised mean T is monotone and nearly free of skewness:

        g(T) = T + a T² / 3 + a² T³ / 27 + a / 6.

    Args:
        quantile: the quantile x of Student's t.
        skewness: a, the sample skewness divided by the square root of the number of clusters.

    Returns:
        T with g(T) = x, which is 3 ((1 + a (x - a / 6))^(1/3) - 1) / a, and x itself for a = 0.
    """
    step = skewness * (quantile - skewness / 6)
    if abs(step) < NEGLIGIBLE:
        return quantile
    return 3 * (math.expm1(math.log1p(step) / 3) if step > -1 else float(np.cbrt(1 + step)) - 1) / skewness


def _degrees_of_freedom(squares: Values, lost: int) -> float:
    """Satterthwaite's degrees of freedom from (C,) squared deviations d² of replicates; at least 1, at most C - lost.

    The variance is the sum of d²; its own variance is, for normal d, two thirds of the sum of d⁴. So the degrees of
    freedom, 2 variance² / Var(variance), are 3 (sum of d²)² / (sum of d⁴), minus 3 because deviations from a mean are
    not independent. If more than one degree is lost, the others are subtracted from this number, too.
    """
    effective = float(squares.sum() ** 2 / np.square(squares).sum())
    return max(1.0, min(float(len(squares) - lost), 3 * (effective - 1) - (lost - 1)))


def _students_t(degrees: float) -> float:
    from scipy import stats

    return float(stats.t.ppf(0.5 + CONFIDENCE / 2, degrees))


def separated_interval(value: float, clusters: int) -> Interval:
    """The 95 % confidence interval of an area under the ROC curve that is exactly 0 or 1.

    All jackknife replicates are equal in this case, so their spread cannot be used. The end a of the interval solves

        |A - a| = z sqrt(V(a)).

    A is the area. V is Hanley and McNeil's variance, with the number of clusters as both sample sizes (Newcombe,
    Statistics in Medicine 2006, method 5).

    Args:
        value: the area A, 0 or 1.
        clusters: number of clusters of samples.
    """
    from scipy import optimize, stats

    z, pairs = float(stats.norm.ppf(0.5 + CONFIDENCE / 2)), max(clusters, 1)

    def excess(missing: float) -> float:
        area = 1 - missing
        more = (pairs - 1) * ((1 - area) / (2 - area) + area / (1 + area))
        return float(missing**2 - z**2 * area * missing * (1 + more) / pairs**2)

    reach = float(optimize.brentq(excess, 1e-9, 1.0))
    return (1 - reach, 1.0) if value > 0.5 else (0.0, reach)


def interval_at_limit(value: float, clusters: int, limits: Interval) -> Interval:
    """The 95 % confidence interval of a share that is 0 or 1, or of a number per picture that is 0. All jackknife
    replicates are equal in this case, so their spread cannot be used.

    A share of 0 or 1 has the exact interval of Clopper and Pearson (Biometrika 1934), in which each cluster counts as
    one trial. It also holds for a mean of values in 0..1, such as an IoU: a cluster is at the limit with a probability
    of at most the mean's distance from the other limit. A number per picture of 0 has the exact upper end of a Poisson
    mean (Garwood, Biometrika 1936), 3.69 per cluster. Both are conservative where samples of one cluster are less
    alike.

    Args:
        value: 0 or 1.
        clusters: number of clusters on which the metric rests, at least 1.
        limits: smallest and largest possible value: 0 and 1 of a share, 0 and infinity of a number per picture.
    """
    from scipy import stats

    tail = (1 - CONFIDENCE) / 2
    if not math.isfinite(limits[1]):
        return 0.0, float(stats.chi2.isf(tail, 2)) / 2 / clusters
    reach = float(stats.beta.isf(tail, 1, clusters))
    return (1 - reach, 1.0) if value > 0.5 else (0.0, reach)


def combined_interval(one: float, one_ends: Interval, other: float, other_ends: Interval) -> Interval:
    """The 95 % confidence interval of the difference of two metrics, from the interval of each.

    The distances to the ends are added as squares, as for independent estimates (Newcombe, Statistics in Medicine 1998,
    method 10). For metrics of the same scenes, which mostly rise and fall together, the interval is conservative.

    Args:
        one, other: values of the metric in the two datasets.
        one_ends, other_ends: ends of their intervals.
    """
    below = math.hypot(one - one_ends[0], other_ends[1] - other)
    above = math.hypot(one_ends[1] - one, other - other_ends[0])
    return one - other - below, one - other + above
