"""The rate and the remaining time of a job, as numbers and as text."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Pace:
    """Progress of one job, with the times at which it was reported.

    Attributes:
        unit: counted unit in the singular, such as `sample` or `step`.
        first_done, first_s: the first report: number of items that an earlier run finished, and its time in seconds.
        done, total: the last report; a total of 0 means that the total is unknown.
        warm_done, warm_s: the report of this run's first finished items, which include all preparation.
    """

    unit: str
    first_done: int
    first_s: float
    done: int
    total: int
    warm_done: int = 0
    warm_s: float | None = None

    def report(self, done: int, total: int, now_s: float) -> None:
        """Adds a report."""
        if self.warm_s is None and done > self.first_done:
            self.warm_done, self.warm_s = done, now_s
        self.done, self.total = done, total

    def rate(self, now_s: float) -> float:
        """Items per second in this run; the first items are left out as soon as there are others; 0 before the first
        item.
        """
        is_warm = self.warm_s is not None and self.done > self.warm_done
        begun, begun_s = (self.warm_done, self.warm_s or 0.0) if is_warm else (self.first_done, self.first_s)
        elapsed_s = now_s - begun_s
        return (self.done - begun) / elapsed_s if elapsed_s > 0 else 0.0

    def left_s(self, now_s: float) -> float | None:
        """Seconds until all items are done; None if the rate or the total is unknown."""
        rate = self.rate(now_s)
        return (self.total - self.done) / rate if rate and self.total else None

    def line(self, now_s: float) -> str:
        """A line for a log, such as `120 of 2000 samples, 3.1 per second, 10 minutes left`."""
        count = f"{self.done} of {self.total}" if self.total else str(self.done)
        parts = [f"{count} {plural(self.unit, self.total or self.done)}"]
        rate, left_s = self.rate(now_s), self.left_s(now_s)
        parts.append(rate_text(rate) if rate else f"{duration_text(now_s - self.first_s)} so far")
        if left_s:
            parts.append(f"{duration_text(left_s)} left")
        return ", ".join(parts)


def rate_text(per_second: float) -> str:
    """A rate as text: `3.1 per second`, or per minute or per hour for slow jobs."""
    for name, seconds in (("second", 1), ("minute", 60), ("hour", 3600)):
        if per_second * seconds >= 1 or name == "hour":
            return f"{per_second * seconds:.3g} per {name}"
    raise AssertionError


def duration_text(seconds: float) -> str:
    """A duration as text, such as `40 seconds`, `12 minutes`, `3.5 hours` or `2.1 days`."""
    if seconds < 99.5:
        return f"{max(seconds, 1):.0f} {plural('second', round(max(seconds, 1)))}"
    if seconds < 99.5 * 60:
        return f"{seconds / 60:.0f} minutes"
    if seconds < 48 * 3600:
        return f"{seconds / 3600:.1f} hours"
    return f"{seconds / 86400:.1f} days"


def plural(unit: str, count: int) -> str:
    """A number with its unit in the singular or plural."""
    if count == 1:
        return unit
    return unit[:-1] + "ies" if unit.endswith("y") else unit + "s"
