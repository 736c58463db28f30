"""Estimates the rate and the remaining time of a job, as numbers and as text."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Pace:
    """Progress of one job, from which its rate and its remaining time are estimated.

    Attributes:
        unit: counted unit in the singular, such as `sample` or `step`.
        first_done, first_s: number of items that an earlier run had finished, and the time of the first report in
            seconds.
        done, total: finished items and all items in the last report; a total of 0 means that the total is unknown.
        warm_done, warm_s: finished items and time when this run reported its first finished items; that time includes
            all preparation.
    """

    unit: str
    first_done: int
    first_s: float
    done: int
    total: int
    warm_done: int = 0
    warm_s: float | None = None

    def report(self, done: int, total: int, now_s: float) -> None:
        """Records the number of finished items and of all items at the time `now_s` in seconds."""
        if self.warm_s is None and done > self.first_done:
            self.warm_done, self.warm_s = done, now_s
        self.done, self.total = done, total

    def rate(self, now_s: float) -> float:
        """Returns the items per second of this run; 0 before the first item. The slow first items are excluded as
        soon as later ones exist.
        """
        is_warm = self.warm_s is not None and self.done > self.warm_done
        begun, begun_s = (self.warm_done, self.warm_s or 0.0) if is_warm else (self.first_done, self.first_s)
        elapsed_s = now_s - begun_s
        return (self.done - begun) / elapsed_s if elapsed_s > 0 else 0.0

    def left_s(self, now_s: float) -> float | None:
        """Returns the estimated seconds until all items are done; None if the rate or the total is unknown."""
        rate = self.rate(now_s)
        return (self.total - self.done) / rate if rate and self.total else None

    def line(self, now_s: float) -> str:
        """Returns a line for a log, such as `120 of 2000 samples, 3.1 per second, 10 minutes left`."""
        count = f"{self.done} of {self.total}" if self.total else str(self.done)
        parts = [f"{count} {plural(self.unit, self.total or self.done)}"]
        rate, left_s = self.rate(now_s), self.left_s(now_s)
        parts.append(rate_text(rate) if rate else f"{duration_text(now_s - self.first_s)} so far")
        if left_s:
            parts.append(f"{duration_text(left_s)} left")
        return ", ".join(parts)


def rate_text(per_second: float) -> str:
    """Returns a rate as text, such as `3.1 per second`; slow rates are given per minute or per hour."""
    for name, seconds in (("second", 1), ("minute", 60), ("hour", 3600)):
        if per_second * seconds >= 1 or name == "hour":
            return f"{per_second * seconds:.3g} per {name}"
    raise AssertionError


def duration_text(seconds: float) -> str:
    """Returns a duration as text, such as `40 seconds`, `12 minutes`, `3.5 hours` or `2.1 days`."""
    if seconds < 99.5:
        return f"{max(seconds, 1):.0f} {plural('second', round(max(seconds, 1)))}"
    if seconds < 99.5 * 60:
        return f"{seconds / 60:.0f} minutes"
    if seconds < 48 * 3600:
        return f"{seconds / 3600:.1f} hours"
    return f"{seconds / 86400:.1f} days"


def plural(unit: str, count: int) -> str:
    """Returns the unit in the singular if `count` is 1, otherwise in the plural; the number itself is not included."""
    if count == 1:
        return unit
    return unit[:-1] + "ies" if unit.endswith("y") else unit + "s"
