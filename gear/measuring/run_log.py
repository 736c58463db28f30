"""The log of a run (`--log-to`): opens a logger plugin and passes it curves, figures and texts.

A log never changes the result of a run. If a logger fails, for example because the disk is full, the first failure is
shown as a warning, and the run continues without a log.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from gear.config.overrides import with_overrides
from gear.contracts.loggers import LoggedRun, Logger, RunLogger
from gear.dataset.free_space import free_bytes, size_text
from gear.dataset.guarded_paths import owned, remove_tree
from gear.plugins.build import NO_OPTIONS, blamed, build, find
from gear.plugins.catalogue import PluginEntry
from gear.plugins.text import one_line
from gear.values.errors import GearError
from gear.values.frames import UInt8Image
from gear.values.progress import Warn
from gear.values.serial import Json

FOLDER = "log"
"""Folder of the log in the folder of a run's results."""

RESERVED_BYTES = 200_000_000
"""Free space of the disk that figures leave to the results of the run, bytes."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ChosenLogger:
    """A built logger, and the plugin that it comes from.

    Attributes:
        found: plugin of the logger.
        logger: the logger.
    """

    found: PluginEntry
    logger: Logger


def choose_logger(name: str | None, settings: Iterable[str]) -> ChosenLogger | None:
    """Finds and builds the logger that a user named; None if the user named none.

    Args:
        name: name of a logger plugin; None for no log.
        settings: `KEY=VALUE` texts for the logger's options.

    Raises:
        GearError: there is no such logger, its tool is not installed, an option does not fit, or options were given
            without a logger.
    """
    given = tuple(settings)
    if name is None:
        if given:
            raise GearError("--log-set has options of a logger, and none is named; add --log-to NAME")
        return None
    found = find("logger", name)
    return ChosenLogger(found=found, logger=build(found, with_overrides(NO_OPTIONS, given)))


class RunLog:
    """The log of one run. Without a logger, or after a failure of the logger, all methods do nothing."""

    def __init__(self, chosen: ChosenLogger | None, run: LoggedRun, on_warning: Warn) -> None:
        """Prepares the log; the first call of `begin` opens it.

        Args:
            chosen: the logger; None for no log.
            run: the run; `done` is not used.
            on_warning: called with one line if the logger fails.
        """
        self._chosen, self._run, self._on_warning = chosen, run, on_warning
        self._opened: RunLogger | None = None
        self._has_figures = True

    @property
    def root(self) -> Path:
        """Folder of the run's results, in which the folder of the log is."""
        return self._run.folder.parent

    @property
    def is_on(self) -> bool:
        """Whether entries are logged."""
        return self._chosen is not None

    def begin(self, done: int, config: Json) -> None:
        """Opens the log and logs the configuration of the run; does nothing if the log is open.

        Args:
            done: number of steps that earlier, interrupted runs have finished.
            config: the configuration, as JSON.
        """
        if self._opened is not None or self._chosen is None:
            return
        run, logger = replace(self._run, done=done), self._chosen.logger

        def opened() -> None:
            owned(self.root, run.folder.name)  # the folder must not be a link
            run.folder.mkdir(parents=True, exist_ok=True)
            self._opened = logger.open(run)

        self._guarded(opened)
        title = f"# gear {run.verb}: {run.title}"
        shown = json.dumps(config, indent=2, ensure_ascii=False)
        self.text("config", f"{title}\n\n```json\n{shown}\n```", done)

    def scalar(self, name: str, value: float, step: int) -> None:
        """Logs a point of a curve.

        Args:
            name: name of the curve, with its direction.
            value: the value.
            step: number of finished steps.
        """
        self._call(lambda log: log.scalar(name, float(value), step))

    def scalars(self, values: Mapping[str, float], step: int) -> None:
        """Logs one point of several curves.

        Args:
            values: values by name of the curve.
            step: number of finished steps.
        """
        for name, value in values.items():
            self.scalar(name, value, step)

    def pictures(self, step: int, draw: Callable[[], Mapping[str, UInt8Image]]) -> None:
        """Draws figures and logs them. If they cannot be drawn, the run continues without figures.

        Args:
            step: number of finished steps.
            draw: function that returns (H, W, 3) uint8 RGB pictures by name; called only if they are logged.
        """
        if self._opened is None or not self._has_figures:
            return
        if free_bytes(self._run.folder) < RESERVED_BYTES:
            self._end(f"less than {size_text(RESERVED_BYTES)} are free there, which the results need")
            return
        try:
            drawn = dict(draw())
        except Exception as error:  # a task or a network of another package
            self._has_figures = False
            self._on_warning(f"{self._run.folder}: the log has no figures from step {step} on ({one_line(error)})")
            return
        for name, rgb in drawn.items():
            self._call(lambda log, name=name, rgb=rgb: log.picture(name, rgb, step))  # type: ignore[misc]

    def text(self, name: str, text: str, step: int) -> None:
        """Logs a text.

        Args:
            name: name of the text.
            text: the text as Markdown.
            step: number of finished steps.
        """
        self._call(lambda log: log.text(name, text, step))

    def flush(self) -> None:
        """Makes the logger store all entries; called before a checkpoint is written."""
        self._call(lambda log: log.flush())

    def close(self) -> None:
        """Closes the log; further calls do nothing."""
        opened, self._opened = self._opened, None
        if opened is not None:
            self._guarded(opened.close)
        self._chosen = None

    def _call(self, use: Callable[[RunLogger], None]) -> None:
        if (opened := self._opened) is not None:
            self._guarded(lambda: use(opened))

    def _guarded(self, call: Callable[[], None]) -> None:
        """Calls the logger; after an exception there is no log any more."""
        assert self._chosen is not None
        try:
            with blamed(self._chosen.found, "log"):
                call()
        except (Exception, SystemExit, GeneratorExit) as error:
            self._end(one_line(error))

    def _end(self, problem: str) -> None:
        """Ends the log with a warning."""
        opened, self._opened, self._chosen = self._opened, None, None
        if opened is not None:
            with contextlib.suppress(Exception, SystemExit, GeneratorExit):
                opened.close()
        self._on_warning(f"{self._run.folder}: the log ends here ({problem}); the run continues without it")


def clear_log(root: Path) -> None:
    """Deletes the log of an earlier run.

    Args:
        root: folder of the run's results.
    """
    remove_tree(root, FOLDER)
