"""A line chart of a metric over the values of a swept key, as in the paper's figures of ablations."""

from __future__ import annotations

import io
from collections.abc import Sequence

from gear.contracts.tasks import NO_PATCH
from gear.verbs.bench.chart import COLOURS, FURTHER, TRUETYPE, UNDATED
from gear.verbs.bench.plan import RANDOM

WIDTH_IN, HEIGHT_IN, TEXT_PT = 3.5, 2.6, 7
"""Size in inches, the width of a column of a paper, and size of the letters in points."""

STYLES = {NO_PATCH: ":", RANDOM: "-."}
"""Styles of lines by kind of patch: the baselines are dotted and dash-dotted, as in the paper."""

Labelled = tuple[str, str, str, float, float]
"""One point: name of its line, kind of patch, value of the key, mean and standard deviation of the metric."""


def sweep_chart(points: Sequence[Labelled], values: Sequence[str], *, axes: tuple[str, str], form: str) -> bytes:
    """Draws the chart as PDF or SVG bytes; error bars are standard deviations over seeds. Equal points give equal
    bytes.

    Args:
        points: the points of all lines.
        values: values of the key in their order; if all are numbers, they are placed to scale.
        axes: titles of the horizontal and the vertical axis.
        form: `pdf` or `svg`.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), layout="constrained")
    FigureCanvasAgg(figure)
    axis = figure.subplots()
    places = _places(values)
    names = list(dict.fromkeys(name for name, *_ in points))
    for number, name in enumerate(names):
        mine = [point for point in points if point[0] == name]
        patch = mine[0][1]
        first = sum(other.endswith(f", {patch}") for other in names[:number]) == 0
        colour = COLOURS.get(patch, FURTHER[0]) if first else FURTHER[number % len(FURTHER)]
        axis.errorbar(
            [places[value] for _, _, value, _, _ in mine],
            [mean for *_, mean, _ in mine],
            yerr=[std for *_, std in mine],
            fmt="o" + STYLES.get(patch, "-"),
            color=colour, label=name, lw=1.0, ms=2.5, capsize=1.5,
        )  # fmt: skip
    axis.set_xticks([places[value] for value in values], [value.strip("[]") for value in values])
    axis.tick_params(labelsize=TEXT_PT)
    axis.set_xlabel(axes[0], fontsize=TEXT_PT)
    axis.set_ylabel(axes[1], fontsize=TEXT_PT)
    axis.grid(alpha=0.3)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
    if names:
        figure.legend(loc="outside upper center", ncols=2, frameon=False, fontsize=TEXT_PT)
    data = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "gear", "svg.fonttype": "path", "pdf.fonttype": TRUETYPE}):
        figure.savefig(data, format=form, dpi=120, metadata=UNDATED[form])
    return data.getvalue()


def _places(values: Sequence[str]) -> dict[str, float]:
    """The horizontal place of each value: the number itself, or its rank if a value is no number."""
    try:
        return {value: float(value) for value in values}
    except ValueError:
        return {value: float(number) for number, value in enumerate(values)}
