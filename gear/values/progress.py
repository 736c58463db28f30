"""Callbacks for progress and warnings, which every long-running verb (a command as a Python function) accepts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

Progress = Callable[[int, int], None]
"""Type of the progress callback, called with (done, total). The first call counts the items that an earlier run
finished; a total of 0 means unknown.
"""

PhaseProgress = Callable[[str, int, int], None]
"""Type of the progress callback of a job with several phases, called with (unit, done, total). The unit names what the
phase counts, in the singular, such as `training step`.
"""

PartProgress = Callable[[str, int, int], None]
"""Type of the progress callback for a part of a job that `Progress` does not count, called with (title, done, total).
The title says what is done, such as `checking existing samples`; done and total are 0 if nothing is counted.
"""

Warn = Callable[[str], None]
"""Type of the warning callback, called with one line about a setting that is allowed but may be unintended."""


def _no_progress(done: int, total: int) -> None: ...


def _no_phase(unit: str, done: int, total: int) -> None: ...


def _no_part(title: str, done: int, total: int) -> None: ...


def _no_warning(line: str) -> None: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Callbacks:
    """The callbacks of a running verb (a command as a Python function); by default they do nothing.

    Attributes:
        on_progress: called after every sample, or after every step of an optimisation.
        on_fit_progress: called after every calibration sample that a defense reads for the first time.
        on_fit_phase: called after every step of a phase, such as a training step, while a defense is calibrated that
            reports its phases (`gear.contracts.defenses.FitsInPhases`).
        on_part: called when a part of the work begins that `on_progress` does not count, such as a check of existing
            files, and after every item of it.
        on_warning: called with a warning of one line; equal warnings are passed on once if the object was made by `of`.
    """

    on_progress: Progress = _no_progress
    on_fit_progress: Progress = _no_progress
    on_fit_phase: PhaseProgress = _no_phase
    on_part: PartProgress = _no_part
    on_warning: Warn = _no_warning

    @classmethod
    def of(
        cls,
        *,
        on_progress: Progress | None = None,
        on_fit_progress: Progress | None = None,
        on_fit_phase: PhaseProgress | None = None,
        on_part: PartProgress | None = None,
        on_warning: Warn | None = None,
    ) -> Callbacks:
        """Makes callbacks from the arguments of a verb; None stands for a callback that does nothing. A repeated
        warning is passed on only once.

        Args:
            on_progress: gets the numbers of finished and of all items.
            on_fit_progress: gets the same numbers during the calibration of a defense.
            on_fit_phase: gets the unit and the numbers of a phase of the calibration.
            on_part: gets the title and the numbers of a part of the work that `on_progress` does not count.
            on_warning: gets one line per warning.
        """
        warned: set[str] = set()

        def warn_once(line: str) -> None:
            if on_warning is not None and line not in warned:
                warned.add(line)
                on_warning(line)

        return cls(
            on_progress=on_progress or _no_progress,
            on_fit_progress=on_fit_progress or _no_progress,
            on_fit_phase=on_fit_phase or _no_phase,
            on_part=on_part or _no_part,
            on_warning=warn_once,
        )

    def part(self, title: str) -> Progress:
        """Announces a part of the work that `on_progress` does not count, and returns its progress callback.

        Args:
            title: what is done, such as `checking existing samples`.
        """
        self.on_part(title, 0, 0)
        return partial(self.on_part, title)

    def and_also(self, others: Callbacks) -> Callbacks:
        """Callbacks that call first those of this object, then those of `others`.

        Args:
            others: the callbacks that are called afterwards.
        """

        def both_progress(done: int, total: int) -> None:
            self.on_progress(done, total)
            others.on_progress(done, total)

        def both_fit_progress(done: int, total: int) -> None:
            self.on_fit_progress(done, total)
            others.on_fit_progress(done, total)

        def both_phases(unit: str, done: int, total: int) -> None:
            self.on_fit_phase(unit, done, total)
            others.on_fit_phase(unit, done, total)

        def both_parts(title: str, done: int, total: int) -> None:
            self.on_part(title, done, total)
            others.on_part(title, done, total)

        def both_warnings(line: str) -> None:
            self.on_warning(line)
            others.on_warning(line)

        return Callbacks(
            on_progress=both_progress,
            on_fit_progress=both_fit_progress,
            on_fit_phase=both_phases,
            on_part=both_parts,
            on_warning=both_warnings,
        )


NO_CALLBACKS = Callbacks()
"""Callbacks that do nothing."""
