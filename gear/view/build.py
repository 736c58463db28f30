"""Makes the parts of a dataset's page: one entry per sample, in parallel; a damaged sample does not stop the others."""

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
"""Number of samples, spread over the split, from which the scale of the pictures is estimated."""

PICTURE_FILES = (".png", ".jpg", ".jpeg", ".webp")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Entry:
    """One sample, ready for the page.

    Attributes:
        row: its entry in the index.
        detail: all other facts, as deflated JSON.
        pictures: encoded pictures by channel.
        cameras: name of the view with which a channel is aligned, if there is one.
        originals: link to the file with a channel at full size, if the dataset has one and the page does not.
        problem: why pictures or labels are missing; empty where nothing is missing.
    """

    row: dict[str, Json]
    detail: bytes
    pictures: dict[Channel, Picture] = field(default_factory=dict)
    cameras: dict[Channel, str | None] = field(default_factory=dict)
    originals: dict[Channel, str] = field(default_factory=dict)
    problem: str = ""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Builder:
    """Makes the entries.

    Attributes:
        dataset: the split.
        base_url: URL of the dataset's root relative to the page; ends in `/`.
        scale: scale of the embedded pictures.
    """

    dataset: Dataset[Any]
    base_url: str
    scale: float = 1.0

    def entries(self, count: int, on_progress: Progress | None = None) -> Iterator[Entry]:
        """Yields the first `count` samples in order; several are decoded and encoded at the same time."""
        executor = ThreadPoolExecutor(min(8, cores()))
        try:
            for done, entry in enumerate(executor.map(self.entry, range(count)), start=1):
                if on_progress is not None:
                    on_progress(done, count)
                yield entry
        finally:
            executor.shutdown(cancel_futures=True)

    def entry(self, index: int) -> Entry:
        """The entry of one sample; files that cannot be read are named in `problem`.

        Raises:
            DatasetError: its sidecar cannot be read.
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
        """A sample's pictures, to estimate the size of the page."""
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
        """The file of the sample with exactly these pixels, if there is one."""
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
    """The scale at which the pictures of `count` samples fit a budget, estimated from a few of them."""
    chosen = sorted({round(i * (count - 1) / (PROBES - 1)) for i in range(PROBES)})
    facts = [len(deflated(finite(detail(builder.dataset.sidecar(i), {})))) for i in chosen]
    room = budget_bytes - sum(facts) / len(facts) * count
    return largest_scale(_pictures(builder, chosen), count, room)


def _pictures(builder: Builder, indices: Sequence[int]) -> list[list[UInt8Image]]:
    return [builder.probe(index) for index in indices]


def deflated(value: Json) -> bytes:
    """JSON in the form that the page's `DecompressionStream` reads."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return zlib.compress(text.encode("utf-8", "replace"), 6)


def is_inside(relative: str) -> bool:
    """Whether a path of a sidecar stays inside the dataset, so that the page may link it."""
    pure = PurePosixPath(relative)
    return not pure.is_absolute() and ".." not in pure.parts and "\\" not in relative and "\0" not in relative
