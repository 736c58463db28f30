"""Export to WebDataset: tar archives in which the files of a sample are adjacent and share the part of the name before
the dot.
"""

from __future__ import annotations

import io
import tarfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from gear.formats.exports.layout import ExportSplit, Layout, Read, Tree, check_range
from gear.formats.jsontext import dump
from gear.formats.sample_parts import parts_of

Member = tuple[str, bytes]

BLOCK = tarfile.BLOCKSIZE


@dataclass(frozen=True, slots=True, kw_only=True)
class WebdatasetOptions:
    """Options of the export to WebDataset.

    Attributes:
        shard_mb: largest size of an archive in megabytes (10^6 bytes), 0.01 to 10000. An archive with a single sample
            may be larger.
    """

    shard_mb: float = 256.0

    def __post_init__(self) -> None:
        check_range("shard_mb", self.shard_mb, 0.01, 10_000)


def webdataset_tree(splits: Sequence[ExportSplit], read: Read, options: WebdatasetOptions) -> Tree:
    """The tar archives `<split>-000000.tar`, … of a dataset, and for each split an index `<split>.json` in wids format
    1.

    Each file of a sample is called `000000.<part>.<suffix>`. `000000.json` is the sample's sidecar: scene, ground truth
    and hashes. The same dataset gives the same bytes, because members have a fixed order and neither time nor owner.

    Args:
        splits: the finished splits of a dataset of any task.
        read: function that returns the bytes of a file of the dataset, by path relative to its root.
        options: options of this layout.
    """
    most = int(options.shard_mb * 1e6)
    for split in splits:
        index: list[dict[str, object]] = []
        waiting: list[list[Member]] = []
        size = 2 * BLOCK
        for members in _samples(split, read):
            added = sum(_size_of(data) for _, data in members)
            if waiting and _rounded(size + added) > most:
                yield _shard(split.info.split, waiting, index)
                waiting, size = [], 2 * BLOCK
            waiting.append(members)
            size += added
        if waiting:
            yield _shard(split.info.split, waiting, index)
        yield (
            f"{split.info.split}.json",
            dump({"__kind__": "wids-shard-index-v1", "wids_version": 1, "shardlist": index}),
        )


def _samples(split: ExportSplit, read: Read) -> Iterator[list[Member]]:
    """The members of each sample."""
    for sidecar, path in zip(split.sidecars, split.sidecar_paths, strict=True):
        key = f"{sidecar.record.index:06d}"
        files = [(f"{key}.{part.name}.{part.suffix}", read(part.path)) for part in parts_of(sidecar, split.info.split)]
        yield [*files, (f"{key}.json", read(path))]


def _shard(split: str, samples: Sequence[Sequence[Member]], index: list[dict[str, object]]) -> Member:
    """Path and bytes of the next archive of a split, which is added to the split's index."""
    name = f"{split}-{len(index):06d}.tar"
    data = tar_bytes(member for members in samples for member in members)
    index.append({"url": name, "nsamples": len(samples), "filesize": len(data)})
    return name, data


def tar_bytes(members: Iterator[Member]) -> bytes:
    """The bytes of a POSIX tar archive (ustar) with files in the given order: mode 644, time 0, owner 0.

    Args:
        members: name and bytes of each file, in the order in which they are written.
    """
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w", format=tarfile.USTAR_FORMAT) as archive:
        for name, data in members:
            entry = tarfile.TarInfo(name)  # time, owner and group are 0 and "", and the mode is 644
            entry.size = len(data)
            archive.addfile(entry, io.BytesIO(data))
    return stream.getvalue()


def _size_of(data: bytes) -> int:
    """Bytes that a member takes in an archive, with its header."""
    return BLOCK + -(-len(data) // BLOCK) * BLOCK


def _rounded(size: int) -> int:
    """Size of an archive, which is padded to whole records."""
    return -(-size // tarfile.RECORDSIZE) * tarfile.RECORDSIZE


LAYOUT = Layout(
    tasks=(),
    summary="WebDataset: <split>-000000.tar, … with the files of each sample side by side",
    tree=webdataset_tree,
    options=WebdatasetOptions,
)
