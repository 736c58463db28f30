"""WebDataset: tar archives, in which the files of a sample follow one another and share the part before the dot."""

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
    """Options of the layout.

    Attributes:
        shard_mb: size that an archive does not exceed, in megabytes (10^6 bytes), 0.01 to 10000. An archive holds at
            least one sample.
    """

    shard_mb: float = 256.0

    def __post_init__(self) -> None:
        check_range("shard_mb", self.shard_mb, 0.01, 10_000)


def webdataset_tree(splits: Sequence[ExportSplit], read: Read, options: WebdatasetOptions) -> Tree:
    """`<split>-000000.tar`, `<split>-000001.tar`, … and `<split>.json`, an index of them (wids, version 1).

    A sample is `000000.<part>.<suffix>` for each of its files, and `000000.json`, its sidecar with scene, ground truth
    and hashes. The same dataset gives the same bytes: members have a fixed order, no time and no owner.

    Args:
        splits: of the dataset, of any task.
        read: the bytes of a file of the dataset, by relative path.
        options: of the layout.
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
    """A POSIX archive (ustar) of files in the order given: mode 644, no time, owner 0 without a name."""
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
