"""How many patched pictures a detector finds at 1 % and 5 % false alarms, with a threshold from other scenes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.contracts.tasks import NO_PATCH
from gear.measuring.detection_rates import FALSE_ALARMS, alarms, share_interval, threshold_at
from gear.measuring.statistics import paired_p
from gear.values.serial import Json
from gear.verbs.bench.plan import RANDOM
from gear.verbs.bench.report import Result
from gear.verbs.evaluate.report import Estimate, Pool, RowReport

SEED = 0
"""Seed of the paired tests, so that a report is the same each time it is written."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionRate:
    """The detections at one allowed share of false alarms.

    The intervals take the thresholds as given.

    Attributes:
        allowed: share of the other scenes' clean pictures that may raise an alarm.
        found: share of the pictures with a patch that raise an alarm.
        false_alarms: share of the same scenes' clean pictures that raise an alarm at these thresholds.
        p: two-sided p of a paired permutation test of `found` against the pictures with a random patch; None for random
            patches themselves, and if these were not measured.
    """

    allowed: float
    found: Estimate
    false_alarms: Estimate
    p: float | None

    @property
    def title(self) -> str:
        """The title in tables, such as `TPR at 1 %`."""
        return f"TPR at {100 * self.allowed:g} %"

    def as_json(self) -> Json:
        """Returns `allowed`, `found`, `false_alarms` and `p` as JSON."""
        return {
            "allowed": self.allowed,
            "found": self.found.as_json(),
            "false_alarms": self.false_alarms.as_json(),
            "p": self.p,
        }


def detection_rates(one: Result, pool: Pool, place: int | None = None) -> tuple[DetectionRate, ...]:
    """Returns the detection rates of a network's defense for one kind of patch.

    The threshold of each scene is set on the clean pictures of all other scenes, in all weathers.

    Args:
        one: results of the network with its defense.
        pool: the datasets of all scenes with one kind of patch.
        place: position of the scene (with its weather) in the benchmark; None for all scenes together.

    Returns:
        One entry for each of `FALSE_ALARMS`; empty without scores, without a patch, or with a single scene.
    """
    kinds = {
        each.name: _scores(one, each) for each in one.evaluation.pools if each.name in (NO_PATCH, RANDOM, pool.name)
    }
    scores = [kinds[name] for name in (NO_PATCH, pool.name) if name in kinds]
    clean_pool = next((each for each in one.evaluation.pools if each.name == NO_PATCH), None)
    if pool.name == NO_PATCH or clean_pool is None or len(scores) < 2 or any(each is None for each in scores):
        return ()
    clean, patched = kinds[NO_PATCH], kinds[pool.name]
    assert clean is not None and patched is not None
    scenes = [(row.facts.get("town"), row.facts.get("scene")) for row in _rows(one, clean_pool)]
    if len(set(scenes)) < 2 or len(clean) != len(patched):
        return ()
    control = None if pool.name == RANDOM else kinds.get(RANDOM)
    found = []
    for allowed in FALSE_ALARMS:
        thresholds = [
            threshold_at([score for other, there in zip(scenes, clean, strict=True) if other != at for score in there],
                         allowed)
            for at in scenes
        ]  # fmt: skip
        places = range(len(scenes)) if place is None else [place]
        hits, false = (_alarms(each, thresholds, places) for each in (patched, clean))
        random = None if control is None or len(control) != len(clean) else _alarms(control, thresholds, places)
        found.append(DetectionRate(allowed=allowed, found=_share(hits), false_alarms=_share(false), p=_p(hits, random)))
    return tuple(found)


def _rows(one: Result, pool: Pool) -> list[RowReport]:
    named = {row.name: row for row in one.evaluation.rows}
    return [named[name] for name in pool.rows]


def _scores(one: Result, pool: Pool) -> list[list[float]] | None:
    """The scores of each dataset of a pool; None if a picture has no score, or a dataset has no pictures."""
    found = []
    for row in _rows(one, pool):
        scores = [sample.get("score") for sample in row.per_sample]
        if not scores or any(score is None for score in scores):
            return None
        found.append([float(score) for score in scores])
    return found


def _alarms(
    scores: Sequence[Sequence[float]], thresholds: Sequence[float], places: Sequence[int]
) -> npt.NDArray[np.bool_]:
    """Which pictures of some datasets raise an alarm, one dataset after the other."""
    return np.concatenate([alarms(scores[at], thresholds[at]) for at in places])


def _share(raised: npt.NDArray[np.bool_]) -> Estimate:
    count, total = int(raised.sum()), len(raised)
    return Estimate(value=count / total, interval=share_interval(count, total))


def _p(hits: npt.NDArray[np.bool_], random: npt.NDArray[np.bool_] | None) -> float | None:
    if random is None or len(random) != len(hits):
        return None
    return float(paired_p((hits.astype(np.float64) - random)[:, None], SEED)[0])
