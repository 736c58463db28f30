"""The contract of loggers (what every logger plugin promises), as tests.

Subclass it in your plugin's tests and set `spec`:

    class TestMyLogger(LoggerContract):
        spec = my_logger

A logger that sends its entries to a server needs a stand-in for the server, for example a fixture that replaces the
client library.
"""

from __future__ import annotations

import math
import random
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from gear.contracts.loggers import LoggedRun, RunLogger
from gear.contracts.specs import LoggerSpec
from gear.testing.spec_checks import check_spec

SCALAR, PICTURE, TEXT = "validation/objective (up is better)", "patches/patch_0", "config"
"""Names of the entries that the contract logs."""


class LoggerContract:
    """The promises of a logger plugin, as tests.

    Attributes:
        spec: the logger's spec.
        options: options of the logger's config.
    """

    spec: ClassVar[LoggerSpec[Any]]
    options: ClassVar[Mapping[str, Any]] = {}

    def opened(self, folder: Path, done: int = 0) -> RunLogger:
        """The opened log of a run of a new logger.

        Args:
            folder: folder of the log; it exists.
            done: number of steps that earlier runs have finished.
        """
        logger = self.spec.build(self.spec.config(**self.options))
        return logger.open(LoggedRun(verb="attack", title="scene_specific on tiny", folder=folder, done=done))

    def logged(self, log: RunLogger, first: int, last: int) -> None:
        """Logs an entry of each kind for some steps.

        Args:
            log: the opened log.
            first, last: the first and the last step.
        """
        for step in range(first, last + 1):
            log.scalar(SCALAR, step / 10, step)
            log.picture(PICTURE, np.full((12, 24, 3), step, np.uint8), step)
        log.text(TEXT, "# settings\n\n`seed: 0`", last)

    def test_the_spec_can_be_used(self) -> None:
        """Name, summary, protocol and config of the spec are valid."""
        check_spec("logger", self.spec, self.options)

    def test_entries_of_every_kind_are_taken(self, tmp_path: Path) -> None:
        """Curves, pictures of any size and contiguity, texts, and values that are not finite raise no error."""
        log = self.opened(tmp_path)
        self.logged(log, 1, 3)
        for value in (math.nan, math.inf, -math.inf, 0.0, 1e300):
            log.scalar(SCALAR, value, 4)
        wide = np.zeros((1, 7, 3), np.uint8)
        turned = np.arange(4 * 6 * 3, dtype=np.uint8).reshape(4, 6, 3)[::-1, ::2]
        for rgb in (wide, turned):
            log.picture(PICTURE, rgb, 4)
        log.text("a text/with ünïcode & <b>tags</b>", "", 0)
        log.flush()
        log.close()

    def test_an_interrupted_log_is_continued(self, tmp_path: Path) -> None:
        """A log that was not closed is opened again after fewer steps than it has entries of."""
        first = self.opened(tmp_path)
        self.logged(first, 1, 5)
        first.flush()
        second = self.opened(tmp_path, done=3)
        self.logged(second, 4, 6)
        second.close()
        first.close()

    def test_inputs_are_left_alone(self, tmp_path: Path) -> None:
        """A picture is not changed, even after the log is closed."""
        log = self.opened(tmp_path)
        rgb = np.arange(12 * 24 * 3, dtype=np.uint8).reshape(12, 24, 3)
        before = rgb.copy()
        log.picture(PICTURE, rgb, 1)
        log.close()
        assert np.array_equal(rgb, before)

    def test_random_generators_are_left_alone(self, tmp_path: Path) -> None:
        """A log draws no numbers from the global generators of Python, NumPy and torch, on which results may depend."""
        import torch

        def states() -> tuple[object, str, bytes]:
            return random.getstate(), repr(np.random.get_state()), torch.get_rng_state().numpy().tobytes()  # noqa: NPY002

        before = states()
        log = self.opened(tmp_path)
        self.logged(log, 1, 2)
        log.close()
        assert states() == before
