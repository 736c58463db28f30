"""The tables of a study in the closed loop as text."""

from __future__ import annotations

from gear.driving.statistics import Paired, Rate
from gear.measuring.intervals import Interval
from gear.measuring.text_table import number_table
from gear.plugins.text import printable
from gear.verbs.drive.metric_against_outcome import auroc
from gear.verbs.drive.report import DriveReport, Row

TITLES = [
    "driver", "scenario", "twin", "drives", "crashes", "impact km/h", "least m", "least TTC s", "braking delay s",
    "phantom", "left lane", "ran red", "lateral m", "jerk", "score", "open loop",
]  # fmt: skip

SPEED_TITLES = [
    "driver", "twin", "speed km/h", "drives", "crashes", "impact km/h", "least m", "least TTC s", "braking delay s",
    "score",
]  # fmt: skip

PAIRED_TITLES = [
    "driver", "scenario", "twin", "against", "pairs", "only here", "only there", "p", "crashes", "least TTC s",
    "braking delay s", "score",
]  # fmt: skip

DEFINITIONS = {
    "twin": "what the boards or the truck show: no patch (none), a random one, or the patch of the driver; twins of one"
    " seed meet the same situation",
    "crashes": "share of the drives in which the car touched a road user or a building, with the exact 95 % interval"
    " of Clopper and Pearson",
    "impact km/h": "mean speed relative to what was hit, at first contact",
    "least m": "mean of the least distances to any road user",
    "least TTC s": "mean of the least times to collision: the time in which the car would touch the nearest road user"
    " in its corridor if both kept their speeds",
    "braking delay s": "mean of the time of the first braking (2 m/s² commanded), less that of the twin none of the"
    " same situation",
    "phantom": "share of the drives with hard braking (3 m/s² commanded over two frames) while no road user is in the"
    " lane or near it",
    "left lane": "share of the drives in which the middle of the car left its lane",
    "ran red": "share of the drives in which the car passed the stop line of a red light",
    "lateral m": "mean of the largest distances from the centre line",
    "jerk": "mean of the root mean squares of the change of the acceleration, m/s³",
    "score": "mean of CARLA's driving score: driven share of the way, times 0.5 for hitting a person, 0.6 for a"
    " vehicle, 0.65 for anything else, 0.7 for a red light that was run, times the share of the way in the lane",
    "open loop": "mean of the task's main metric over the pictures of each drive, against their ground truth",
    "only here, only there": "situations in which only this twin, or only the other one, crashed",
    "p": "two-sided p of McNemar's exact test: how often chance alone gives crashes as unequal as these",
    "differences against the other twin": "this twin minus the other one, with the 95 % interval by the jackknife over"
    " scenarios, in which all seeds of a scenario at one speed and place are left out together; without an interval"
    " where fewer than three scenarios differ",
    "predicts": "share of the pairs of a crashed drive and another one in which the crashed one lost more of the"
    " metric (area under the ROC curve): 1 means that the metric predicts crashes, 0.5 that it says nothing",
}
"""What the columns mean, by title."""


def text(report: DriveReport) -> str:
    """The tables of a study as text, followed by a legend and by the drives that could not be made.

    Args:
        report: results of the study.
    """
    tables = [(cells(report), 3), (speed_cells(report), 3), (paired_cells(report), 4)]
    parts = ["\n".join(number_table(_joined(rows, named))) for rows, named in tables if len(rows) > 1]
    parts += ["\n".join(foretold(report))] * bool(report.losses())
    parts.append("\n".join(f"{title}: {meaning}" for title, meaning in DEFINITIONS.items()))
    if report.failed:
        parts.append("\n".join([f"not made: {title}: {problem}" for title, problem in report.failed]))
    return "\n\n".join(parts) + "\n"


def _joined(rows: list[list[str]], named: int) -> list[list[str]]:
    """Rows whose first `named` cells are joined into one, which is repeated in each block of a wide table."""
    return [[" ".join(row[:named]), *row[named:]] for row in rows]


def foretold(report: DriveReport) -> list[str]:
    """One line per driver: whether the metric lost in single pictures predicts its crashes.

    Args:
        report: results of the study.
    """
    lines = []
    for driver, losses in report.losses().items():
        found = auroc(losses)
        value = "no value, because all drives ended in the same way" if found is None else f"{found:.2f}"
        crashed = sum(one.is_crash for one in losses)
        lines.append(
            f"{driver}: {losses[0].metric} lost by the patch predicts crashes: {value} ({len(losses)} drives with a"
            f" patch, {crashed} crashed)"
        )
    return lines


def cells(report: DriveReport) -> list[list[str]]:
    """The cells of the main table of a study: the titles, then one row per driver, scenario and twin, and one row over
    all scenarios that are not free roads.

    Args:
        report: results of the study.
    """
    return [TITLES, *(_cells(row) for row in report.rows())]


def speed_cells(report: DriveReport) -> list[list[str]]:
    """The cells of the table by speed: the titles, and one row per driver, twin and speed; drives on free roads are
    left out.

    Args:
        report: results of the study.
    """
    rows = [
        [row.driver, row.twin, f"{row.speed_kmh:g}", str(row.crashes.total), rate(row.crashes), _kmh(row.impact_mps),
         _number(row.least_distance_m, 1), _number(row.least_ttc_s, 1), _delay(row), f"{row.score:.2f}"]
        for row in report.by_speed()
    ]  # fmt: skip
    return [SPEED_TITLES, *rows]


def paired_cells(report: DriveReport) -> list[list[str]]:
    """The cells of the table of comparisons between twins: the titles, and one row per driver, scenario, twin and other
    twin.

    Args:
        report: results of the study.
    """
    return [PAIRED_TITLES, *(_paired(row, one) for row in report.rows() for one in row.paired)]


def _paired(row: Row, one: Paired) -> list[str]:
    return [
        row.driver,
        printable(row.scenario),
        row.twin,
        one.other,
        str(one.pairs),
        str(one.only_here),
        str(one.only_there),
        f"{one.p:.3f}",
        _difference(100 * one.crash_difference, one.crash_interval, 0, " %", 100),
        _difference(one.least_ttc_difference_s, one.least_ttc_interval, 2),
        _difference(one.braking_delay_s, one.braking_interval, 2),
        _difference(one.score, one.score_interval, 2),
    ]


def _difference(value: float | None, interval: Interval | None, digits: int, unit: str = "", scale: float = 1.0) -> str:
    """A difference with its interval: `+33 % [+10, +56]`; the interval is multiplied by `scale`."""
    if value is None:
        return ""
    shown = f"{value + 0.0:+.{digits}f}{unit}"
    if interval is None:
        return shown
    low, high = (scale * end for end in interval)
    return f"{shown} [{low:+.{digits}f}, {high:+.{digits}f}]"


def _delay(row: Row) -> str:
    """The mean braking delay against the twin `none`; empty without one."""
    none = next((one for one in row.paired if one.other == "none"), None)
    return "" if none is None else _number(none.braking_delay_s, 2, sign=True)


def _cells(row: Row) -> list[str]:
    return [
        row.driver,
        printable(row.scenario),
        row.twin,
        str(row.crashes.total),
        rate(row.crashes),
        _kmh(row.impact_mps),
        _number(row.least_distance_m, 1),
        _number(row.least_ttc_s, 1),
        _delay(row),
        share(row.phantoms),
        share(row.off_road),
        share(row.ran_red_light),
        f"{row.lateral_peak_m:.2f}",
        f"{row.jerk_rms_mps3:.1f}",
        f"{row.score:.2f}",
        "" if row.open_loop is None else f"{row.open_loop_metric} {row.open_loop:.3f}",
    ]


def rate(value: Rate) -> str:
    """The share `value` with its interval, in percent: `20 % [4, 48]`; empty without drives."""
    if value.interval is None:
        return ""
    low, high = value.interval
    return f"{100 * value.value:.0f} % [{100 * low:.0f}, {100 * high:.0f}]"


def share(value: Rate) -> str:
    """The share `value` in percent; empty without drives."""
    return "" if value.interval is None else f"{100 * value.value:.0f} %"


def _kmh(speed_mps: float | None) -> str:
    return _number(None if speed_mps is None else speed_mps * 3.6, 0)


def _number(value: float | None, digits: int, *, sign: bool = False) -> str:
    if value is None:
        return ""
    return f"{value:+.{digits}f}" if sign else f"{value:.{digits}f}"
