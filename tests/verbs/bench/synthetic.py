"""A bench report without a bench behind it: one task, one network, two scenes, a cleaner and a detector."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gear.measuring.statistics import Metrics
from gear.verbs.bench.report import BenchReport, Metric, Result, TaskResult
from gear.verbs.evaluate.report import Difference, Estimate, EvaluateReport, PairedTest, Pool, RowReport

SCENES = ("town10-board_1", "town10-truck")

VALUES = {
    None: {"none": (0.70, 0.60), "random": (0.69, 0.58), "patch": (0.50, 0.40)},
    "clean&er": {"none": (0.68, 0.60), "random": (0.67, 0.57), "patch": (0.60, 0.40), "adaptive patch": (0.45, 0.35)},
    "detector": {"none": (0.70, 0.60), "random": (0.69, 0.58), "patch": (0.50, 0.40)},
}
"""The metric by defense, kind of patch and scene."""

AUROC = {"patch": (0.9, 0.8), "random": (0.6, 0.5)}


def estimate(value: float) -> Estimate:
    return Estimate(value=value, interval=(value - 0.01, value + 0.01))


def difference(row: str, against: str, change: float, auroc: float | None, p: float = 0.001) -> Difference:
    return Difference(
        row=row, against=against, metrics={"task": {"miou": estimate(change)}},
        auroc=None if auroc is None else estimate(auroc),
        paired={"task": {"miou": PairedTest(mean=change, p=p, pairs=8)}},
    )  # fmt: skip


def gathered(value: float) -> dict[str, Metrics]:
    """Metrics with replicates: one street of the eight makes a difference."""
    replicates = value + np.array([0.01, -0.01] * 4)
    return {"task": Metrics(overall={"miou": value}, replicates={"miou": replicates}, ceilings={})}


def result(defense: str | None, p: float = 0.001) -> Result:
    """The results of the network with one of the defenses; `p` is that of the optimised patch."""
    values, rows, pools, differences = VALUES[defense], [], [], []
    for patch, metrics in values.items():
        names = tuple(f"{number}-{patch}" for number in range(len(SCENES)))
        for number, (name, metric) in enumerate(zip(names, metrics, strict=True)):
            rows.append(RowReport(
                name=name, dataset=Path(name), facts={}, samples=4, made=0, damaged=(),
                metrics={"task": {"miou": estimate(metric)}}, cost={"model_s": 0.1, "defense_s": 0.2},
                defense={"mask_iou": 0.4} if defense == "clean&er" else {}, per_sample=[],
            ))  # fmt: skip
            auroc = AUROC[patch][number] if defense == "detector" and patch in AUROC else None
            controls = {"none": [], "random": ["none"]}.get(patch, ["none", "random"])
            differences += [
                difference(name, f"{number}-{other}", metric - values[other][number], auroc) for other in controls
            ]
        mean = sum(metrics) / 2
        against = [] if patch == "none" else ["none"] if patch == "random" else ["none", "random"]
        pools.append(Pool(
            name=patch, rows=names, samples=8, metrics={"task": {"miou": estimate(mean)}},
            cost={"model_s": 0.1, "defense_s": 0.2}, defense={}, gathered=gathered(mean),
            differences=tuple(
                difference(patch, other, mean - sum(values[other]) / 2, None, p) for other in against
            ),
        ))  # fmt: skip
    evaluation = EvaluateReport(
        out=Path("out/evaluations/x"), facts={}, rows=tuple(rows), together=(), differences=tuple(differences),
        pools=tuple(pools),
    )  # fmt: skip
    return Result(
        model="net_1", defense=defense, evaluation=evaluation, scenes=(), changes_pictures=defense == "clean&er"
    )


def task(p: float = 0.001) -> TaskResult:
    metric = Metric.of("miou", lower_is_better=False)
    return TaskResult(name="semseg", metric=metric, results=tuple(result(defense, p) for defense in VALUES))


def report() -> BenchReport:
    facts = {
        "scenes": list(SCENES), "weathers": ["ClearNoon"], "notes": [], "config": {}, "versions": {"gear": "0.1"},
        "name": "small", "command": "gear bench small", "seed": 0,
    }  # fmt: skip
    return BenchReport(out=Path("out"), facts=facts, tasks=(task(),))
