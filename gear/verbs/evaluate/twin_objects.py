"""Counts, intervals and tests of the object changes between a dataset and its twin, the same samples with another
patch.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from gear.measuring.intervals import (
    FEWEST_CLUSTERS,
    LEFT_OUT,
    Interval,
    Values,
    interval_at_limit,
    jackknife_interval,
    leave_one_out,
)
from gear.measuring.statistics import clustered, paired_p
from gear.metrics.object_changes import CHANGES, OF_OBJECTS, Change, ObjectChange, changes, found_in_twin
from gear.values.picture_objects import ObjectOutcome, PictureOutcomes
from gear.verbs.evaluate.report import ChangeCount, DistanceBin, Estimate, ObjectChanges, PairedTest

PLACES = ("", "_on_patch", "_elsewhere")
"""Endings of the keys of counts: all changes, those on the patch, and those elsewhere in the picture."""


BINS = {"metres": (0.0, 5.0, 10.0, 20.0, 40.0, math.inf), "pixels": (0.0, 25.0, 50.0, 100.0, 200.0, math.inf)}
"""Limits of the bins of an object's distance from the patch, by unit."""


def object_changes(
    indices: Sequence[int],
    patched: Sequence[PictureOutcomes],
    twins: Sequence[PictureOutcomes],
    streets: Sequence[Hashable],
    seed: int,
) -> ObjectChanges:
    """Counts and tests how the detections of objects differ between a dataset and its twin, the same samples with
    another patch.

    Args:
        indices: indices of the N samples.
        patched: detection outcomes of the N samples in the dataset.
        twins: detection outcomes of the same samples in the twin.
        streets: identifier of the scene content of each sample; intervals and tests treat samples with the same one
            together.
        seed: seed of the permutation tests.
    """
    pairs = list(zip(patched, twins, strict=True))
    lost = [changes(one, twin) for one, twin in pairs]
    back = [changes(twin, one) for one, twin in pairs]
    things = [found_in_twin(one, twin) for one, twin in pairs]
    found = np.array([_places([thing.patch.is_on_patch for thing in some]) for some in things])
    kept = [row[row != LEFT_OUT] for row in leave_one_out(streets)]
    counts = {}
    for kind in CHANGES:
        bases = np.ones_like(found) if kind == "invented" else found
        limits = (0.0, math.inf if kind == "invented" else 1.0)
        forth, reverse = _counts(lost, kind), _counts(back, kind)
        tests = _tests(forth - reverse, streets, seed)
        for column, place in enumerate(PLACES):
            counts[kind + place] = ChangeCount(
                count=int(forth[:, column].sum()),
                reverse=int(reverse[:, column].sum()),
                rate=_rate(forth[:, column], bases[:, column], kept, limits),
                paired=tests[column],
            )
    every = tuple((index, one) for index, some in zip(indices, lost, strict=True) for one in some)
    by_distance = {
        unit: tuple(_distance_bin(things, unit, low, high, kept) for low, high in pairwise(ends))
        for unit, ends in BINS.items()
    }
    return ObjectChanges(found=int(found[:, 0].sum()), counts=counts, changes=every, by_distance=by_distance)


def _distance_bin(
    pictures: Sequence[Sequence[ObjectOutcome]],
    unit: str,
    low: float,
    high: float,
    kept: Sequence[npt.NDArray[np.int64]],
) -> DistanceBin:
    """Counts the objects, all detected in the twin, whose distance from the patch is in a bin, and how many of
    them are lost.
    """
    inside = [
        [thing for thing in some if (away := getattr(thing.patch, unit)) is not None and low <= away < high]
        for some in pictures
    ]
    found = np.array([len(some) for some in inside], np.float64)
    lost = np.array([[sum(thing.state == state for thing in some) for state in OF_OBJECTS] for some in inside])
    return DistanceBin(
        low=low,
        high=high,
        found=int(found.sum()),
        lost=dict(zip(OF_OBJECTS.values(), lost.sum(axis=0).tolist(), strict=True)),
        rate=_rate(lost.sum(axis=1, dtype=np.float64), found, kept, (0.0, 1.0)),
    )


def _places(are_on_patch: Sequence[bool]) -> tuple[float, float, float]:
    """Returns three counts: all, those on the patch, and those elsewhere."""
    return float(len(are_on_patch)), float(sum(are_on_patch)), float(len(are_on_patch) - sum(are_on_patch))


def _counts(pictures: Sequence[Sequence[ObjectChange]], kind: Change) -> Values:
    """Returns (N, 3) numbers of changes of one kind in each picture: all, on the patch, elsewhere."""
    return np.array([_places([one.patch.is_on_patch for one in some if one.change == kind]) for some in pictures])


def _rate(counts: Values, bases: Values, kept: Sequence[npt.NDArray[np.int64]], limits: Interval) -> Estimate:
    """Returns the sum of `counts` divided by the sum of `bases`, with its jackknife interval.

    Args:
        counts: (N,) numbers per picture.
        bases: (N,) numbers per picture.
        kept: for each street, the indices of the pictures that do not show that street.
        limits: smallest and largest possible value.
    """
    value = _ratio(counts, bases)
    replicates = np.array([_ratio(counts[row], bases[row]) for row in kept])
    interval = jackknife_interval(value, replicates, limits)
    if interval == (value, value) and value in limits:
        streets = sum(bool(bases[row].sum() < bases.sum()) for row in kept)  # that have a base
        interval = interval_at_limit(value, streets, limits)
    return Estimate(value=value, interval=interval, is_from_few=len(kept) < FEWEST_CLUSTERS)


def _ratio(counts: Values, bases: Values) -> float:
    return float(counts.sum() / bases.sum()) if bases.sum() else math.nan


def _tests(differences: Values, streets: Sequence[Hashable], seed: int) -> list[PairedTest]:
    """Returns a paired sign-flip test of each column of (N, F) differences."""
    found = paired_p(clustered(differences, streets), seed)
    means = differences.mean(axis=0) if len(differences) else np.full(differences.shape[1], math.nan)
    return [
        PairedTest(mean=float(mean), p=float(p), pairs=len(differences)) for mean, p in zip(means, found, strict=True)
    ]
