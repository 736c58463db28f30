"""Estimates the rate and the remaining time of a job."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Pace:
    """Progress of one job, from which its rate and its remaining time are estimated.

    Attributes:
        unit: counted unit in the singular, such as `sample` or `step`; "" if the title of the job names it.
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
        """Records the number of finished items and of all items at the time `now_s` in seconds.

        A smaller number than before begins another count, such as that of a dataset's next split: its rate is measured
        anew.

        Args:
            done: number of finished items.
            total: number of all items; 0 if it is unknown.
            now_s: time in seconds.
        """
        if done < self.done:
            self.first_done, self.first_s, self.warm_done, self.warm_s = done, now_s, 0, None
        if self.warm_s is None and done > self.first_done:
            self.warm_done, self.warm_s = done, now_s
        self.done, self.total = done, total

    def rate(self, now_s: float) -> float:
        """Returns the items per second of this run; 0 before the first item. The slow first items are excluded as
        soon as later ones exist.

        Args:
            now_s: time in seconds, of the same clock as in `report`.
        """
        is_warm = self.warm_s is not None and self.done > self.warm_done
        begun, begun_s = (self.warm_done, self.warm_s or 0.0) if is_warm else (self.first_done, self.first_s)
        elapsed_s = now_s - begun_s
        return (self.done - begun) / elapsed_s if elapsed_s > 0 else 0.0

    def left_s(self, now_s: float) -> float | None:
        """Returns the estimated seconds until all items are done; None if the rate or the total is unknown.

        Args:
            now_s: time in seconds, of the same clock as in `report`.
        """
        rate = self.rate(now_s)
        return (self.total - self.done) / rate if rate and self.total else None
