"""How many patched pictures a detector finds at 1 % and 5 % false alarms, with a threshold from other scenes."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
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


def rate_title(allowed: float) -> str:
    """The title of a detection rate in tables, such as `TPR at 1 %`.

    Args:
        allowed: share of clean pictures that may raise an alarm.
    """
    return f"TPR at {100 * allowed:g} %"


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionRate:
    """The detections at one allowed share of false alarms.

    The intervals do not include the uncertainty of the thresholds.

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
        return rate_title(self.allowed)

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
    pools = {each.name: each for each in one.evaluation.pools}
    if pool.name == NO_PATCH or NO_PATCH not in pools:
        return ()
    clean, patched = _scores(one, pools[NO_PATCH]), _scores(one, pool)
    if clean is None or patched is None or len(clean) != len(patched):
        return ()
    scenes = [(row.facts.get("town"), row.facts.get("scene")) for row in _rows(one, pools[NO_PATCH])]
    if len(set(scenes)) < 2:
        return ()
    control = None if pool.name == RANDOM or RANDOM not in pools else _scores(one, pools[RANDOM])
    places = range(len(scenes)) if place is None else [place]
    others = {at: _scores_elsewhere(clean, scenes, at) for at in places}
    found = []
    for allowed in FALSE_ALARMS:
        thresholds = {at: threshold_at(scores, allowed) for at, scores in others.items()}
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


def _scores_elsewhere(clean: Sequence[Sequence[float]], scenes: Sequence[Hashable], place: int) -> list[float]:
    """The clean scores of all datasets that show another scene than the dataset at a position."""
    return [score for scene, scores in zip(scenes, clean, strict=True) if scene != scenes[place] for score in scores]


def _alarms(
    scores: Sequence[Sequence[float]], thresholds: Mapping[int, float], places: Sequence[int]
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
