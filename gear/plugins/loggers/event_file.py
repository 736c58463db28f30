"""Writes an event file of TensorBoard, with tensorboard's own messages (protocol buffers) and record format.

torch's `SummaryWriter` writes in a thread: on a full disk that thread prints a traceback, and the caller learns of the
error only at a later call. Here every error is raised by the call that caused it.
"""

from __future__ import annotations

import re
import time
from pathlib import Path

from tensorboard.compat.proto.event_pb2 import Event, SessionLog
from tensorboard.compat.proto.summary_pb2 import Summary
from tensorboard.summary.writer.record_writer import RecordWriter
from torch.utils.tensorboard.summary import text as text_summary

from gear.dataset.guarded_paths import remove_files
from gear.formats.png import encode_rgb
from gear.values.frames import UInt8Image

VERSION = "brain.Event:2"
"""Version of the format; from this version on, a session's start hides earlier entries of the same steps."""

NAME = re.compile(r"events\.out\.tfevents\.(\d{1,12})\.gear")
"""Names of event files. TensorBoard reads the files of a folder in the order of their names."""

RGB = 3
"""Number of channels of a picture, as `Summary.Image.colorspace` states it."""


class EventFile:
    """An event file that is open for writing (`gear.contracts.loggers.RunLogger`).

    Args:
        folder: folder of the log; it exists.
        done: number of steps that earlier runs have finished; 0 deletes the event files of earlier runs.
        flush_s: seconds after which entries are at the latest passed to the operating system.

    Raises:
        OSError: the file cannot be written.
        DatasetError: an event file of an earlier run is a link, or cannot be deleted.
    """

    def __init__(self, folder: Path, *, done: int, flush_s: float) -> None:
        earlier = {path: int(match[1]) for path in folder.iterdir() if (match := NAME.fullmatch(path.name))}
        if not done:
            remove_files(folder, [path.name for path in earlier])
        number = max([int(time.time()), *(last + 1 for last in earlier.values())])
        self._flush_s, self._flushed = flush_s, time.monotonic()
        self._records = RecordWriter((folder / f"events.out.tfevents.{number:010d}.gear").open("xb"))
        self._write(Event(file_version=VERSION))
        if done:
            self._write(Event(step=done + 1, session_log=SessionLog(status=SessionLog.START)))
        self.flush()

    def scalar(self, name: str, value: float, step: int) -> None:
        """Adds a point to a curve.

        Args:
            name: name of the curve.
            value: the value.
            step: number of finished steps.
        """
        self._add(Summary(value=[Summary.Value(tag=name, simple_value=value)]), step)

    def picture(self, name: str, rgb: UInt8Image, step: int) -> None:
        """Adds a picture, as a PNG.

        Args:
            name: name of the series of pictures.
            rgb: (H, W, 3) uint8 RGB.
            step: number of finished steps.
        """
        height, width = rgb.shape[:2]
        image = Summary.Image(height=height, width=width, colorspace=RGB, encoded_image_string=encode_rgb(rgb))
        self._add(Summary(value=[Summary.Value(tag=name, image=image)]), step)

    def text(self, name: str, text: str, step: int) -> None:
        """Adds a text.

        Args:
            name: name of the text.
            text: the text as Markdown.
            step: number of finished steps.
        """
        self._add(text_summary(name, text), step)  # type: ignore[no-untyped-call]

    def flush(self) -> None:
        """Passes all entries to the operating system."""
        self._records.flush()
        self._flushed = time.monotonic()

    def close(self) -> None:
        """Writes all entries and closes the file."""
        self._records.close()

    def _add(self, summary: Summary, step: int) -> None:
        self._write(Event(step=step, summary=summary))
        if time.monotonic() - self._flushed >= self._flush_s:
            self.flush()

    def _write(self, event: Event) -> None:
        event.wall_time = time.time()
        self._records.write(event.SerializeToString())
