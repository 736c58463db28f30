"""Intervals of 95 % by the jackknife: how far a metric moves when one street is left out.

A metric of a dataset is computed again without each cluster of samples in turn (samples of one street are a cluster,
since they are not independent). The spread of these replicates gives the standard error (Tukey, 1958; Efron and
Stein, Annals of Statistics 1981), and Student's t the width, with the degrees of freedom that suit replicates of
unequal weight (Satterthwaite, Biometrics 1946).

Why no bootstrap: a mean over classes, such as mIoU or mAP, leaves out classes that no drawn sample shows. Resamples
show fewer classes than the dataset does, so their percentiles are biased, and they are too narrow for few streets. In
simulations with a known truth (docs/results/intervals.md, `benchmarks/coverage.py`) percentiles of 95 % cover 80 to
94 % for mIoU, BCa 75 to 93 %, and these intervals 95 to 97 % for mIoU and 92 to 97 % for other metrics.

What such an interval is of: the metric over the classes that the dataset shows. A class that is in no sample cannot be
known.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence

import numpy as np
import numpy.typing as npt

from gear.contracts.evaluation import Draws

LEFT_OUT = -1
"""Fills the rows of `leave_one_out`, in place of a sample's number."""

MOST_GROUPS = 500
"""More clusters than this are left out several at a time (delete-a-group jackknife), which bounds the cost."""

CONFIDENCE = 0.95

REAL = (-math.inf, math.inf)
"""Least and largest value of a metric that can be any number."""

NEGLIGIBLE = 1e-12
"""Replicates that differ by less than this share of their size differ by rounding alone."""

Values = npt.NDArray[np.float64]
Interval = tuple[float, float]


def numbered(clusters: Sequence[Hashable]) -> npt.NDArray[np.int64]:
    """(N,) number of each sample's cluster, counted in the order in which clusters first occur."""
    known: dict[Hashable, int] = {}
    return np.array([known.setdefault(one, len(known)) for one in clusters], np.int64)


def leave_one_out(clusters: Sequence[Hashable]) -> Draws:
    """(C, N) numbers of samples: row c holds those outside cluster c, filled up with `LEFT_OUT`.

    Args:
        clusters: of each of the N samples, the cluster that it belongs to.

    Returns:
        One row for each of C clusters, or for each of `MOST_GROUPS` groups of clusters; no row for fewer than two
        clusters, since one cluster does not show how far others lie from it.
    """
    owners = numbered(clusters) % MOST_GROUPS
    count = int(owners.max(initial=-1)) + 1
    rows = np.full((count if count > 1 else 0, len(owners)), LEFT_OUT, np.int64)
    for group, row in enumerate(rows):
        kept = np.flatnonzero(owners != group)
        row[: len(kept)] = kept
    return rows


def jackknife_interval(value: float, replicates: Values, limits: Interval = REAL) -> Interval | None:
    """The interval of 95 % around a metric.

    Where all replicates are equal, the interval is the value alone: no sample differs from another.

    Args:
        value: the metric over all samples.
        replicates: (C,) the metric without each cluster in turn.
        limits: least and largest value that the metric can have; the interval is cut there.

    Returns:
        Lower and upper end; None for fewer than two clusters, or where the metric is not known without one of them, so
        that it rests on that cluster alone.
    """
    count = len(replicates)
    if count < 2 or not math.isfinite(value) or not np.isfinite(replicates).all():
        return None
    deviations = replicates - replicates.mean()
    if np.abs(deviations).max() <= NEGLIGIBLE * np.abs(replicates).max():
        return value, value
    squares = np.square(deviations)
    error = math.sqrt((count - 1) / count * squares.sum())
    reach = _students_t(_degrees_of_freedom(squares)) * error
    return max(limits[0], value - reach), min(limits[1], value + reach)


def _degrees_of_freedom(squares: Values) -> float:
    """Satterthwaite's, from (C,) squared deviations d² of replicates, at most C - 1.

    The variance is the sum of d²; its own variance is, for normal d, two thirds of the sum of d⁴. So the degrees,
    2 variance² / Var(variance), are 3 (sum of d²)² / (sum of d⁴); 3 fewer, since deviations from a mean are not free.
    """
    effective = float(squares.sum() ** 2 / np.square(squares).sum())
    return min(len(squares) - 1.0, max(1.0, 3 * (effective - 1)))


def _students_t(degrees: float) -> float:
    from scipy import stats

    return float(stats.t.ppf(0.5 + CONFIDENCE / 2, degrees))


def separated_interval(value: float, clusters: int) -> Interval:
    """The interval around an area under the ROC curve of 0 or 1, where every replicate is the same.

    Samples that happen to be separated do not show that all are. The ends solve |A - a| = z sqrt(V(A)) with Hanley and
    McNeil's variance, as many samples on both sides as there are clusters (Newcombe, Statistics in Medicine 2006,
    method 5).
    """
    from scipy import optimize, stats

    z, pairs = float(stats.norm.ppf(0.5 + CONFIDENCE / 2)), max(clusters, 1)

    def excess(missing: float) -> float:
        area = 1 - missing
        more = (pairs - 1) * ((1 - area) / (2 - area) + area / (1 + area))
        return float(missing**2 - z**2 * area * missing * (1 + more) / pairs**2)

    reach = float(optimize.brentq(excess, 1e-9, 1.0))
    return (1 - reach, 1.0) if value > 0.5 else (0.0, reach)
