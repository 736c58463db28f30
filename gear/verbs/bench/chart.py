"""A bar chart of a task's metric: one group of bars per network and defense, one bar per kind of patch."""

from __future__ import annotations

import io
from typing import Literal

from gear.contracts.tasks import NO_PATCH
from gear.verbs.bench.plan import ADAPTIVE, PATCH, RANDOM
from gear.verbs.bench.report import Result, TaskResult
from gear.verbs.evaluate.report import Estimate

COLOURS = {NO_PATCH: "#2f7d4f", RANDOM: "#8b95a1", PATCH: "#b3402a", ADAPTIVE: "#7a2d8c"}
FURTHER = ("#c98a2b", "#1f5fa8", "#5c6b7a", "#9a5b3c", "#3c8c8c", "#a05c8a", "#6b7a2b")
"""Bar colours for patches that were optimised against other networks (transfer)."""

BAR_IN, GAP_IN, EDGE_IN = 0.16, 0.14, 0.9

WIDTH_IN = {"svg": 8.0, "png": 8.0, "pdf": 3.5}
"""Width in inches. The PDF has the width of a column of a paper, so its letters keep their size there."""

TEXT_PT = {"svg": 8, "png": 8, "pdf": 7}
"""Size of the letters in points."""


def chart(task: TaskResult, form: Literal["svg", "pdf", "png"]) -> bytes:
    """Draws the chart as SVG, PDF or PNG bytes, with 95 % intervals where they are known. Equal results give equal
    bytes.

    Args:
        task: results of one task.
        form: file format.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    results = [one for one in task.results if _bars(task, one)]
    size_pt, columns = TEXT_PT[form], 4 if form != "pdf" else 2
    height = EDGE_IN + sum(GAP_IN + BAR_IN * len(_bars(task, one)) for one in results)
    figure = Figure(figsize=(WIDTH_IN[form], height), layout="constrained")
    FigureCanvasAgg(figure)
    axis = figure.subplots()
    ticks, colours, y_in = [], _colours(task), 0.0
    for one in results:
        begun = y_in
        for patch, value in _bars(task, one):
            axis.barh(y_in, value.value, BAR_IN * 0.92, color=colours[patch], label=patch)
            if value.interval is not None:
                low, high = value.interval
                whisker = [[max(0.0, value.value - low)], [max(0.0, high - value.value)]]
                axis.errorbar(value.value, y_in, xerr=whisker, color="0.15", lw=0.8, capsize=1.5)
            y_in += BAR_IN
        ticks.append(((begun + y_in - BAR_IN) / 2, one.model if one.defense is None else f"  + {one.defense}"))
        y_in += GAP_IN
    axis.set_yticks([at for at, _ in ticks], [name for _, name in ticks], fontsize=size_pt)
    axis.invert_yaxis()
    assert task.metric is not None
    better = "lower" if task.metric.lower_is_better else "higher"
    axis.set_xlabel(f"{task.metric.title} ({better} is better)", fontsize=size_pt)
    axis.tick_params(axis="x", labelsize=size_pt)
    axis.grid(axis="x", alpha=0.3)
    axis.set_axisbelow(True)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
    handles, names = axis.get_legend_handles_labels()
    known = dict(zip(names, handles, strict=True))
    figure.legend(known.values(), known, loc="outside upper center", ncols=columns, frameon=False, fontsize=size_pt)
    data = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "gear", "svg.fonttype": "path", "pdf.fonttype": TRUETYPE}):
        figure.savefig(data, format=form, dpi=120, metadata=UNDATED[form])
    return data.getvalue()


TRUETYPE = 42
"""Matplotlib's number for embedded TrueType fonts; publishers refuse its default, Type 3."""

UNDATED = {"svg": {"Date": None}, "pdf": {"CreationDate": None}, "png": {"Software": None}}


def _bars(task: TaskResult, one: Result) -> list[tuple[str, Estimate]]:
    values = [(pool.name, task.value(pool)) for pool in one.evaluation.pools]
    return [(name, value) for name, value in values if value is not None and value.value == value.value]


def _colours(task: TaskResult) -> dict[str, str]:
    names = dict.fromkeys(name for one in task.results for name, _ in _bars(task, one))
    others = [name for name in names if name not in COLOURS]
    return {**COLOURS, **{name: FURTHER[i % len(FURTHER)] for i, name in enumerate(others)}}
