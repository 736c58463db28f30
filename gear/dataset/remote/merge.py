"""Merges folders with parts of a split into a folder at an address of fsspec, such as `s3://bucket/folder`.

Pictures go from the source folders to the address, one sample at a time. Only sidecars, index files and manifests are
also written to this machine's disk.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from gear.dataset.files import inside, read_bytes, write_whole
from gear.dataset.hashing import in_threads
from gear.dataset.layout import manifest_path, plan_path, sidecar_path, split_folder
from gear.dataset.plan import Plan
from gear.dataset.reading import check_hash
from gear.dataset.remote.folder import RemoteFolder
from gear.dataset.sharding.merging import SAMPLES_AT_A_TIME, Parts, files_of, sidecar_of
from gear.values.errors import DatasetError
from gear.values.progress import Progress


def begin_remote_merge(folder: RemoteFolder, staging: Path, plans: Sequence[Plan]) -> None:
    """Writes the plans of the splits to the address, or finds those of an interrupted merge of the same splits.

    Args:
        folder: the folder at the address.
        staging: folder of this machine with the plans.
        plans: plans of the splits that are merged.

    Raises:
        DatasetError: the folder holds anything else, or a file cannot be written.
    """
    there = {plan.info.split: folder.read(plan_path(plan.info.split)) for plan in plans}
    wanted = {split: read_bytes(staging / plan_path(split)) for split in there}
    is_ours = all(data in (None, wanted[split]) for split, data in there.items()) and any(there.values())
    is_whole = all(folder.read(manifest_path(split)) is not None for split in there)
    if folder.names() and (is_whole or not is_ours):
        raise DatasetError(folder.address, "is not empty; merge into a new folder")
    for split, data in wanted.items():
        if there[split] is None:
            folder.write(plan_path(split), data)


def copy_samples_to(parts: Parts, folder: RemoteFolder, staging: Path, on_progress: Progress) -> None:
    """Copies all samples of a split to an address: first the files of a sample, then its sidecar.

    Samples that an interrupted merge has copied are kept.

    Args:
        parts: the source folders.
        folder: the folder at the address.
        staging: folder of this machine that gets the sidecars.
        on_progress: called after every sample.

    Raises:
        DatasetError: a file is missing or damaged, leads outside its folder, or cannot be written.
    """
    total = len(parts.homes)
    on_progress(0, total)
    for start in range(0, total, SAMPLES_AT_A_TIME):
        some = range(start, min(start + SAMPLES_AT_A_TIME, total))
        for index, _ in zip(some, in_threads(partial(_copy_sample, parts, folder, staging), some), strict=True):
            on_progress(index + 1, total)


def _copy_sample(parts: Parts, folder: RemoteFolder, staging: Path, index: int) -> None:
    """Copies one sample, as `copy_samples_to`."""
    relative, data = sidecar_path(parts.split, index), sidecar_of(parts, index)
    source = parts.roots[parts.homes[index][0]]
    if folder.read(relative) != data:
        for name, digest in sorted(files_of(parts, source, index).items()):
            folder.write(name, check_hash(source, name, digest))
        folder.write(relative, data)
    write_whole(staging, relative, data)


def finish_remote_merge(folder: RemoteFolder, staging: Path, splits: Sequence[str]) -> None:
    """Writes all further files of the dataset to the address; the manifests, which mark splits as finished, come last.

    Args:
        folder: the folder at the address.
        staging: folder of this machine with the files.
        splits: names of the splits.

    Raises:
        DatasetError: a file cannot be written.
    """
    sidecars = {inside(staging, f"{split_folder(split)}/samples") for split in splits}
    last = [manifest_path(split) for split in splits]
    paths = [path for path in sorted(staging.rglob("*")) if path.is_file() and path.parent not in sidecars]
    names = [path.relative_to(staging).as_posix() for path in paths]
    done = {plan_path(split) for split in splits} | set(last)
    for name in (*(name for name in names if name not in done), *last):
        folder.write(name, read_bytes(inside(staging, name)))
