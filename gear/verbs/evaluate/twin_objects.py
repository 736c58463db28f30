"""Counts, intervals and tests of what happens to objects between a dataset and its twin."""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence

import numpy as np
import numpy.typing as npt

from gear.measuring.intervals import LEFT_OUT, Interval, Values, jackknife_interval, leave_one_out
from gear.measuring.statistics import clustered, paired_p
from gear.metrics.object_changes import CHANGES, Change, ObjectChange, changes, found_in_twin
from gear.values.picture_objects import PictureOutcomes
from gear.verbs.evaluate.report import ChangeCount, Estimate, ObjectChanges, PairedTest

PLACES = ("", "_on_patch", "_elsewhere")
"""Ends of the names of counts: anywhere, on the patch, elsewhere."""


def object_changes(
    indices: Sequence[int],
    here: Sequence[PictureOutcomes],
    there: Sequence[PictureOutcomes],
    streets: Sequence[Hashable],
    seed: int,
) -> ObjectChanges:
    """What happens to objects from twin to twin.

    Args:
        indices: of the N samples.
        here: outcomes of the samples.
        there: outcomes of the same samples of the twin.
        streets: of each sample, the street that it shows; intervals and tests treat samples of one street together.
        seed: of the permutation tests.
    """
    pairs = list(zip(here, there, strict=True))
    lost = [changes(now, twin) for now, twin in pairs]
    back = [changes(twin, now) for now, twin in pairs]
    found = np.array([_places([thing.patch.is_on_patch for thing in found_in_twin(*pair)]) for pair in pairs])
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
    return ObjectChanges(found=int(found[:, 0].sum()), counts=counts, changes=every)


def _places(are_on_patch: Sequence[bool]) -> tuple[float, float, float]:
    """Numbers anywhere, on the patch and elsewhere."""
    return float(len(are_on_patch)), float(sum(are_on_patch)), float(len(are_on_patch) - sum(are_on_patch))


def _counts(pictures: Sequence[Sequence[ObjectChange]], kind: Change) -> Values:
    """(N, 3) changes of one kind in each picture: anywhere, on the patch, elsewhere."""
    return np.array([_places([one.patch.is_on_patch for one in some if one.change == kind]) for some in pictures])


def _rate(counts: Values, bases: Values, kept: Sequence[npt.NDArray[np.int64]], limits: Interval) -> Estimate:
    """A ratio of sums over pictures, (N,) each, with its interval; `kept` numbers the pictures without each street."""
    value = _ratio(counts, bases)
    replicates = np.array([_ratio(counts[row], bases[row]) for row in kept])
    return Estimate(value=value, interval=jackknife_interval(value, replicates, limits))


def _ratio(counts: Values, bases: Values) -> float:
    return float(counts.sum() / bases.sum()) if bases.sum() else math.nan


def _tests(differences: Values, streets: Sequence[Hashable], seed: int) -> list[PairedTest]:
    """A sign-flip test of each column of (N, F) differences."""
    found = paired_p(clustered(differences, streets), seed)
    means = differences.mean(axis=0) if len(differences) else np.full(differences.shape[1], math.nan)
    return [
        PairedTest(mean=float(mean), p=float(p), pairs=len(differences)) for mean, p in zip(means, found, strict=True)
    ]
