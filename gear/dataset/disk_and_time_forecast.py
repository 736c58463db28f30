"""Forecasts the disk space and the time that a job needs, measured on the first items that it makes."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from gear.dataset.free_space import check_free_space, free_bytes, size_text
from gear.reporting.progress_text import duration_text, plural
from gear.values.progress import Warn

FIRST = 3
"""Number of items that the forecast is based on."""

LARGE_BYTES, LONG_S = 2 * 10**9, 1800.0
"""Bytes and seconds above which a job is announced with its size and time."""


class Forecast:
    """Measures the first items of a job, such as samples; stops the job if the disk is too small, and announces the
    size and time of a large job.
    """

    def __init__(
        self,
        root: Path,
        missing: int,
        on_warning: Warn,
        *,
        unit: str = "sample",
        advice: str = "collect fewer with --samples N, or give --out on another disk",
        clock_s: Callable[[], float] = time.monotonic,
    ) -> None:
        """Prepares the forecast of a run.

        Args:
            root: folder into which the job writes.
            missing: number of items to be made.
            on_warning: called once with the disk space and the time of a large job.
            unit: what an item is, in the singular.
            advice: what the user can do if the disk is too small.
            clock_s: clock in seconds, with any zero point.
        """
        self._root, self._missing, self._on_warning, self._clock_s = root, missing, on_warning, clock_s
        self._unit, self._advice = unit, advice
        self._sizes: list[int] = []
        self._first_s = 0.0

    def item_done(self, size_bytes: Callable[[], int]) -> None:
        """Records a finished item; only the first `FIRST` items are measured. After the last of them the forecast is
        made: it may raise the error below or call `on_warning`.

        Args:
            size_bytes: returns the number of bytes of the item's files; called for measured items.

        Raises:
            GearError: the disk has less free space than the missing items need.
        """
        if len(self._sizes) >= min(FIRST, self._missing):
            return
        if not self._sizes:
            self._first_s = self._clock_s()
        self._sizes.append(size_bytes())
        if len(self._sizes) == min(FIRST, self._missing):
            self._forecast()

    def _forecast(self) -> None:
        made, units = len(self._sizes), plural(self._unit, self._missing)
        needed = sum(self._sizes) / made * (self._missing - made)
        what = f"the missing ones of {self._missing} {units} need"
        check_free_space(self._root, needed, what=what, advice=self._advice)
        each_s = (self._clock_s() - self._first_s) / max(made - 1, 1)  # the first one includes compiling the world
        left_s = each_s * (self._missing - made)
        if needed > LARGE_BYTES or left_s > LONG_S:
            self._on_warning(
                f"{self._missing} {units} need about {size_text(needed)} of the "
                f"{size_text(free_bytes(self._root))} that are free, and {duration_text(left_s)}"
            )
