"""How often intervals of 95 % cover a known truth, in simulated datasets.

    python benchmarks/coverage.py --simulations 1000

A large population of pictures stands for all that could be collected; its metrics are the truth. Datasets are drawn
from it, each is given intervals by several methods, and the share of datasets whose interval holds the truth is
printed: 95 % is right, and less means that the intervals are too narrow. Prints the table of docs/results/intervals.md.

What a mean over classes is compared with is the population's mean over the classes that the dataset shows.
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
from gear.measuring.intervals import LEFT_OUT, REAL, Interval, Values, jackknife_interval, leave_one_out
from gear.measuring.statistics import auroc, auroc_interval
from gear.metrics.coco_curves import Matches, average_precision, known_mean, resampled
from gear.metrics.semantic import EVALUATED, SemanticEvaluator
from gear.values.rng import derive_rng

POPULATION = 6000
RESAMPLES = 400
METHODS = ("percentile", "bca", "jackknife")
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
        return Matches(owner=places, hit=is_hit[order][None], counts=counts, wanted=wanted[chosen])

    def measure(self, chosen: Indices, draws: Draws) -> tuple[float, Values, float]:
        """See `Kind`."""
        parts = [self._part(category, chosen) for category in range(len(self._matches))]
        whole = np.concatenate([average_precision(one, np.ones(len(chosen), np.int64)) for one in parts])
        replicates = known_mean(_resampled(parts, draws), (1, 2))
        return float(np.nanmean(whole)), replicates, float(self._truths[~np.isnan(whole)].mean())


def _resampled(parts: Sequence[Matches], draws: Draws) -> Values:
    return np.concatenate([resampled(parts, row[row != LEFT_OUT][None]) for row in draws])


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


class MeanError:
    """Mean of a picture's error in metres, which is skewed as depth errors are."""

    limits = (0.0, math.inf)

    def __init__(self, rng: Rng) -> None:
        self._errors = rng.lognormal(1.5, 0.4, POPULATION)

    def measure(self, chosen: Indices, draws: Draws) -> tuple[float, Values, float]:
        """See `Kind`."""
        often = _often(draws, len(chosen))
        values = self._errors[chosen]
        return float(values.mean()), often @ values / often.sum(axis=1), float(self._errors.mean())


BY_NAME: Mapping[str, Callable[[Rng], Kind]] = {
    "miou": MeanIou,
    "miou, all classes everywhere": lambda rng: MeanIou(rng, is_everywhere=True),
    "miou, patch minus none": lambda rng: MeanIou(rng, harm=1.5),
    "ap": MeanAp,
    "auroc": Auroc,
    "mean error": MeanError,
}
KINDS = tuple(BY_NAME)


def coverage(
    kind: Callable[[Rng], Kind], *, samples: int, simulations: int, methods: Sequence[str], seed: int
) -> dict[str, float]:
    """Shares of the simulated datasets whose interval holds the truth, by method."""
    rng = derive_rng(seed, "coverage")
    population = kind(rng)
    held: dict[str, list[bool]] = {method: [] for method in methods}
    for _ in range(simulations):
        chosen = rng.integers(0, POPULATION, samples)
        left_out = leave_one_out(range(samples))
        value, replicates, truth = population.measure(chosen, left_out)
        drawn = np.zeros(0)
        if set(methods) != {"jackknife"}:
            _, drawn, _ = population.measure(chosen, rng.integers(0, samples, (RESAMPLES, samples)))
        for method in methods:
            if method == "jackknife" and isinstance(population, Auroc):
                interval = population.interval(chosen)
            elif method == "jackknife":
                interval = jackknife_interval(value, replicates, population.limits)
            else:
                interval = _percentiles(drawn) if method == "percentile" else _bca(value, drawn, replicates)
            held[method].append(interval is not None and interval[0] <= truth <= interval[1])
    return {method: float(np.mean(values)) for method, values in held.items()}


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
    """Prints one line a metric and number of samples."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--simulations", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    print(f"| metric | samples | {' | '.join(METHODS)} |\n|---|---|{'---|' * len(METHODS)}")
    for name, kind in BY_NAME.items():
        for samples in SAMPLES:
            found = coverage(kind, samples=samples, simulations=args.simulations, methods=METHODS, seed=args.seed)
            print(f"| {name} | {samples} | {' | '.join(f'{100 * found[m]:.1f} %' for m in METHODS)} |", flush=True)


if __name__ == "__main__":
    main()
