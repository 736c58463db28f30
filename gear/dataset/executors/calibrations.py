"""Progress inside an item in workers: a worker reports how far the calibration of a defense, or a part of a long item,
is, and the process of the command shows it.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import partial

from gear.contracts.executors import Outcome, Report
from gear.values.progress import Callbacks, Warn

EVERY_S = 1.0
"""Smallest time between two reports of the same phase, so that a worker sends few messages; the first and the last
report of a phase are always sent.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationProgress:
    """How far a calibration or a part of an item is, as the value of an `Outcome` of the kind `underway`.

    Attributes:
        unit: what the numbers count, such as `training step`; "" for pictures that the defense has read; the title of a
            part.
        done, total: number of finished units, and of all units.
        is_part: whether it is a part of an item instead of a calibration.
    """

    unit: str
    done: int
    total: int
    is_part: bool = False


@dataclass(slots=True, kw_only=True, eq=False)
class CalibrationReports:
    """Reports the progress of calibrations and of parts of items of a worker.

    Attributes:
        report: function that the work of a worker got for its outcomes.
        index: the item that the worker is making.
    """

    report: Report
    index: int = 0
    _sent_s: dict[str, float] = field(default_factory=dict)

    def callbacks(self, on_warning: Warn | None = None) -> Callbacks:
        """Returns callbacks for the code that calibrates; progress of other kinds is not reported.

        Args:
            on_warning: called with warnings; None drops them.
        """
        return Callbacks.of(
            on_fit_progress=lambda done, total: self._send("", done, total),
            on_fit_phase=self._send,
            on_part=partial(self._send, is_part=True),
            on_warning=on_warning,
        )

    def _send(self, unit: str, done: int, total: int, *, is_part: bool = False) -> None:
        now_s = time.monotonic()
        if done < total and now_s - self._sent_s.get(unit, -EVERY_S) < EVERY_S:
            return
        self._sent_s[unit] = now_s
        value = CalibrationProgress(unit=unit, done=done, total=total, is_part=is_part)
        self.report(Outcome(index=self.index, kind="underway", value=value))


@dataclass(slots=True, kw_only=True, eq=False)
class ShownCalibrations:
    """Passes the calibrations of workers on to the callbacks of the command: one at a time, because a display has one
    bar for a calibration.

    Attributes:
        callbacks: callbacks of the command.
        index: the item whose calibration is shown, until the item has ended; None for none.
    """

    callbacks: Callbacks
    index: int | None = None

    def takes(self, outcome: Outcome) -> bool:
        """Returns whether an outcome is a report on a calibration, after passing it on.

        Args:
            outcome: any outcome that a worker has reported.
        """
        if outcome.kind != "underway":
            self.index = None if self.index == outcome.index else self.index
            return False
        self.index = outcome.index if self.index is None else self.index
        if self.index == outcome.index:
            assert isinstance(outcome.value, CalibrationProgress)
            unit, done, total = outcome.value.unit, outcome.value.done, outcome.value.total
            if outcome.value.is_part:
                self.callbacks.on_part(unit, done, total)
            elif unit:
                self.callbacks.on_fit_phase(unit, done, total)
            else:
                self.callbacks.on_fit_progress(done, total)
        return True
