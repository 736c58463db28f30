"""How often intervals of 95 % cover a known truth, in simulated datasets.

    python benchmarks/coverage.py --simulations 1000

A large population of pictures stands for all that could be collected; its metrics are the truth. Datasets are drawn
from it, each is given intervals by several methods, and the share of datasets whose interval holds the truth is
printed: 95 % is right, and less means that the intervals are too narrow. Prints the table of docs/results/intervals.md.

A mean over classes is compared with the population's mean over the classes that the dataset shows.

Methods: `percentile` and `bca` are bootstrap intervals, `student` is the jackknife with Student's t without a
correction for skewness, and `gear` is the interval that `gear evaluate` gives.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
from scipy import stats

from gear.contracts.evaluation import Draws
from gear.formats.cityscapes import LABELS
from gear.measuring.intervals import (
    LEFT_OUT,
    REAL,
    Interval,
    Values,
    interval_at_limit,
    is_constant,
    jackknife_interval,
    leave_one_out,
)
from gear.measuring.statistics import auroc, auroc_interval
from gear.metrics.coco_curves import Matches, average_precision, known_mean, resampled
from gear.metrics.kitti_ap import curves, resampled_r40
from gear.metrics.kitti_match import Chosen
from gear.metrics.semantic import EVALUATED, SemanticEvaluator
from gear.values.rng import derive_rng

POPULATION = 6000
KITTI_POPULATION = 1500
"""Number of different pictures for KITTI's AP, whose matching is slow."""

RESAMPLES = 400
METHODS = ("percentile", "bca", "student", "gear")
SAMPLES = (6, 10, 20, 50)

Rng = np.random.Generator
Indices = npt.NDArray[np.integer[Any]]


class Kind(Protocol):
    """A population of pictures and a metric over them.

    Attributes:
        limits: least and largest value of the metric.
    """

    limits: Interval

    def measure(self, chosen: Indices, draws: Draws) -> tuple[float, Values, float]:
        """The metric over some pictures, over each draw of these, and the truth that it estimates.

        Args:
            chosen: (N,) numbers of pictures of the population.
            draws: (R, N) places in `chosen`, filled up with `LEFT_OUT`.

        Returns:
            The metric, its (R,) values over the draws, and the truth; NaN for the mean of the metric over all datasets
            of N pictures.
        """
        ...


def _often(draws: Draws, count: int) -> Values:
    """(R, N): how often each draw has each place."""
    often = np.zeros((len(draws), count))
    for row, drawn in zip(often, draws, strict=True):
        np.add.at(row, drawn[drawn != LEFT_OUT], 1)
    return often


class MeanIou:
    """mIoU of segmentation: sixteen classes, some in every picture, some in one of fifteen.

    Pictures differ in difficulty and classes in size and accuracy; wrong pixels are spread over the picture's classes.

    Args:
        rng: draws the population.
        harm: how much a patch lowers the logits of accuracy, at most; the metric is the difference to the twin then.
        is_everywhere: whether every class is in every picture.
    """

    def __init__(self, rng: Rng, harm: float = 0.0, *, is_everywhere: bool = False) -> None:
        self.limits: Interval = REAL if harm else (0.0, 1.0)
        self._metric = SemanticEvaluator()
        self._ids = [label.id for label in EVALUATED][:16]
        count = len(self._ids)
        shown = np.array([1, 1, 1, 0.97, 0.95, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.15, 0.1, 0.06])
        is_shown = rng.random((POPULATION, count)) < (1.0 if is_everywhere else shown)
        pixels = np.geomspace(4e4, 300, count) * rng.lognormal(0, 0.8, (POPULATION, count)) * is_shown
        logit = np.linspace(2.5, -0.5, count) + rng.normal(0, 0.5, (POPULATION, 1))
        logit = logit + rng.normal(0, 0.7, (POPULATION, count))
        self._clean = self._confusions(pixels, logit)
        struck = logit - harm * rng.uniform(0, 1, (POPULATION, 1))
        self._patched = self._confusions(pixels, struck) if harm else None
        self._truths = {
            id(one): self._metrics(one.sum(axis=0)[None]) for one in (self._clean, self._patched) if one is not None
        }

    def _confusions(self, pixels: Values, logit: Values) -> Values:
        """(P, classes, classes) pixels by truth and prediction."""
        right = pixels / (1 + np.exp(-logit))
        spread = pixels / pixels.sum(axis=1, keepdims=True)
        return np.asarray((pixels - right)[:, :, None] * spread[:, None] + np.eye(len(self._ids)) * right[:, :, None])

    def measure(self, chosen: Indices, draws: Draws) -> tuple[float, Values, float]:
        """See `Kind`."""
        value, replicates, truth = self._of(self._clean, chosen, draws)
        if self._patched is None:
            return value, replicates, truth
        other, others, other_truth = self._of(self._patched, chosen, draws)
        return other - value, others - replicates, other_truth - truth

    def _of(self, population: Values, chosen: Indices, draws: Draws) -> tuple[float, Values, float]:
        parts = population[chosen]
        overall = self._metrics(parts.sum(axis=0)[None])
        every = self._truths[id(population)]
        known = [name for name, iou in overall.items() if name.startswith("iou_") and not np.isnan(iou[0])]
        truth = float(np.mean([every[name][0] for name in known]))
        replicates = self._metrics(np.tensordot(_often(draws, len(chosen)), parts, 1))["miou"]
        return float(overall["miou"][0]), replicates, truth

    def _metrics(self, confusion: Values) -> Mapping[str, Values]:
        whole = np.zeros((len(confusion), len(LABELS), len(LABELS)))
        whole[:, np.array(self._ids)[:, None], self._ids] = confusion
        nothing = np.zeros((len(confusion), len(LABELS)))
        totals = dict.fromkeys(("tp", "fn", "category_tp", "category_fn"), nothing)
        return self._metric.metrics({"confusion": whole, **totals})


class MeanAp:
    """Mean AP of detection: five categories, some in every picture, some in one of seven, and false alarms."""

    limits = (0.0, 1.0)

    def __init__(self, rng: Rng) -> None:
        shown, objects = (0.98, 0.8, 0.5, 0.3, 0.15), (5.0, 3.0, 2.0, 1.5, 1.2)
        ease = rng.normal(0, 0.6, POPULATION)
        self._matches = []
        for category, (share, rate) in enumerate(zip(shown, objects, strict=True)):
            wanted = np.where(rng.random(POPULATION) < share, rng.poisson(rate, POPULATION) + 1, 0)
            hits = rng.binomial(wanted, 1 / (1 + np.exp(-(0.8 + ease - 0.2 * category))))
            alarms = rng.poisson(1.2 * np.exp(-0.3 * ease))
            owner = np.concatenate([np.repeat(np.arange(POPULATION), counts) for counts in (hits, alarms)])
            is_hit = np.arange(len(owner)) < hits.sum()
            score = rng.normal(np.where(is_hit, 1.0, -0.8), 1.2)
            surest = np.argsort(-score)
            by_picture = np.argsort(owner[surest], kind="stable")
            ends = np.cumsum(np.bincount(owner, minlength=POPULATION))[:-1]
            self._matches.append((is_hit[surest], wanted, np.split(by_picture, ends)))
        whole = [self._part(category, np.arange(POPULATION)) for category in range(len(self._matches))]
        self._truths = np.array([average_precision(one, np.ones(POPULATION, np.int64))[0] for one in whole])

    def _part(self, category: int, chosen: Indices) -> Matches:
        """Of some pictures, each with its place there as its number; a picture may be chosen several times."""
        is_hit, wanted, of_picture = self._matches[category]
        numbers = [of_picture[number] for number in chosen]
        order = np.concatenate(numbers)
        places = np.repeat(np.arange(len(chosen)), [len(one) for one in numbers])
        surest = np.argsort(order, kind="stable")
        places, order = places[surest], order[surest]
        counts = np.ones((1, len(order)), np.bool_)
        return Matches(owner=places, hit=is_hit[order][None], counts=counts, label_counts=wanted[chosen])

    def measure(self, chosen: Indices, draws: Draws) -> tuple[float, Values, float]:
        """See `Kind`."""
        parts = [self._part(category, chosen) for category in range(len(self._matches))]
        whole = np.concatenate([average_precision(one, np.ones(len(chosen), np.int64)) for one in parts])
        replicates = known_mean(_resampled(parts, draws), (1, 2))
        return float(np.nanmean(whole)), replicates, float(self._truths[~np.isnan(whole)].mean())


def _resampled(parts: Sequence[Matches], draws: Draws) -> Values:
    return np.concatenate([resampled(parts, row[row != LEFT_OUT][None]) for row in draws])


class KittiAp:
    """Mean of KITTI's AP at 40 recalls over three classes, which are in nearly all, two thirds and one third of the
    pictures.

    The share of a picture's labels that are detected, and the number of its false alarms, follow the picture's ease.
    AP R40 has no value at some of the 40 recalls if a class has fewer than 41 labels, so it depends on the number of
    pictures even if the detector stays the same.

    Args:
        rng: draws the population.
        is_of_size: whether the truth is the mean of AP over all datasets of the same number of pictures, instead of AP
            over the population.
    """

    limits = (0.0, 1.0)

    def __init__(self, rng: Rng, *, is_of_size: bool) -> None:
        self._is_of_size = is_of_size
        ease = rng.normal(0, 0.6, KITTI_POPULATION)
        self._chosen = [
            [_kitti_picture(rng, share, rate, easy - 0.3 * place) for easy in ease]
            for place, (share, rate) in enumerate(((0.98, 5.0), (0.65, 3.0), (0.35, 2.0)))
        ]
        every = [] if is_of_size else self._chosen
        self._truths = np.array([curves(pictures)[0][1:].mean() for pictures in every])

    def measure(self, chosen: Indices, draws: Draws) -> tuple[float, Values, float]:
        """See `Kind`."""
        every = np.arange(len(chosen))[None]
        parts = [[pictures[number % KITTI_POPULATION] for number in chosen] for pictures in self._chosen]
        whole = np.array([resampled_r40(part, every)[0] for part in parts])
        rows = [row[row != LEFT_OUT] for row in draws]
        values = np.array([resampled_r40(part, np.array(rows)) for part in parts])
        return float(np.nanmean(whole)), known_mean(values, (0,)), self._truth(~np.isnan(whole))

    def _truth(self, is_shown: npt.NDArray[np.bool_]) -> float:
        return math.nan if self._is_of_size else float(self._truths[is_shown].mean())


def _kitti_picture(rng: Rng, share: float, rate: float, ease: float) -> Chosen:
    """The labels and detections of one class in one picture: each label has one detection at most, which overlaps no
    other label.
    """
    labels = rng.poisson(rate) + 1 if rng.random() < share else 0
    hits, alarms = rng.binomial(labels, 1 / (1 + math.exp(-(1.2 + ease)))), rng.poisson(1.2 * math.exp(-0.3 * ease))
    count = hits + alarms
    overlaps = np.zeros((labels, count))
    overlaps[np.arange(hits), np.arange(hits)] = 0.9
    return Chosen(
        label_state=np.zeros(labels, np.int8),
        detection_state=np.zeros(count, np.int8),
        scores=rng.normal(np.where(np.arange(count) < hits, 1.0, -0.8), 1.2),
        overlaps=overlaps,
        angle_gain=np.ones((labels, count)),
        is_ignored=np.zeros(count, np.bool_),
        min_overlap=0.7,
    )


class Auroc:
    """Area under the ROC curve of twins' scores, which share what their street adds."""

    limits = (0.0, 1.0)

    def __init__(self, rng: Rng) -> None:
        street = rng.normal(0, 0.7, POPULATION)
        self._high, self._low = (street + rng.normal(mean, 0.7, POPULATION) for mean in (1.0, 0.0))
        self._truth = auroc(self._high.tolist(), self._low.tolist())

    def measure(self, chosen: Indices, draws: Draws) -> tuple[float, Values, float]:
        """See `Kind`."""
        high, low = self._high[chosen], self._low[chosen]
        rows = [row[row != LEFT_OUT] for row in draws]
        values = np.array([auroc(high[row].tolist(), low[row].tolist()) for row in rows])
        return auroc(high.tolist(), low.tolist()), values, self._truth

    def interval(self, chosen: Indices) -> Interval | None:
        """As an evaluation gives it, also where the scores are separated."""
        return auroc_interval(self._high[chosen].tolist(), self._low[chosen].tolist(), range(len(chosen)))


class MeanOfPictures:
    """Mean of a number of each picture.

    Args:
        values: (P,) numbers of the population's pictures.
        limits: smallest and largest possible mean.
    """

    def __init__(self, values: Values, limits: Interval) -> None:
        self._values, self.limits = values, limits

    def measure(self, chosen: Indices, draws: Draws) -> tuple[float, Values, float]:
        """See `Kind`."""
        often = _often(draws, len(chosen))
        values = self._values[chosen]
        return float(values.mean()), often @ values / often.sum(axis=1), float(self._values.mean())


def skewed(spread: float) -> Callable[[Rng], Kind]:
    """Errors in metres whose logarithms have the given standard deviation."""
    return lambda rng: MeanOfPictures(rng.lognormal(1.5, spread, POPULATION), (0.0, math.inf))


AGAINST_ALL = "mean AP R40 of KITTI, against AP of all pictures"

BY_NAME: Mapping[str, Callable[[Rng], Kind]] = {
    "mIoU": MeanIou,
    "mIoU, all classes in every picture": lambda rng: MeanIou(rng, is_everywhere=True),
    "mIoU, patch minus none": lambda rng: MeanIou(rng, harm=1.5),
    "mean AP of COCO": MeanAp,
    "mean AP R40 of KITTI": lambda rng: KittiAp(rng, is_of_size=True),
    AGAINST_ALL: lambda rng: KittiAp(rng, is_of_size=False),
    "AUROC": Auroc,
    "mean of a skewed error (skewness 1.3)": skewed(0.4),
    "mean of a skewed error (skewness 3.7)": skewed(0.8),
    "mean share near 1": lambda rng: MeanOfPictures(rng.beta(4.5, 0.5, POPULATION), (0.0, 1.0)),
    "share of pictures near 1": lambda rng: MeanOfPictures(np.floor(rng.random(POPULATION) + 0.97), (0.0, 1.0)),
}
KINDS = tuple(BY_NAME)
BOOTSTRAP = ("percentile", "bca")


def coverage(
    kind: Callable[[Rng], Kind], *, samples: int, simulations: int, methods: Sequence[str], seed: int
) -> dict[str, float]:
    """Shares of the simulated datasets whose interval holds the truth, by method."""
    rng = derive_rng(seed, "coverage")
    population = kind(rng)
    ends: dict[str, list[Interval]] = {method: [] for method in methods}
    truths, found = [], []
    for _ in range(simulations):
        chosen = rng.integers(0, POPULATION, samples)
        left_out = leave_one_out(range(samples))
        value, replicates, truth = population.measure(chosen, left_out)
        drawn = np.zeros(0)
        if set(methods) & set(BOOTSTRAP):
            _, drawn, _ = population.measure(chosen, rng.integers(0, samples, (RESAMPLES, samples)))
        for method in methods:
            if method == "gear":
                interval = _gears(population, chosen, value, replicates)
            elif method == "student":
                interval = _students(value, replicates)
            else:
                interval = _percentiles(drawn) if method == "percentile" else _bca(value, drawn, replicates)
            ends[method].append(interval or (math.nan, math.nan))
        truths.append(truth)
        found.append(value)
    true = np.where(np.isnan(truths), np.mean(found), truths)
    low_high = {method: np.array(values) for method, values in ends.items()}
    return {m: float(np.mean((each[:, 0] <= true) & (true <= each[:, 1]))) for m, each in low_high.items()}


def _gears(population: Kind, chosen: Indices, value: float, replicates: Values) -> Interval | None:
    """As an evaluation gives it."""
    if isinstance(population, Auroc):
        return population.interval(chosen)
    if value in population.limits and is_constant(replicates):
        return interval_at_limit(value, len(chosen), population.limits)
    return jackknife_interval(value, replicates, population.limits)


def _students(value: float, replicates: Values) -> Interval:
    """The jackknife's standard error times Student's t (Tukey 1958)."""
    count = len(replicates)
    error = math.sqrt((count - 1) / count * np.square(replicates - replicates.mean()).sum())
    reach = float(stats.t.ppf(0.975, count - 1)) * error
    return value - reach, value + reach


def _percentiles(drawn: Values) -> Interval:
    """Efron's percentile interval (1979)."""
    low, high = np.nanpercentile(drawn, (2.5, 97.5))
    return float(low), float(high)


def _bca(value: float, drawn: Values, replicates: Values) -> Interval:
    """Bias-corrected and accelerated (Efron, JASA 1987), as `scipy.stats.bootstrap` computes it."""
    below = np.clip(np.mean(drawn < value) + np.mean(drawn == value) / 2, 1 / len(drawn), 1 - 1 / len(drawn))
    bias, change = stats.norm.ppf(below), replicates.mean() - replicates
    size = np.square(change).sum()
    acceleration = (change**3).sum() / (6 * size**1.5) if size else 0.0
    moved = bias + stats.norm.ppf((0.025, 0.975))
    low, high = np.quantile(drawn, stats.norm.cdf(bias + moved / (1 - acceleration * moved)))
    return float(low), float(high)


def main() -> None:
    """Prints one line for each metric and number of samples."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--simulations", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=METHODS)
    parser.add_argument("--metrics", nargs="+", choices=KINDS, default=KINDS)
    args = parser.parse_args()
    print(f"| metric | samples | {' | '.join(args.methods)} |\n|---|---|{'---|' * len(args.methods)}")
    for name in args.metrics:
        for samples in SAMPLES:
            found = coverage(
                BY_NAME[name], samples=samples, simulations=args.simulations, methods=args.methods, seed=args.seed
            )
            print(f"| {name} | {samples} | {' | '.join(f'{100 * found[m]:.1f} %' for m in args.methods)} |", flush=True)


if __name__ == "__main__":
    main()
