"""The progress display of a verb, one of gear's main functions such as `collect`: bars in terminals and notebooks,
plain lines in logs.

Bars are drawn by tqdm. Without a terminal, a thread writes one line every `EVERY_S` seconds, even during a long step. A
log therefore always contains the current state and the remaining time.
"""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import Any, Protocol, TextIO

from gear.reporting.advice import fitted
from gear.reporting.messages import one_line
from gear.reporting.pace import Pace
from gear.reporting.progress_text import duration_text, progress_line
from gear.values.progress import Callbacks

EVERY_S = 30.0
"""Seconds between two plain lines: half a minute, so a log has a line every minute even if the thread is delayed."""

FIT_UNIT = "picture"
"""Unit that the progress of a defense's calibration counts if the defense reports no phases."""

PART = "part "
"""Beginning of the channels that show parts of the work which are not counted with the rest; their title follows."""

FIT = "fit"
"""First word of the channels that show the calibration of a defense."""


class _Backend(Protocol):
    """The interface that the two displays, tqdm bars and plain lines, implement."""

    def update(self, channel: str, unit: str, done: int, total: int) -> None: ...

    def write(self, line: str) -> None: ...

    def begin(self, title: str) -> None: ...

    def detail(self, text: str) -> None: ...

    def close(self) -> None: ...


class Display:
    """A context manager that shows progress and warnings of one verb, such as `collect`, on stderr.

    Attributes:
        callbacks: callbacks to pass to the verb; they update this display.
    """

    def __init__(self, verb: str, *, unit: str = "sample", python: bool = False) -> None:
        """Opens the display on stderr.

        Args:
            verb: name of the verb, such as `collect`; plain lines begin with this name.
            unit: unit, in the singular, that `on_progress` counts.
            python: True for a call from Python, which may run in a notebook; False for the command line.
        """
        self._unit = unit
        self._has_phases = False
        has_bars = sys.stderr.isatty() or (python and _is_notebook())
        self._backend: _Backend = _Bars(is_notebook=python) if has_bars else _Lines(verb)
        self.callbacks = Callbacks.of(
            on_progress=lambda done, total: self._backend.update("progress", self._unit, done, total),
            on_fit_progress=self._show_fit,
            on_fit_phase=self._show_phase,
            on_part=lambda title, done, total: self._backend.update(f"{PART}{title}", "", done, total),
            on_warning=lambda line: self._backend.write(f"gear: note: {one_line(fitted(verb, line))}"),
        )

    def _show_fit(self, done: int, total: int) -> None:
        if not self._has_phases:
            self._backend.update(FIT, FIT_UNIT, done, total)

    def _show_phase(self, unit: str, done: int, total: int) -> None:
        self._has_phases = True  # the defense counts the pictures that it reads itself
        self._backend.update(f"{FIT} {unit}", unit, done, total)

    def write(self, line: str) -> None:
        """Prints a line without damaging a progress bar.

        Args:
            line: the line, without a newline.
        """
        self._backend.write(line)

    def detail(self, text: str) -> None:
        """Shows a short text beside the progress, such as the current loss.

        Args:
            text: the text, which replaces the previous one.
        """
        self._backend.detail(text)

    def begin(self, title: str, unit: str = "sample") -> None:
        """Begins the next step of a job with several steps, and resets the progress.

        Args:
            title: title of the step.
            unit: unit, in the singular, that `on_progress` counts in this step.
        """
        self._unit = unit
        self._has_phases = False
        self._backend.begin(title)

    def __enter__(self) -> Display:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._backend.close()


@contextlib.contextmanager
def displayed(callbacks: Callbacks, verb: str, *, progress: bool, unit: str = "sample") -> Iterator[Callbacks]:
    """Yields the caller's callbacks; if `progress` is True, they also update a progress display, which is closed
    at the end.

    Args:
        callbacks: the caller's callbacks.
        verb: name of the verb, such as `collect`.
        progress: whether a display is shown.
        unit: counted unit in the singular.
    """
    if not progress:
        yield callbacks
        return
    with Display(verb, unit=unit, python=True) as display:
        yield callbacks.and_also(display.callbacks)


class _Bars:
    """A display with one tqdm bar per channel."""

    def __init__(self, *, is_notebook: bool) -> None:
        self._is_notebook = is_notebook
        self._bars: dict[str, Any] = {}

    def update(self, channel: str, unit: str, done: int, total: int) -> None:
        bar = self._bars.get(channel)
        if bar is not None and (done < bar.n or (bar.bar_format and total)):  # another count, or the first of a part
            bar.close()
            bar = None
        if bar is None:
            title = channel.removeprefix(PART) if channel.startswith(PART) else None
            self._bars[channel] = self._make()(
                total=total or None,
                initial=done,
                unit=unit or "it",
                desc=title,
                bar_format="{desc} …" if title and not total else None,
                leave=title is None,
                dynamic_ncols=True,
                smoothing=0.1,
            )
            return
        bar.total = total or None
        bar.update(done - bar.n)

    def _make(self) -> Callable[..., Any]:
        if self._is_notebook:
            from tqdm.auto import tqdm as auto

            made: Callable[..., Any] = auto
            return made
        from tqdm import tqdm

        return tqdm

    def write(self, line: str) -> None:
        from tqdm import tqdm

        tqdm.write(line, file=sys.stderr)

    def begin(self, title: str) -> None:
        self.close()
        self.write(title)

    def detail(self, text: str) -> None:
        for bar in self._bars.values():
            bar.set_postfix_str(text)

    def close(self) -> None:
        for bar in self._bars.values():
            bar.close()
        self._bars = {}


class _Lines:
    """A display with plain lines, written by a thread."""

    def __init__(self, verb: str) -> None:
        self._verb, self._title, self._detail = verb, "", ""
        self._stream: TextIO = sys.stderr
        self._begun_s = time.monotonic()
        self._pace: Pace | None = None
        self._channel = ""
        self._has_written = False
        self._ended = threading.Event()
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._work, name="gear-progress", daemon=True)
        self._thread.start()

    def update(self, channel: str, unit: str, done: int, total: int) -> None:
        with self._lock:
            if self._pace is None or channel != self._channel:
                self._pace = Pace(unit, done, time.monotonic(), done, total)
                self._channel = channel
            self._pace.report(done, total, time.monotonic())

    def write(self, line: str) -> None:
        with self._lock:
            self._stream.write(f"{line}\n")
            self._stream.flush()

    def begin(self, title: str) -> None:
        with self._lock:
            self._title, self._detail, self._pace, self._channel = title, "", None, ""
            self._begun_s = time.monotonic()
        self.write(f"gear {self._verb}: {title}")

    def detail(self, text: str) -> None:
        with self._lock:
            self._detail = text

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        if self._has_written and self._pace is not None:
            self.write(self._line())

    def _work(self) -> None:
        while not self._ended.wait(EVERY_S):
            with contextlib.suppress(ValueError, OSError):  # the stream was closed by another thread
                self.write(self._line())
                self._has_written = True

    def _line(self) -> str:
        now_s = time.monotonic()
        head = f"gear {self._verb}: {self._title + ': ' if self._title else ''}"
        if self._pace is None:
            return f"{head}preparing since {duration_text(now_s - self._begun_s)}"
        step = "calibrating the defense, " if self._channel.startswith(FIT) else ""
        if self._channel.startswith(PART):
            title = self._channel.removeprefix(PART)
            if not self._pace.total:
                return f"{head}{title} since {duration_text(now_s - self._pace.first_s)}"
            step = f"{title}, "
        return f"{head}{step}{progress_line(self._pace, now_s)}{', ' + self._detail if self._detail else ''}"


def _is_notebook() -> bool:
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return shell is not None and "IPKernelApp" in getattr(shell, "config", {})
