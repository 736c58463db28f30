"""The texts in which progress is reported: the line for a log, rates, durations and counted units."""

from __future__ import annotations

from gear.reporting.pace import Pace


def progress_line(pace: Pace, now_s: float) -> str:
    """Returns a line for a log, such as `120 of 2000 samples, 3.1 per second, 10 minutes left`.

    Args:
        pace: progress of the job.
        now_s: time in seconds.
    """
    count = f"{pace.done} of {pace.total}" if pace.total else str(pace.done)
    parts = [f"{count} {plural(pace.unit, pace.total or pace.done)}" if pace.unit else count]
    rate, left_s = pace.rate(now_s), pace.left_s(now_s)
    parts.append(rate_text(rate) if rate else f"{duration_text(now_s - pace.first_s)} so far")
    if left_s:
        parts.append(f"{duration_text(left_s)} left")
    return ", ".join(parts)


def rate_text(per_second: float) -> str:
    """Returns a rate as text, such as `3.1 per second`; slow rates are given per minute or per hour.

    Args:
        per_second: the rate.
    """
    for name, seconds in (("second", 1), ("minute", 60), ("hour", 3600)):
        if per_second * seconds >= 1 or name == "hour":
            return f"{per_second * seconds:.3g} per {name}"
    raise AssertionError


def duration_text(seconds: float) -> str:
    """Returns a duration as text, such as `40 seconds`, `12 minutes`, `3.5 hours` or `2.1 days`.

    Args:
        seconds: the duration.
    """
    if seconds < 99.5:
        return f"{max(seconds, 1):.0f} {plural('second', round(max(seconds, 1)))}"
    if seconds < 99.5 * 60:
        return f"{seconds / 60:.0f} minutes"
    if seconds < 48 * 3600:
        return f"{seconds / 3600:.1f} hours"
    return f"{seconds / 86400:.1f} days"


def plural(unit: str, count: int) -> str:
    """Returns the unit in the singular if `count` is 1, otherwise in the plural; the number itself is not
    included.

    Args:
        unit: the unit in the singular.
        count: the number.
    """
    if count == 1:
        return unit
    return unit[:-1] + "ies" if unit.endswith("y") else unit + "s"
