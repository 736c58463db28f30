"""The tables of a study in the closed loop as text."""

from __future__ import annotations

from gear.measuring.text_table import number_table
from gear.plugins.text import printable
from gear.verbs.drive.report import DriveReport, Paired, Rate, Row

TITLES = [
    "driver", "scenario", "twin", "drives", "crashes", "impact km/h", "least m", "least TTC s", "braking delay s",
    "phantom", "left lane", "lateral m", "jerk", "score", "open loop", "p none", "p random",
]  # fmt: skip

SPEED_TITLES = ["driver", "twin", "speed km/h", "drives", "crashes", "impact km/h", "score"]


def text(report: DriveReport) -> str:
    """The tables of a study as text, followed by a legend and by the drives that could not be made.

    Args:
        report: results of the study.
    """
    parts = ["\n".join(number_table(cells(report))), "\n".join(number_table(speed_cells(report))), legend()]
    if report.failed:
        parts.append("\n".join([f"not made: {title}: {problem}" for title, problem in report.failed]))
    return "\n\n".join(parts) + "\n"


def legend() -> str:
    """One line of text that explains the columns of the tables."""
    return (
        "crashes: share of drives, with the exact 95 % interval; impact: mean speed at first contact; least m, least"
        " TTC: means of the least distance and the least time to collision; braking delay: mean, against the twin"
        " none; phantom: share of drives with hard braking for nothing; score: CARLA's driving score; open loop:"
        " the task's main metric over the same frames; p: McNemar's"
        " exact test of the crashes against the twins none and random"
    )


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
         f"{row.score:.2f}"] for row in report.by_speed()
    ]  # fmt: skip
    return [SPEED_TITLES, *rows]


def _cells(row: Row) -> list[str]:
    against = {one.other: one for one in row.paired}
    none = against.get("none")
    return [
        row.driver,
        printable(row.scenario),
        row.twin,
        str(row.crashes.total),
        rate(row.crashes),
        _kmh(row.impact_mps),
        _number(row.least_distance_m, 1),
        _number(row.least_ttc_s, 1),
        "" if none is None else _number(none.braking_delay_s, 2, sign=True),
        share(row.phantoms),
        share(row.off_road),
        f"{row.lateral_peak_m:.2f}",
        f"{row.jerk_rms_mps3:.1f}",
        f"{row.score:.2f}",
        "" if row.open_loop is None else f"{row.open_loop_metric} {row.open_loop:.3f}",
        _p(none),
        _p(against.get("random")),
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


def _p(paired: Paired | None) -> str:
    return "" if paired is None else f"{paired.p:.3f}"
