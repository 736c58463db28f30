"""The logger TensorBoard: curves, figures and texts in an event file; `tensorboard --logdir FOLDER` shows them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib.util import find_spec

from gear.contracts.hookspecs import hookimpl
from gear.contracts.loggers import LoggedRun, Logger, RunLogger
from gear.contracts.specs import LoggerSpec
from gear.values.errors import FieldError, GearError


@dataclass(frozen=True, slots=True, kw_only=True)
class TensorBoardConfig:
    """Options of the logger.

    Attributes:
        flush_s: seconds after which entries are at the latest on the disk, where TensorBoard reads them.
    """

    flush_s: float = 10.0

    def __post_init__(self) -> None:
        if not 0 <= self.flush_s < math.inf:
            raise FieldError("flush_s", f"must be at least 0 and finite, got {self.flush_s:g}")


class TensorBoard:
    """Opens event files in the format of TensorBoard.

    Args:
        config: the options.
    """

    def __init__(self, config: TensorBoardConfig) -> None:
        self._config = config

    def open(self, run: LoggedRun) -> RunLogger:
        """Opens a new event file in the folder of the log.

        Event files of an interrupted run stay, and TensorBoard no longer shows their entries of the steps that are
        logged once more. A new run deletes the event files of earlier runs.

        Args:
            run: the run, with the folder of its log.
        """
        from gear.plugins.loggers.event_file import EventFile

        return EventFile(run.folder, done=run.done, flush_s=self._config.flush_s)


def build(config: TensorBoardConfig) -> Logger:
    """Makes the logger.

    Args:
        config: the options.

    Raises:
        GearError: tensorboard is not installed.
    """
    if find_spec("tensorboard") is None:
        raise GearError("tensorboard is not installed; pip install 'mujoco-gear[tensorboard]'")
    return TensorBoard(config)


spec = LoggerSpec(
    name="tensorboard",
    summary="Curves, figures and settings of a run, for TensorBoard.",
    config=TensorBoardConfig,
    build=build,
)


@hookimpl
def gear_loggers() -> list[LoggerSpec[TensorBoardConfig]]:
    """Hook of the plugin system: returns the logger plugin that this module defines."""
    return [spec]
