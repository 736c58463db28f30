"""Formats the results of an evaluation as a plain-text table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from gear.measuring.intervals import FEWEST_CLUSTERS
from gear.measuring.reports import TASK
from gear.measuring.text_table import WIDTH, number_table
from gear.verbs.evaluate.report import ALARMS, Difference, Estimate, EvaluateReport, RowReport

COLUMNS, FURTHER = 4, 2
"""Number of metric columns for the task's own report, and for each further report; results.json has all metrics."""

FEW_STREETS = (
    f"*: interval from fewer than {FEWEST_CLUSTERS} streets: too narrow, it contains the true value less often than in "
    "95 % of datasets; collect samples of more streets"
)
"""Note below a table with marked intervals."""

LABEL_LENGTH = 36
"""Largest number of characters of a row's label."""


def table(report: EvaluateReport, *, width: int = WIDTH) -> str:
    """Returns a table with one row per dataset and the first metrics of each report as columns.

    The differences to a dataset's twins (the same samples with another patch) are listed below the dataset.

    Args:
        report: results of the evaluation.
        width: number of characters per line; columns that do not fit follow in further blocks.
    """
    columns, labels = _columns(report), row_labels(report.rows)
    text = number_table([cells for _, cells in table_cells(report)], width=width)
    notes = [
        *_paired(report, labels),
        *_objects(report, labels, width),
        *_limited(report, columns, labels),
        *_absent(report, labels),
        *_times(report),
        *few_streets_note(text),
        *report.facts.get("notes", []),
    ]
    return "\n".join([title(report), *text, *notes]) + "\n"


def title(report: EvaluateReport) -> str:
    """Returns the title of an evaluation: task, model and defense.

    Args:
        report: results of the evaluation.
    """
    guarded = report.facts["defense"]
    text = f"{report.facts['task']['name']}: {report.facts['model']['name']}"
    return text + (f" guarded by {guarded['name']}" if guarded else "")


def table_cells(report: EvaluateReport) -> list[tuple[str | None, list[str]]]:
    """Returns the titles and the rows of the table, without empty columns.

    Args:
        report: results of the evaluation.

    Returns:
        For each line its cells, preceded by the name of the dataset's row (`RowReport.name`); the name is None for the
        titles, differences and sums of several datasets.
    """
    columns, labels = _columns(report), row_labels(report.rows)
    titles = [metric_title(*column) for column in columns]
    head = ["", "samples", *titles, "model s/sample", "defense s/sample", "mask IoU", "alarm rate", "AUROC"]
    lines: list[tuple[str | None, list[str]]] = [(None, head)]
    for row in report.rows:
        lines.append((row.name, [labels[row.name], *_row(row, columns)]))
        lines += [(None, _difference(one, report, columns)) for one in report.differences if one.row == row.name]
    for pooled in report.together:
        metrics = [shown(pooled.metrics.get(name, {}).get(metric)) for name, metric in columns]
        lines.append((None, [f"all with patch {pooled.patch}", str(pooled.samples), *metrics, "", "", "", "", ""]))
    used = [i for i, text in enumerate(head) if text in ("", "samples") or any(line[i] for _, line in lines[1:])]
    return [(name, [line[i] for i in used]) for name, line in lines]


def _times(report: EvaluateReport) -> list[str]:
    """Returns a line that explains the times in the table; no line if they need no explanation."""
    if report.facts["defense"] is not None:
        return [
            "model s/sample: seconds of the network alone on defended pictures, one batch at a time; defense s/sample: "
            "seconds of the defense, including its own passes through the network"
        ]
    together = report.facts.get("timing", {}).get("parallel_batches", 1)
    if together == 1:
        return []
    return [
        f"model s/sample: the time divided by the number of samples, while {together} batches run in parallel; with a "
        "defense, batches run one at a time, so the two times cannot be compared"
    ]


def _columns(report: EvaluateReport) -> list[tuple[str, str]]:
    seen: dict[tuple[str, str], None] = {}
    for row in report.rows:
        for name, metrics in row.metrics.items():
            listed = list(metrics)[: COLUMNS if name == TASK else FURTHER]
            seen |= dict.fromkeys((name, metric) for metric in listed)
    return list(seen)


def metric_title(report: str, metric: str) -> str:
    """Returns the title of a column: the name of the metric, preceded by the name of its report unless that is the
    task's own.
    """
    return metric if report == TASK else f"{report}.{metric}"


def _row(row: RowReport, columns: Iterable[tuple[str, str]]) -> list[str]:
    metrics = [shown(row.metrics.get(report, {}).get(name)) for report, name in columns]
    defended = f"{row.cost['defense_s']:.3f}" if row.cost["defense_s"] else ""
    mask = number(row.defense.get("mask_iou")) if "mask_iou" in row.defense else ""
    alarms = f"{row.defense[ALARMS]:.2f}" if ALARMS in row.defense else ""
    return [str(row.samples), *metrics, f"{row.cost['model_s']:.3f}", defended, mask, alarms, ""]


def _difference(one: Difference, report: EvaluateReport, columns: Iterable[tuple[str, str]]) -> list[str]:
    against = next(row for row in report.rows if row.name == one.against)
    metrics = [shown(one.metrics.get(name, {}).get(metric), is_signed=True) for name, metric in columns]
    return [f"  minus {against.patch}", "", *metrics, "", "", "", "", shown(one.auroc)]


def row_labels(rows: Sequence[RowReport]) -> dict[str, str]:
    """Returns the labels of the table's rows: the dataset's folder, followed by the split if a folder has several.

    Args:
        rows: results of the datasets.

    Returns:
        Labels by the name of the row; long paths keep their last `LABEL_LENGTH` characters.
    """
    folders = Counter(row.dataset for row in rows)
    labels = {}
    for row in rows:
        path = str(row.dataset)
        short = path if len(path) <= LABEL_LENGTH else "…" + path[1 - LABEL_LENGTH :]
        labels[row.name] = f"{short}:{row.facts['split']}" if folders[row.dataset] > 1 else short
    shared = Counter(labels.values())
    return {name: name if shared[label] > 1 else label for name, label in labels.items()}


def _paired(report: EvaluateReport, labels: Mapping[str, str]) -> list[str]:
    """Returns lines with the mean change of single samples between twins (datasets that differ only in their
    patch), and p-values.
    """
    lines = []
    for one in report.differences:
        against = next(row for row in report.rows if row.name == one.against)
        tests = [
            f"{metric_title(name, metric)} {number(test.mean, is_signed=True)} (p {test.p:.2g}, {test.pairs} pairs)"
            for name, metrics in one.paired.items()
            for metric, test in list(metrics.items())[: COLUMNS if name == TASK else FURTHER]
            if test.pairs
        ]
        lines += [f"  {labels[one.row]} minus {against.patch}: {', '.join(tests)}"] if tests else []
    return ["mean change of a sample (p: two-sided p of a paired permutation test)", *lines] if lines else []


SHOWN_CHANGES = ("hidden", "misclassified", "moved", "invented_on_patch", "invented_elsewhere")
"""Keys of the object changes in the table; results.json also has the other keys and every single change."""


def _objects(report: EvaluateReport, labels: Mapping[str, str], width: int) -> list[str]:
    """Returns a table of how the detected objects differ between twins, datasets that differ only in their patch."""
    lines = []
    for one in report.differences:
        if one.objects is not None:
            against = next(row for row in report.rows if row.name == one.against)
            cells = [[f"    of {one.objects.found} found", "count", "reverse", "rate", "p"]]
            for name in SHOWN_CHANGES:
                change = one.objects.counts[name]
                counts = [str(change.count), str(change.reverse), shown(change.rate), f"{change.paired.p:.2g}"]
                cells.append([f"    {name.replace('_', ' ')}", *counts])
            lines += [f"  {labels[one.row]} minus {against.patch}", *number_table(cells, width=width)]
    head = (
        "objects found in the twin but not in this dataset, and detections that are not in the twin",
        "(reverse: the same counted from this dataset to the twin; rate: share of the objects found, for",
        "invented: number per picture; p: two-sided p of a paired permutation test of count and reverse)",
    )
    return [*head, *lines] if lines else []


def shown(one: Estimate | None, *, is_signed: bool = False) -> str:
    """Returns a metric with its interval as text, such as `0.712 [0.690, 0.734]`; empty if the metric is missing.

    An interval from too few streets ends with `*`.

    Args:
        one: the metric.
        is_signed: whether positive values get a plus sign.
    """
    if one is None:
        return ""
    text = number(one.value, is_signed=is_signed)
    if one.interval is None:
        return text
    return f"{text} [{number(one.interval[0])}, {number(one.interval[1])}]{'*' * one.is_from_few}"


def few_streets_note(texts: Iterable[str]) -> list[str]:
    """Returns the note on intervals from too few streets if one of the texts has such an interval (see `shown`).

    Args:
        texts: lines or cells of a table.
    """
    return [FEW_STREETS] if any("]*" in text for text in texts) else []


def number(value: float | None, *, is_signed: bool = False) -> str:
    """Returns a number as text, with three decimals, or with one if it is 100 or more; `-` for NaN and None.

    Args:
        value: the number.
        is_signed: whether positive numbers get a plus sign.
    """
    if value is None or value != value:
        return "-"
    sign = "+" if is_signed else ""
    return f"{value:{sign}.3f}" if abs(value) < 100 else f"{value:{sign}.1f}"


def _limited(report: EvaluateReport, columns: Iterable[tuple[str, str]], labels: Mapping[str, str]) -> list[str]:
    """Returns notes on metrics that stay below 1 even for perfect predictions, because a dataset has too few
    objects.
    """
    rows = [(labels[row.name], row.metrics) for row in report.rows]
    rows += [(f"all with patch {pooled.patch}", pooled.metrics) for pooled in report.together]
    lines = []
    for name, metrics in rows:
        known = [(column, metrics.get(column[0], {}).get(column[1])) for column in columns]
        low = [f"{metric_title(*column)} {number(one.ceiling)}" for column, one in known if one and one.ceiling < 1]
        lines += [f"perfect predictions would score {', '.join(low)} in {name}"] if low else []
    return lines


def _absent(report: EvaluateReport, labels: Mapping[str, str]) -> list[str]:
    """Returns notes on undefined metrics; rows and reports with the same undefined metrics share a line."""
    where: dict[tuple[str, ...], list[str]] = {}
    for row in report.rows:
        for name, metrics in row.metrics.items():
            missing = _families([metric for metric, one in metrics.items() if one.value != one.value], metrics)
            if missing:
                where.setdefault(missing, []).append(
                    labels[row.name] if name == TASK else f"{labels[row.name]} ({name})"
                )
    return [f"nothing to measure for {', '.join(missing)} in {', '.join(rows)}" for missing, rows in where.items()]


def _families(missing: Sequence[str], every: Iterable[str]) -> tuple[str, ...]:
    """Returns names of metrics; several names with the same prefix become `prefix_*` if no metric with this prefix
    has a value.
    """
    there = {name.partition("_")[0] for name in set(every) - set(missing)}
    heads = Counter(name.partition("_")[0] for name in missing)
    short = [
        head + "_*" if heads[head] > 1 and head not in there else name
        for name in missing
        if (head := name.partition("_")[0])
    ]
    return tuple(dict.fromkeys(short))
