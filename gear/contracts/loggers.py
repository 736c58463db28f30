"""The protocol of loggers. A logger writes the curves, figures and settings of a run (an attack, a training or a
benchmark) for a tool in which people watch runs, such as TensorBoard.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from gear.values.frames import UInt8Image


@dataclass(frozen=True, slots=True, kw_only=True)
class LoggedRun:
    """The run whose log a logger opens.

    Attributes:
        verb: the command: `attack`, `train` or `bench`.
        title: title of the run in one line, such as `scene_specific on ddrnet23_slim`.
        folder: folder for the files of the log, in the folder of the run's results; it exists.
        done: number of steps that earlier, interrupted runs have finished; 0 for a new run. The log may have entries of
            later steps, which are logged once more and must then appear once.
    """

    verb: str
    title: str
    folder: Path
    done: int = 0


class RunLogger(Protocol):
    """The log of one run, to which gear adds entries in the order of their steps.

    Steps are counted from 1; entries of step 0 belong to the whole run. gear catches the exceptions of all methods: it
    shows the first one as a warning, and the run continues without a log. A method must not block for long and must not
    draw from the global random generators of Python, NumPy or torch.
    """

    def scalar(self, name: str, value: float, step: int) -> None:
        """Adds a point to a curve.

        Args:
            name: name of the curve. Slashes separate groups, and the name states in brackets which direction is better,
                such as `validation/objective (up is better)`.
            value: the value; it may be NaN or infinite.
            step: number of finished steps.
        """
        ...

    def picture(self, name: str, rgb: UInt8Image, step: int) -> None:
        """Adds a picture to a series of pictures.

        Args:
            name: name of the series, such as `patches/patch_0`.
            rgb: (H, W, 3) uint8 RGB.
            step: number of finished steps.
        """
        ...

    def text(self, name: str, text: str, step: int) -> None:
        """Adds a text.

        Args:
            name: name of the text, such as `config`.
            text: the text as Markdown.
            step: number of finished steps.
        """
        ...

    def flush(self) -> None:
        """Stores all entries. gear calls this method before it writes a checkpoint, so that a run that is killed and
        resumed lacks no entry.
        """
        ...

    def close(self) -> None:
        """Stores all entries and ends the log. It is called once, and no other method is called afterwards."""
        ...


class Logger(Protocol):
    """A tool for logs, of which a plugin registers a `LoggerSpec`."""

    def open(self, run: LoggedRun) -> RunLogger:
        """Opens the log of a run, or continues the log of an interrupted run.

        Args:
            run: the run, with the folder of its log.
        """
        ...
