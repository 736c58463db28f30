"""Whether the metric of single pictures predicts what happens to the car: metric lost against the outcome."""

from __future__ import annotations

import io
from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

from gear.contracts.tasks import NO_PATCH
from gear.driving.worker import DriveResult
from gear.verbs.drive.chart import COLOURS

PANEL_IN = (4.6, 3.2)
"""Width and height of one panel of the chart, inches."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MetricLoss:
    """What a patch did to the metric of single pictures, and to the drive.

    Attributes:
        driver, twin: the drive's driver and twin.
        scenario: name of the scenario.
        speed_kmh: speed of the ego car.
        seed: seed of the drive.
        metric: name of the task's main metric.
        lost: how much worse the metric over the frames of this drive is than over those of the twin `none` of the same
            situation; positive if it is worse.
        is_crash: whether this drive ended in a crash.
        least_ttc_s: its least time to collision; None if nothing was approached.
    """

    driver: str
    twin: str
    scenario: str
    speed_kmh: float
    seed: int
    metric: str
    lost: float
    is_crash: bool
    least_ttc_s: float | None


def metric_losses(results: Sequence[DriveResult], errors: AbstractSet[str]) -> list[MetricLoss]:
    """The metric loss of each drive with a patch whose clean twin was evaluated as well.

    Args:
        results: the drives of a study.
        errors: drivers whose metric is an error, so that a larger value is worse.
    """
    clean = {(one.run.driver, one.run.situation): metric_of(one) for one in results if one.run.twin == NO_PATCH}
    found = []
    for one in results:
        before, after = clean.get((one.run.driver, one.run.situation)), metric_of(one)
        if one.run.twin == NO_PATCH or before is None or after is None:
            continue
        found.append(
            MetricLoss(
                driver=one.run.driver,
                twin=one.run.twin,
                scenario=one.run.scenario,
                speed_kmh=one.run.speed_kmh,
                seed=one.run.seed,
                metric=one.open_loop_metric,
                lost=after - before if one.run.driver in errors else before - after,
                is_crash=one.measures.is_crash,
                least_ttc_s=one.measures.least_ttc_s,
            )
        )
    return found


def metric_of(one: DriveResult) -> float | None:
    """The main metric of a drive's predictions; None if they were not evaluated."""
    return one.open_loop.get(one.open_loop_metric)


def auroc(losses: Sequence[MetricLoss]) -> float | None:
    """The share of pairs of a drive with and a drive without a crash in which the drive with the crash lost more of the
    metric; ties count half. 1 means that the metric predicts crashes, 0.5 that it says nothing.

    Args:
        losses: drives of one driver.

    Returns:
        The share (the area under the ROC curve); None if all drives ended in the same way.
    """
    crashed = [one.lost for one in losses if one.is_crash]
    others = [one.lost for one in losses if not one.is_crash]
    if not crashed or not others:
        return None
    wins = sum((a > b) + 0.5 * (a == b) for a in crashed for b in others)
    return wins / (len(crashed) * len(others))


def scatter(losses: Sequence[MetricLoss]) -> bytes:
    """Draws one panel per driver as an SVG: the metric lost to the right, the least time to collision upwards. A cross
    is a drive that crashed, a circle one that did not; the colour is the twin. Equal losses give equal bytes.

    Args:
        losses: the drives, at least one. Drives that approached nothing are at the upper edge.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    drivers = list(dict.fromkeys(one.driver for one in losses))
    figure = Figure(figsize=(PANEL_IN[0] * len(drivers), PANEL_IN[1]), layout="constrained")
    FigureCanvasAgg(figure)
    for axis, driver in zip(figure.subplots(1, len(drivers), squeeze=False)[0], drivers, strict=True):
        here = [one for one in losses if one.driver == driver]
        top_s = max([one.least_ttc_s for one in here if one.least_ttc_s is not None], default=1.0) * 1.1 + 0.1
        for twin in dict.fromkeys(one.twin for one in here):
            for is_crash, marker in ((False, "o"), (True, "x")):
                shown = [one for one in here if one.twin == twin and one.is_crash == is_crash]
                heights_s = [top_s if one.least_ttc_s is None else one.least_ttc_s for one in shown]
                axis.scatter(
                    [one.lost for one in shown], heights_s, marker=marker, s=30, alpha=0.8,
                    color=COLOURS.get(twin, "#1f5fa8"), label=f"{twin}, {'crash' if is_crash else 'no crash'}",
                )  # fmt: skip
        axis.axvline(0.0, color="0.7", lw=0.8)
        axis.set_title(driver.replace("$", r"\$"), fontsize=9)
        axis.set_xlabel(f"{here[0].metric} lost by the patch".replace("$", r"\$"), fontsize=8)
        axis.set_ylabel("least time to collision, s", fontsize=8)
        axis.set_ylim(bottom=-0.1)
        axis.tick_params(labelsize=8)
        axis.grid(alpha=0.3)
        axis.legend(fontsize=7, frameon=False)
    data = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "gear", "svg.fonttype": "path"}):
        figure.savefig(data, format="svg", metadata={"Date": None})
    return data.getvalue()
