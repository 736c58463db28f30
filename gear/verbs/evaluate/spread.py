"""How sure a figure is: bootstrap over samples (Efron 1979), 95 % by percentiles."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from gear.contracts.evaluation import Draws, Resampled
from gear.contracts.tasks import Evaluator
from gear.values.rng import derive_rng

PERCENTILES = (2.5, 97.5)
AnyEvaluator = Evaluator[Any, Any]
Values = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Figures:
    """The figures of one metric over one dataset.

    Attributes:
        overall: over all samples.
        spread: (R,) over resampled ones, for the figures that have any.
    """

    overall: Mapping[str, float]
    spread: Mapping[str, Values]

    def interval(self, name: str) -> tuple[float, float] | None:
        """Bounds of 95 %, or None where there is nothing to tell."""
        return bounds(self.spread[name]) if name in self.spread else None


def draw(count: int, resamples: int, seed: int) -> Draws:
    """(resamples, count) numbers of samples; the same for every dataset of this size, so that twins stay paired."""
    return derive_rng(seed, "bootstrap", count).integers(0, max(count, 1), (resamples, count), dtype=np.int64)


def gather(fresh: Callable[[], AnyEvaluator], parts: Sequence[AnyEvaluator], draws: Draws) -> Figures:
    """Figures over evaluators that have seen one sample each.

    Args:
        fresh: makes an empty evaluator.
        parts: in order of samples.
        draws: (R, len(parts)).
    """
    whole = fresh()
    for part in parts:
        whole.merge(part)
    overall = dict(whole.result())
    if not draws.size:
        return Figures(overall=overall, spread={})
    if isinstance(whole, Resampled):
        return Figures(overall=overall, spread=dict(whole.resampled(draws)))
    rows = []
    for drawn in draws:
        one = fresh()
        for index in drawn:
            one.merge(parts[index])
        rows.append(one.result())
    return Figures(
        overall=overall, spread={name: np.array([row.get(name, np.nan) for row in rows]) for name in overall}
    )


def bounds(values: Values) -> tuple[float, float] | None:
    """Bounds of 95 % of the known values."""
    known = values[~np.isnan(values)]
    if not len(known):
        return None
    low, high = np.percentile(known, PERCENTILES)
    return float(low), float(high)


def auroc(positives: Sequence[float], negatives: Sequence[float]) -> float:
    """Area under the ROC curve: how often a positive's score is above a negative's, ties half; NaN without either."""
    if not len(positives) or not len(negatives):
        return float("nan")
    above = np.asarray(positives)[:, None] - np.asarray(negatives)[None]
    return float((above > 0).mean() + 0.5 * (above == 0).mean())


def auroc_interval(positives: Sequence[float], negatives: Sequence[float], draws: Draws) -> tuple[float, float] | None:
    """Its bounds over the pairs of twins that `draws` chooses."""
    high, low = np.asarray(positives), np.asarray(negatives)
    return bounds(np.array([auroc(high[drawn], low[drawn]) for drawn in draws]))
