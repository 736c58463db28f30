"""The result tables of a benchmark as text: one table per task, with one row per network, defense and kind of patch."""

from __future__ import annotations

from collections.abc import Iterator

from gear.measuring.detection_rates import FALSE_ALARMS
from gear.measuring.text_table import number_table
from gear.verbs.bench.detection import detection_rates, rate_title
from gear.verbs.bench.drives.results import LEGEND as DRIVE_LEGEND
from gear.verbs.bench.gains import against_clean, gain, is_failed, survives_only_static
from gear.verbs.bench.report import BenchReport, Result, TaskResult
from gear.verbs.evaluate.report import Difference, Pool
from gear.verbs.evaluate.table import few_streets_note, number, shown

OBJECT_COLUMNS = {
    "hidden": "hidden",
    "misclassified": "misclassified",
    "moved": "moved",
    "invented on patch": "invented_on_patch",
    "invented elsewhere": "invented_elsewhere",
}
"""Column titles for tasks with detected objects, each with the key of the count in `ObjectChanges.counts`."""

REST = ("AUROC", *map(rate_title, FALSE_ALARMS), "mask IoU", "s/picture")

FAILED = " (failed)"
"""Mark of an optimised patch that is no worse than a random one."""

STATIC_ONLY = " (static only)"
"""Mark of a defense whose gain or detection is lost under adaptive patches."""

ALONE = "-"
"""Text of the cell `defense` for a network without a defense."""


def text(report: BenchReport) -> str:
    """Returns the tables of all tasks as text, followed by a legend and notes.

    Args:
        report: results of the benchmark.
    """
    parts = ["\n".join([title(task), *number_table(columns(task))]) for task in report.tasks]
    legends = [legend(), *few_streets_note(parts), *report.facts["notes"]]
    if report.drives is not None:
        parts.append("\n".join(["drives", *number_table(report.drives.rows())]))
        legends.append(DRIVE_LEGEND)
    return "\n\n".join([*parts, "\n".join(legends)]) + "\n"


def title(task: TaskResult) -> str:
    """Returns the title of a task's table: task, main metric, and whether higher or lower values are better."""
    if task.metric is None:
        return task.name
    return f"{task.name}: {task.metric.title} ({'lower' if task.metric.lower_is_better else 'higher'} is better)"


def legend() -> str:
    """Returns one line that explains the columns of the tables."""
    return (
        "in brackets: 95 % intervals; change: against the network without a defense and without a patch; gain: against "
        "the network without a defense under the same kind of patch (adaptive patches: under the patches against the "
        "network alone), so without a patch it is what the defense costs; outside patch, p, objects and AUROC: of a "
        "patch against a random one, and of a random one against none, behind the same defense; outside patch: mean "
        "change of a picture, without the pixels of the patch where the task can leave them out; p: two-sided p of a "
        "paired permutation test; hidden, misclassified, moved: shares of the objects found in the twin; invented: "
        "detections per picture that neither an object nor the twin explains; TPR: share of the pictures that raise an "
        "alarm, at a threshold that 1 % or 5 % of the other scenes' clean pictures exceed; (failed): the patches are "
        "no worse than random ones, or only by chance (p above 0.05); (static only): the defense survives only static "
        "attacks, since adaptive patches leave less than half of its gain, or of its AUROC above 0.5"
    )


def defense_title(task: TaskResult, one: Result) -> str:
    """Returns the name of a defense with the mark of those that survive only static attacks; `-` without a defense.

    Args:
        task: results of the task.
        one: results of the network, alone or with the defense.
    """
    return f"{one.defense or ALONE}{STATIC_ONLY * survives_only_static(task, one)}"


def columns(task: TaskResult) -> list[list[str]]:
    """Returns the cells of a task's table, titles first; columns that are empty in every row are left out."""
    every = [head(task), *lines(task)]
    used = [i for i, cells in enumerate(zip(*every, strict=True)) if any(cells[1:])]
    return [[line[i] for i in used] for line in every]


def head(task: TaskResult) -> list[str]:
    """Returns the column titles of a task's table."""
    metric = "" if task.metric is None else task.metric.title
    return ["network", "defense", "patch", metric, "change", "gain", "outside patch", "p", *OBJECT_COLUMNS, *REST]


def lines(task: TaskResult) -> Iterator[list[str]]:
    """Yields the rows of a task's table: one per network, defense and kind of patch."""
    for one in task.results:
        for pool in one.evaluation.pools:
            yield line(task, one, pool)


def line(task: TaskResult, one: Result, pool: Pool) -> list[str]:
    """Returns the cells of one row, for one network (with its defense) and one kind of patch.

    Args:
        task: results of one task.
        one: result of the network, alone or with a defense.
        pool: metrics for one kind of patch.
    """
    against = one.against(pool)
    outside = task.outside_patch(against)
    test = None if outside is None or not outside[1].pairs else outside[1]
    rates = detection_rates(one, pool)
    return [
        one.model,
        defense_title(task, one),
        pool.name + FAILED * is_failed(task, one, pool),
        shown(task.value(pool)),
        shown(against_clean(task, one, pool), is_signed=True),
        shown(gain(task, one, pool), is_signed=True),
        "" if test is None else number(test.mean, is_signed=True),
        "" if test is None else f"{test.p:.2g}",
        *(_rate(against, name) for name in OBJECT_COLUMNS.values()),
        shown(None if against is None else against.auroc),
        *(shown(each.found) for each in rates),
        *[""] * (len(FALSE_ALARMS) - len(rates)),
        number(pool.defense["mask_iou"]) if "mask_iou" in pool.defense else "",
        f"{pool.cost['model_s'] + pool.cost['defense_s']:.3f}",
    ]


def _rate(one: Difference | None, name: str) -> str:
    """Returns the rate of one kind of change of objects as text; empty for tasks without objects."""
    return "" if one is None or one.objects is None else shown(one.objects.counts[name].rate)
