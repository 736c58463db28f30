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
from gear.dataset.guarded_paths import opened_parent, owned, remove_empty_folders, remove_file
from gear.dataset.layout import claim_path, sidecar_path, split_folder
from gear.dataset.scratch import is_alive, lock_of, unique_name

OLD_S = 900.0
"""Age in seconds above which a claim counts as abandoned, if neither a lock nor a process number shows whether its run
is alive. No sample takes so long.
"""

TRIES = 100
"""Number of attempts to take a claim: another run may remove the claim, or its folder, between two steps."""

OPENING = os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC


class Claims:
    """The claims of one worker: locked files, each of which reserves one sample of a split for the worker's run.

    As a context manager it releases all claims at the end.
    """

    def __init__(self, root: Path, split: str) -> None:
        """Args:
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
        """Claims a sample; returns False if another run has claimed it.

        Raises:
            DatasetError: the claim's file cannot be written, or there is a link in its path.
        """
        relative = claim_path(self._split, index)
        with explained(self._root / relative):
            for _ in range(TRIES):
                with contextlib.suppress(FileNotFoundError):
                    descriptor = self._opened(relative)
                    if descriptor is None:
                        return False
                    if self._is_current(relative, descriptor):
                        self._held[index] = descriptor
                        return True
                    os.close(descriptor)
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
        is_free = lock_of(descriptor)
        if is_free is None:
            is_free = is_new or _is_abandoned(descriptor)
        if not is_free:
            os.close(descriptor)
            return None
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, unique_name().encode(), 0)
        return descriptor

    def _is_current(self, relative: str, descriptor: int) -> bool:
        """Whether the locked file is still the claim: the run that had it may have removed it at its end."""
        with opened_parent(self._root, relative) as (folder, name):
            try:
                there = os.stat(name, dir_fd=folder, follow_symlinks=False)
            except FileNotFoundError:
                return False
        return os.path.samestat(there, os.fstat(descriptor))

    def release(self, index: int) -> None:
        """Releases the claim on a sample; does nothing if this worker does not hold it."""
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

    def is_taken(self, index: int) -> bool:
        """Whether a run holds the claim on a sample, which means that it is making the sample."""
        if not self.take(index):
            return True
        self.release(index)
        return False


def clear_claims(root: Path, split: str) -> None:
    """Removes claims that killed runs have left, and the folder of claims if it is empty.

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
    """Whether the run that made a claim is gone, where there are no locks."""
    alive = is_alive(os.pread(descriptor, 1000, 0).decode(errors="replace"))
    if alive is None:
        return time.time() - os.fstat(descriptor).st_mtime > OLD_S
    return not alive
