"""The results of a task as JSON, the content of bench.json."""

from __future__ import annotations

from pathlib import Path

from gear.values.serial import Json
from gear.verbs.bench.detection import detection_rates
from gear.verbs.bench.gains import against_clean, gain, is_failed, survives_only_static
from gear.verbs.bench.report import Result, TaskResult
from gear.verbs.evaluate.report import Estimate, Pool


def task_json(task: TaskResult, out: Path) -> Json:
    """Returns the results of one task as JSON.

    Args:
        task: the results.
        out: folder of the benchmark, to which paths are relative.

    Returns:
        `metric` (`name` and `lower_is_better`; None for a task without a metric), and `results`, one entry per network
        and defense.
    """
    metric = task.metric
    return {
        "metric": None if metric is None else {"name": metric.title, "lower_is_better": metric.lower_is_better},
        "results": [_result_json(task, one, out) for one in task.results],
    }


def _result_json(task: TaskResult, one: Result, out: Path) -> Json:
    return {
        "model": one.model,
        "defense": one.defense,
        "survives_only_static_attacks": survives_only_static(task, one),
        "evaluation": one.evaluation.out.relative_to(out).as_posix(),
        "patches": {pool.name: _pool_json(task, one, pool) for pool in one.evaluation.pools},
    }


def _pool_json(task: TaskResult, one: Result, pool: Pool) -> Json:
    against = one.against(pool)
    outside = task.outside_patch(against)
    return {
        "samples": pool.samples,
        "value": _estimate(task.value(pool)),
        "change": _estimate(against_clean(task, one, pool)),
        "gain": _estimate(gain(task, one, pool)),
        "against": None if against is None else against.against,
        "effect": _estimate(task.effect(against)),
        "outside_patch": None if outside is None else {"metric": outside[0], **outside[1].as_json()},
        "is_failed_attack": is_failed(task, one, pool),
        "auroc": _estimate(None if against is None else against.auroc),
        "detection": [each.as_json() for each in detection_rates(one, pool)],
        "defense": dict(pool.as_json()["defense"]),
        "cost": dict(pool.cost),
        **({} if against is None or against.objects is None else {"objects": against.objects.as_json()}),
    }


def _estimate(one: Estimate | None) -> Json:
    return None if one is None else one.as_json()
