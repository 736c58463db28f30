"""Makes the parts of a dataset's HTML page: one entry per sample, in parallel; a damaged sample does not stop the
others.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import PurePosixPath
from typing import Any
from urllib.parse import quote

import cv2
import numpy as np

from gear.contracts.tasks import Sample, Sidecar
from gear.dataset.files import inside, read_bytes
from gear.dataset.reading import Dataset
from gear.values.errors import DatasetError, GearError
from gear.values.frames import UInt8Image
from gear.values.machine import cores
from gear.values.progress import Progress
from gear.values.serial import Json
from gear.view.channels import Channel, PreviewError, Shown, images, previews
from gear.view.encoding import Picture, encode, largest_scale
from gear.view.rows import detail, finite, row

PROBES = 6
"""Number of samples, evenly spaced over the split, from which the scale of the pictures is estimated."""

PICTURE_FILES = (".png", ".jpg", ".jpeg", ".webp")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Entry:
    """The data of one sample on the page.

    Attributes:
        row: the overview data of the sample, for the index of the page.
        detail: all other metadata of the sample, as zlib-compressed JSON.
        pictures: encoded pictures by channel, which is a camera or a preview.
        cameras: by channel, the camera whose pixels coincide with the channel's; None if no camera's do.
        originals: by channel, link to the dataset's file at full size, where the page contains a smaller picture.
        problem: why pictures or labels are missing; empty if the entry is complete.
    """

    row: dict[str, Json]
    detail: bytes
    pictures: dict[Channel, Picture] = field(default_factory=dict)
    cameras: dict[Channel, str | None] = field(default_factory=dict)
    originals: dict[Channel, str] = field(default_factory=dict)
    problem: str = ""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Builder:
    """Makes the entries of the page, one per sample.

    Attributes:
        dataset: the dataset split that the page shows.
        base_url: URL of the dataset's root relative to the page; ends in `/`.
        scale: factor by which the embedded pictures are resized, at most 1.
    """

    dataset: Dataset[Any]
    base_url: str
    scale: float = 1.0

    def entries(self, count: int, on_progress: Progress | None = None) -> Iterator[Entry]:
        """Yields the entries of the first `count` samples in order; several samples are decoded and encoded at the
        same time.
        """
        executor = ThreadPoolExecutor(min(8, cores()))
        try:
            for done, entry in enumerate(executor.map(self.entry, range(count)), start=1):
                if on_progress is not None:
                    on_progress(done, count)
                yield entry
        finally:
            executor.shutdown(cancel_futures=True)

    def entry(self, index: int) -> Entry:
        """Returns the entry of one sample; its `problem` says which files cannot be read.

        Raises:
            DatasetError: the sidecar, the JSON file with the sample's metadata, cannot be read.
        """
        sidecar = self.dataset.sidecar(index)
        links = {path: self.base_url + quote(path) for path in sidecar.files if is_inside(path)}
        facts = {"row": finite(row(sidecar)), "detail": deflated(finite(detail(sidecar, links)))}
        sample, problem = self._read(index)
        if sample is None:
            return Entry(problem=problem, **facts)
        shown, problem = self._shown(sample)
        pictures = {channel: encode(what.pixels, self.scale) for channel, what in shown.items()}
        smaller = [channel for channel in shown if channel.kind == "image" and not pictures[channel].is_whole and links]
        return Entry(
            pictures=pictures,
            cameras={channel: what.camera for channel, what in shown.items()},
            originals={c: links[f] for c in smaller if (f := self._original(sidecar, shown[c].pixels)) in links},
            problem=problem,
            **facts,
        )

    def probe(self, index: int) -> list[UInt8Image]:
        """Returns all pictures of one sample, unscaled, to estimate the size of the page; empty if the sample
        cannot be read.
        """
        sample, _ = self._read(index)
        return [] if sample is None else [what.pixels for what in self._shown(sample)[0].values()]

    def _read(self, index: int) -> tuple[Sample | None, str]:
        try:
            return self.dataset[index], ""
        except GearError as error:
            return None, str(error)
        except Exception as error:  # the task may be a third party's
            return None, f"reading failed: {type(error).__name__}: {error}"

    def _shown(self, sample: Sample) -> tuple[dict[Channel, Shown], str]:
        try:
            return images(sample) | previews(self.dataset.task, sample), ""
        except PreviewError as error:
            return images(sample), str(error)

    def _original(self, sidecar: Sidecar, pixels: UInt8Image) -> str | None:
        """Returns the path of the sample's picture file with exactly these pixels; None if there is none."""
        for relative in sidecar.files:
            if PurePosixPath(relative).suffix.lower() in PICTURE_FILES and is_inside(relative):
                try:
                    data = read_bytes(inside(self.dataset.root, relative))
                except DatasetError:
                    continue
                stored = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR) if data else None
                if stored is not None and np.array_equal(stored[..., ::-1], pixels):
                    return relative
        return None


def fitting_scale(builder: Builder, count: int, budget_bytes: float) -> float:
    """Returns the scale, at most 1, at which the pictures of `count` samples fit the budget in bytes, estimated
    from a few samples.
    """
    chosen = sorted({round(i * (count - 1) / (PROBES - 1)) for i in range(PROBES)})
    facts = [len(deflated(finite(detail(builder.dataset.sidecar(i), {})))) for i in chosen]
    room = budget_bytes - sum(facts) / len(facts) * count
    return largest_scale(_pictures(builder, chosen), count, room)


def _pictures(builder: Builder, indices: Sequence[int]) -> list[list[UInt8Image]]:
    return [builder.probe(index) for index in indices]


def deflated(value: Json) -> bytes:
    """Returns a JSON value as zlib-compressed UTF-8, which `DecompressionStream` in the page's script decompresses."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return zlib.compress(text.encode("utf-8", "replace"), 6)


def is_inside(relative: str) -> bool:
    """Whether a relative path from a sample's metadata stays inside the dataset; only such paths are linked on the
    page.
    """
    pure = PurePosixPath(relative)
    return not pure.is_absolute() and ".." not in pure.parts and "\\" not in relative and "\0" not in relative
