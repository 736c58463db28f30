"""Claims: locked files by which several runs share the samples of one split.

Before a run makes a sample, it creates the sample's claim, a file in `gear/<split>/claims`, and locks it. When the run
is killed, the system releases the lock, and another run takes the claim over. On a file system without locks, a claim
is taken over if its process no longer runs on this machine, or if the claim is old.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from gear.contracts.executors import Outcome, Report
from gear.dataset.files import explained, inside
from gear.dataset.guarded_paths import opened_parent, owned, refuse_shared, remove_empty_folders, remove_file
from gear.dataset.layout import claim_path, sidecar_path, split_folder
from gear.dataset.scratch import is_alive, lock_of, unique_name
from gear.values.errors import DatasetError

OLD_S = 900.0
"""Age in seconds from which a claim counts as abandoned on a file system without locks; no sample takes as long."""

LONGEST = 1000
"""Number of bytes of a claim that are read."""

TRIES = 100
"""Number of attempts to take a claim: another run may remove the claim, or its folder, between two steps."""

GONE = (
    "is not there on this machine: it was deleted during the run, or an engine of several machines needs an --out that "
    "all of them share"
)

OPENING = os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
READING = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC


class Claims:
    """The claims of one worker: locked files, each of which reserves one sample of a split for the worker's run.

    As a context manager it releases all claims at the end.
    """

    def __init__(self, root: Path, split: str) -> None:
        """Prepares the claims of a worker; no sample is claimed.

        Args:
            root: root of the dataset.
            split: name of the split.
        """
        self._root, self._split = root, split
        self._held: dict[int, int] = {}

    def __enter__(self) -> Claims:
        return self

    def __exit__(self, *_: object) -> None:
        for index in list(self._held):
            self.release(index)

    def take(self, index: int) -> bool:
        """Claims a sample for this worker; returns False if another run has claimed it.

        The claim is a locked file. It holds until `release`, or until the process ends.

        Args:
            index: index of the sample in the split.

        Raises:
            DatasetError: the disk refuses, the root is missing, or the claim's path leads through a link.
        """
        relative = claim_path(self._split, index)
        with explained(self._root / relative):
            for _ in range(TRIES):
                with contextlib.suppress(FileNotFoundError):
                    descriptor = self._opened(relative)
                    if descriptor is None:
                        return False
                    try:
                        if self._is_current(relative, descriptor):
                            self._held[index] = descriptor
                            return True
                    finally:
                        if index not in self._held:
                            os.close(descriptor)
            if not self._root.is_dir():
                raise DatasetError(self._root, GONE)
        return False

    def _opened(self, relative: str) -> int | None:
        """A descriptor of the claim with its lock; None where another run has it."""
        with opened_parent(self._root, relative, make=True) as (folder, name):
            try:
                descriptor = os.open(name, OPENING | os.O_CREAT | os.O_EXCL, 0o666, dir_fd=folder)
                is_new = True
            except FileExistsError:
                descriptor = os.open(name, OPENING, dir_fd=folder)
                is_new = False
        try:
            refuse_shared(descriptor, self._root / relative)
            is_free = lock_of(descriptor)
            if is_free is None:
                is_free = is_new or _is_abandoned(descriptor)
            if is_free:
                os.ftruncate(descriptor, 0)
                os.pwrite(descriptor, unique_name().encode(), 0)
                return descriptor
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)
        return None

    def _is_current(self, relative: str, descriptor: int) -> bool:
        """Whether the locked file is still the claim: the run that had it may have removed it at its end."""
        with opened_parent(self._root, relative) as (folder, name):
            try:
                there = os.stat(name, dir_fd=folder, follow_symlinks=False)
            except FileNotFoundError:
                return False
        return os.path.samestat(there, os.fstat(descriptor))

    def release(self, index: int) -> None:
        """Releases the claim on the sample `index` and deletes its file; does nothing if this worker does not hold the
        claim.
        """
        descriptor = self._held.pop(index, None)
        if descriptor is not None:
            try:
                remove_file(self._root, claim_path(self._split, index))
            finally:
                os.close(descriptor)

    def unclaimed(self, indices: Iterable[int], report: Report) -> Iterator[int]:
        """Claims samples one after another, and yields those that no other run has made or claimed.

        Args:
            indices: indices of samples.
            report: called with an outcome for each sample that another run has made or claimed.
        """
        for index in indices:
            if self.take(index):
                if not inside(self._root, sidecar_path(self._split, index)).exists():
                    yield index
                    continue
                self.release(index)
            report(Outcome(index=index, kind="elsewhere"))

    def holder(self, index: int) -> str:
        """The run that has claimed a sample, as words for a message.

        Args:
            index: index of the sample.

        Returns:
            For example `process 123 on host7`; `another run` if the claim's file cannot be read.

        Raises:
            DatasetError: there is a link in the claim's path.
        """
        relative = claim_path(self._split, index)
        with contextlib.suppress(OSError), opened_parent(self._root, relative) as (folder, name):
            descriptor = os.open(name, READING, dir_fd=folder)
            try:
                text = os.pread(descriptor, LONGEST, 0).decode(errors="replace")
            finally:
                os.close(descriptor)
            host, _, process = text.rpartition("-")[0].rpartition("-")
            if host.isprintable() and host and process.isdecimal():
                return f"process {process} on {host}"
        return "another run"

    def is_taken(self, index: int) -> bool:
        """Whether a run holds the claim on the sample `index`, which means that it is making the sample. The claim of
        this worker counts, too.
        """
        if not self.take(index):
            return True
        self.release(index)
        return False


def clear_claims(root: Path, split: str) -> None:
    """Removes claims that killed runs have left, and the folder of claims if it is empty.

    Args:
        root: root folder of the dataset.
        split: name of the split.

    Raises:
        DatasetError: there is a link in the path of a claim.
    """
    folder = owned(root, claim_path(split, 0)).parent
    with Claims(root, split) as claims:
        for path in sorted(folder.glob("*.claim")) if folder.is_dir() else ():
            if path.stem.isdecimal():
                claims.is_taken(int(path.stem))
    remove_empty_folders(root, f"{split_folder(split)}/claims")


def _is_abandoned(descriptor: int) -> bool:
    """Whether the run that made a claim is gone, where there are no locks.

    The claim of a process that seems to run is abandoned when it is old, too: the number may be another program's now.
    """
    alive = is_alive(os.pread(descriptor, LONGEST, 0).decode(errors="replace"))
    return alive is False or time.time() - os.fstat(descriptor).st_mtime > OLD_S
