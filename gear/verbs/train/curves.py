"""Plots the curves of a training: losses, learning rate and the task's metric."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Any

from gear.contracts.specs import TaskSpec
from gear.dataset.files import write_whole
from gear.reporting.directions import with_direction
from gear.verbs.train.checkpoint import TrainingState
from gear.verbs.train.validate import LOSS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FILE = "curves.png"
BLUE, RED, GREEN = "#1f5fa8", "#b3402a", "#2f7d4f"


def write_curves(root: Path, spec: TaskSpec, progress: TrainingState, title: str) -> None:  # type: ignore[type-arg]
    """Writes `curves.png`: training and validation loss on the left, the task's metric and the learning rate on
    the right. The axes state which direction is better.

    Args:
        root: folder of the training.
        spec: spec of the task, which names its metric.
        progress: recorded steps and validations.
        title: title of the figure.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    figure.suptitle(title, fontsize=10)

    losses = [(entry["step"], entry["loss"]) for entry in progress.steps]
    if progress.open_losses:
        losses.append((progress.step, fmean(progress.open_losses)))
    _line(left, losses, color=BLUE, label="training")
    steps = [entry["step"] for entry in progress.validations]
    left.plot(steps, [entry["loss"] for entry in progress.validations], "o-", color=RED, ms=3, label="validation")
    left.set(xlabel="step", ylabel=with_direction(LOSS, lower_is_better=True))
    left.grid(alpha=0.3)
    left.legend(frameon=False, fontsize=8)

    if spec.metric:
        values = [entry.get(spec.metric, float("nan")) for entry in progress.validations]
        right.plot(steps, values, "o-", color=GREEN, ms=3)
        right.axvline(progress.best_step, color=GREEN, lw=0.8, ls=":")
    right.set(xlabel="step", ylabel=with_direction(spec.metric, lower_is_better=spec.lower_is_better))
    right.grid(alpha=0.3)
    if progress.steps:
        rate = right.twinx()
        rates = [(entry["step"], entry["rate"]) for entry in progress.steps]
        _line(rate, rates, color="0.6", lw=1)
        rate.set_ylabel("learning rate", color="0.5")
        rate.tick_params(colors="0.5")

    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=120, metadata={"Software": None})
    write_whole(root, FILE, data.getvalue())


def _line(axis: Axes, points: Sequence[tuple[float, float]], **style: Any) -> None:
    """Draws a line through (step, value) points; a single point is drawn as a dot."""
    if points:
        axis.plot(*zip(*points, strict=True), marker="" if len(points) > 1 else "o", ms=3, **style)
