"""What a defense gains under attack and costs without one, against the same network without a defense.

The intervals are those of paired differences: each jackknife replicate leaves the same street out of both evaluations.
"""

from __future__ import annotations

from gear.contracts.tasks import NO_PATCH
from gear.leaderboard.rules import LEAST_RETAINED
from gear.measuring.statistics import difference_interval
from gear.verbs.bench.plan import ADAPTIVE, PATCH
from gear.verbs.bench.report import Result, TaskResult
from gear.verbs.evaluate.report import Estimate, Pool

CHANCE = 0.5
"""AUROC of a score that does not depend on the patch."""

FAILED_P = 0.05
"""Probability above which the effect of a patch may be chance, so that the attack counts as failed."""


def alone(task: TaskResult, one: Result) -> Result:
    """Returns the results of the same network without a defense.

    Args:
        task: results of the task.
        one: results of a network with a defense, or alone.
    """
    return next(other for other in task.results if other.model == one.model and other.defense is None)


def against_clean(task: TaskResult, one: Result, pool: Pool) -> Estimate | None:
    """Returns the metric of a pool (the datasets of all scenes with one kind of patch) minus that of the network
    without a defense and without a patch.

    Args:
        task: results of the task, with its main metric.
        one: results of the network, alone or with a defense.
        pool: a pool of these results.

    Returns:
        The difference with its interval; None for the subtracted pool itself, and where a value is missing.
    """
    if one.defense is None and pool.name == NO_PATCH:
        return None
    return minus(task, pool, alone(task, one).pool(NO_PATCH))


def gain(task: TaskResult, one: Result, pool: Pool) -> Estimate | None:
    """Returns the metric of a defended network minus that of the network without a defense, under the same kind of
    patch; adaptive patches are compared with the patches against the network alone.

    None without a defense. Without a patch the gain is the cost of the defense, usually negative.

    Args:
        task: results of the task, with its main metric.
        one: results of the network with its defense.
        pool: a pool (the datasets of all scenes with one kind of patch) of these results.
    """
    if one.defense is None:
        return None
    other, name = alone(task, one), PATCH if pool.name == ADAPTIVE else pool.name
    found = next((each for each in other.evaluation.pools if each.name == name), None)
    return None if found is None else minus(task, pool, found)


def minus(task: TaskResult, pool: Pool, other: Pool) -> Estimate | None:
    """Returns the difference of the task's main metric between two pools of the same scenes, with its interval.

    Args:
        task: results of the task, with its main metric.
        pool: results over all scenes with one kind of patch.
        other: the results that are subtracted.

    Returns:
        None if the task has no main metric or a value is missing.
    """
    here, there = task.value(pool), task.value(other)
    if task.metric is None or here is None or there is None:
        return None
    one, two = (each.gathered.get(task.metric.report) for each in (pool, other))
    interval = None if one is None or two is None else difference_interval(one, two, task.metric.name)
    is_from_few = here.is_from_few or there.is_from_few
    return Estimate(value=here.value - there.value, interval=interval, is_from_few=is_from_few)


def is_failed(task: TaskResult, one: Result, pool: Pool) -> bool:
    """Whether an optimised patch is no worse for the network than a random patch, or only by chance.

    Args:
        task: results of the task, with its main metric.
        one: results of the network.
        pool: results with the optimised patch. They are compared with the results with the random patch.
    """
    against = one.against(pool)
    change, test = task.effect(against), task.outside_patch(against)
    if against is None or against.against == NO_PATCH or task.metric is None or change is None:
        return False
    is_harmful = change.value > 0 if task.metric.lower_is_better else change.value < 0
    return not is_harmful or (test is not None and test[1].pairs > 0 and test[1].p > FAILED_P)


def survives_only_static(task: TaskResult, one: Result) -> bool:
    """Whether a defense withstands patches that were made without knowledge of it, but not adaptive patches.

    This holds if its gain is lost, or if its detection is lost:

    - The gain under static patches is above 0, less than half of it remains under adaptive patches, and the metric
      behind the defense is worse under adaptive than under static patches.
    - The AUROC of the score (against random patches) is above 0.5 for static patches, and less than half of what it is
      above 0.5 remains for adaptive patches.

    Where there are 95 % intervals, those of the static gain, of the difference between static and adaptive patches and
    of the static AUROC must exclude 0 (for the AUROC: 0.5), and that of the adaptive AUROC the static AUROC. Without
    intervals, the values decide.

    Args:
        task: results of the task, with its main metric.
        one: results of the network with its defense.
    """
    pools = {pool.name: pool for pool in one.evaluation.pools}
    if one.defense is None or PATCH not in pools or ADAPTIVE not in pools:
        return False
    static, adaptive = pools[PATCH], pools[ADAPTIVE]
    return _loses_gain(task, one, static, adaptive) or _loses_detection(one, static, adaptive)


def _loses_gain(task: TaskResult, one: Result, static: Pool, adaptive: Pool) -> bool:
    gained, kept = gain(task, one, static), gain(task, one, adaptive)
    lost = minus(task, static, adaptive)
    if task.metric is None or gained is None or kept is None or lost is None:
        return False
    sign = -1.0 if task.metric.lower_is_better else 1.0
    is_gone = sign * kept.value < LEAST_RETAINED * sign * gained.value
    return is_gone and _is_above(gained, 0.0, sign) and _is_above(lost, 0.0, sign)


def _loses_detection(one: Result, static: Pool, adaptive: Pool) -> bool:
    against = [one.against(pool) for pool in (static, adaptive)]
    before, after = (None if each is None else each.auroc for each in against)
    if before is None or after is None or not _is_above(before, CHANCE, 1.0):
        return False
    is_gone = after.value - CHANCE < LEAST_RETAINED * (before.value - CHANCE)
    return is_gone and _is_above(after, before.value, -1.0)


def _is_above(one: Estimate, bound: float, sign: float) -> bool:
    """Whether a value and its whole interval, if it has one, lie above a bound; below it for a negative sign."""
    near = one.value if one.interval is None else one.interval[0 if sign > 0 else 1]
    return sign * (near - bound) > 0 and sign * (one.value - bound) > 0
