"""Locks on folders, by which parallel runs detect each other; the system releases the locks of a killed run.

On a file system without locks, every run proceeds as if there were no other runs.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

from gear.dataset.files import explained
from gear.values.errors import DatasetError

if sys.platform != "win32":
    import fcntl

__all__ = ["alone_at_work", "at_work", "is_at_work", "turn"]


@contextlib.contextmanager
def turn(root: Path) -> Iterator[None]:
    """A context that locks a dataset against other runs that start or remove splits; it waits until such runs end.

    A missing root is created.

    Raises:
        DatasetError: the root cannot be created.
    """
    while True:
        with explained(root):
            root.mkdir(parents=True, exist_ok=True)
        with _locked(root, alone=True, wait=True) as lock:
            # The run that held the lock may have removed the folder that this one waited for.
            if lock is not None and not _is_still(root, lock):
                continue
            yield
            return


@contextlib.contextmanager
def at_work(folder: Path) -> Iterator[None]:
    """A context that holds a shared lock on a split's folder while a run writes samples.

    Several runs with the same plan may hold the lock.
    """
    with _locked(folder, alone=False, wait=True):
        yield


@contextlib.contextmanager
def alone_at_work(root: Path) -> Iterator[None]:
    """A context that locks a folder of results for this run only; a missing folder is created.

    Raises:
        DatasetError: another run writes into the folder, or the folder cannot be created.
    """
    with explained(root):
        root.mkdir(parents=True, exist_ok=True)
    with contextlib.ExitStack() as work:
        try:
            work.enter_context(_locked(root, alone=True, wait=False))
        except BlockingIOError as error:
            problem = "another gear run is using this folder; wait for its end, or use another --out"
            raise DatasetError(root, problem) from error
        yield


def is_at_work(folder: Path) -> bool:
    """Whether any run, including this one, is writing samples of a split, and therefore locks its folder."""
    try:
        with _locked(folder, alone=True, wait=False):
            return False
    except BlockingIOError:
        return True


@contextlib.contextmanager
def _locked(folder: Path, *, alone: bool, wait: bool) -> Iterator[int | None]:
    """Locks a folder and yields its descriptor; None if the file system has no locks.

    Raises:
        BlockingIOError: another run holds the lock, and `wait` is False.
    """
    descriptor = _lock(folder, alone=alone, wait=wait)
    try:
        yield descriptor
    finally:
        if descriptor is not None:
            os.close(descriptor)


def _lock(folder: Path, *, alone: bool, wait: bool) -> int | None:
    if sys.platform == "win32":
        return None
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError:  # missing, or unreadable
        return None
    try:
        fcntl.flock(descriptor, (fcntl.LOCK_EX if alone else fcntl.LOCK_SH) | (0 if wait else fcntl.LOCK_NB))
    except BaseException as error:
        os.close(descriptor)
        if isinstance(error, OSError) and not isinstance(error, BlockingIOError):
            return None  # a network file system
        raise
    return descriptor


def _is_still(folder: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(folder.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False
