"""Makes the parts of a dataset's HTML page: one entry per sample, in parallel; a damaged sample does not stop the
others.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from typing import Any
from urllib.parse import quote

from gear.contracts.tasks import Sample, Sidecar
from gear.dataset.reading import Dataset
from gear.values.errors import GearError
from gear.values.frames import UInt8Image
from gear.values.machine import cores
from gear.values.progress import Progress
from gear.values.serial import Json
from gear.view.changes import metrics_of, object_changes, picture_change
from gear.view.channels import Channel, PreviewError, Shown, images, predictions, previews
from gear.view.encoding import Picture, encode, largest_scale
from gear.view.picture_files import is_inside, picture_file
from gear.view.rows import detail, finite, row
from gear.view.sources import Source

PROBES = 6
"""Number of samples, evenly spaced over the split, from which the scale of the pictures is estimated."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Entry:
    """The data of one sample on the page.

    Attributes:
        row: the overview data of the sample, for the index of the page.
        detail: all other metadata of the sample, as zlib-compressed JSON.
        pictures: encoded pictures by channel, such as a camera, a preview or a prediction.
        cameras: by channel, the camera whose pixels coincide with the channel's; None if no camera's do.
        originals: by channel of a camera, link to the dataset's file, which has full size and no losses.
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
        sources: the dataset split whose samples the page lists, followed by its twins, each with its evaluations.
        scale: factor by which the embedded pictures are resized, at most 1.
    """

    sources: tuple[Source, ...]
    scale: float = 1.0

    def entries(self, count: int, on_progress: Progress | None = None) -> Iterator[Entry]:
        """Yields the entries of the first `count` samples in order; several samples are decoded and encoded at the same
        time.

        Args:
            count: number of samples.
            on_progress: called after each sample with the numbers of finished and of all samples.
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

        Args:
            index: index of the sample in the split.

        Raises:
            DatasetError: the sidecar, the JSON file with the sample's metadata, cannot be read.
        """
        sidecar = self.sources[0].dataset.sidecar(index)
        links = _links(self.sources[0], sidecar)
        seen, problems = self._seen(index)
        compared = {
            "pictures": {one.label: one.change for one in seen if one.change is not None},
            "metrics": metrics_of(self.sources, index),
            "objects": object_changes(self.sources, index),
        }
        pictures: dict[Channel, Picture] = {}
        cameras: dict[Channel, str | None] = {}
        originals: dict[Channel, str] = {}
        for one in seen:
            for channel, what in one.shown.items():
                pictures[channel] = encode(what.pixels, self.scale)
                cameras[channel] = what.camera
                if channel.kind == "image":  # at full size, too: the page has it with losses
                    link = _original(one.source, one.source.dataset.sidecar(index), what.pixels)
                    originals |= {} if link is None else {channel: link}
        return Entry(
            row=finite(row(sidecar) | {"compared": compared}),
            detail=deflated(finite(detail(sidecar, links))),
            pictures=pictures,
            cameras=cameras,
            originals=originals,
            problem="; ".join(problems),
        )

    def probe(self, index: int) -> list[UInt8Image]:
        """Returns all pictures of one sample, unscaled, to estimate the size of the page; empty if the sample cannot be
        read.

        Args:
            index: index of the sample in the split.

        Returns:
            (H, W, 3) uint8 pictures.
        """
        return [what.pixels for one in self._seen(index)[0] for what in one.shown.values()]

    def _seen(self, index: int) -> tuple[list[_Seen], list[str]]:
        """Returns the pictures of one sample in every dataset that can be read, and one text per problem."""
        seen: list[_Seen] = []
        problems: list[str] = []
        first: Sample | None = None
        for place, source in enumerate(self.sources):
            if index >= len(source.dataset):
                continue
            sample, problem = _read(source.dataset, index)
            if sample is None:
                problems.append(problem)
                continue
            shown, failures = _shown(source, sample, with_previews=place == 0)
            problems += failures
            change = picture_change(first, sample) if place and first is not None else None
            first = sample if place == 0 else first
            seen.append(_Seen(source=source, shown=shown, label=source.label, change=change))
        return seen, problems


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Seen:
    """The pictures of one sample in one dataset.

    Attributes:
        source: the dataset.
        shown: its pictures by channel.
        label: label of the dataset.
        change: difference of its pictures from those of the page's first dataset, 0..1; None for that dataset.
    """

    source: Source
    shown: dict[Channel, Shown]
    label: str
    change: float | None


def _read(dataset: Dataset[Any], index: int) -> tuple[Sample | None, str]:
    try:
        return dataset[index], ""
    except GearError as error:
        return None, str(error)
    except Exception as error:  # the task may be a third party's
        return None, f"reading failed: {type(error).__name__}: {error}"


def _shown(source: Source, sample: Sample, *, with_previews: bool) -> tuple[dict[Channel, Shown], list[str]]:
    """Returns the pictures of a sample by channel, and one text per problem.

    Twins get no previews, because they have the same ground truth as the page's first dataset.
    """
    dataset, label = source.dataset, source.label
    shown, problems = images(sample, label), []
    drawers: list[Callable[[], dict[Channel, Shown]]] = []
    if with_previews:
        drawers.append(partial(previews, dataset.task, sample, label))
    drawers += [partial(predictions, dataset, part, sample, label) for part in source.evaluated]
    for draw in drawers:
        try:
            shown |= draw()
        except PreviewError as error:
            problems.append(str(error))
    return shown, problems


def _links(source: Source, sidecar: Sidecar) -> dict[str, str]:
    """Returns links to the files of a sample, by path relative to the dataset's root."""
    return {path: source.base_url + quote(path) for path in sidecar.files if is_inside(path)}


def _original(source: Source, sidecar: Sidecar, pixels: UInt8Image) -> str | None:
    """Returns the link to the sample's picture file with exactly these pixels; None if there is none."""
    relative = picture_file(source.dataset.root, sidecar, pixels)
    return None if relative is None else _links(source, sidecar)[relative]


def fitting_scale(builder: Builder, count: int, budget_bytes: float) -> float:
    """The scale at which the pictures of a page fit a budget, estimated from a few samples; nothing is written.

    Args:
        builder: builder with scale 1.
        count: number of samples on the page.
        budget_bytes: bytes for the pictures and the metadata of the samples.

    Returns:
        The factor for width and height, at most 1.
    """
    chosen = sorted({round(i * (count - 1) / (PROBES - 1)) for i in range(PROBES)})
    facts = [len(deflated(finite(detail(builder.sources[0].dataset.sidecar(i), {})))) for i in chosen]
    room = budget_bytes - sum(facts) / len(facts) * count
    return largest_scale(_pictures(builder, chosen), count, room)


def _pictures(builder: Builder, indices: Sequence[int]) -> list[list[UInt8Image]]:
    return [builder.probe(index) for index in indices]


def deflated(value: Json) -> bytes:
    """Returns a JSON value as zlib-compressed UTF-8, which `DecompressionStream` in the page's script decompresses."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return zlib.compress(text.encode("utf-8", "replace"), 6)
