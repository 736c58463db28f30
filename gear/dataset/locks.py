"""Which runs are at work on a dataset or on results: locks of folders, which the system lets go of with a killed run.

Where a file system knows no locks, or the system has none of this kind, all runs are taken for lone ones.
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
    """Runs that begin or forget splits of one dataset do so one after the other; makes the root where it is missing.

    Raises:
        DatasetError: the root cannot be made.
    """
    while True:
        with explained(root):
            root.mkdir(parents=True, exist_ok=True)
        with _locked(root, alone=True, wait=True) as lock:
            # Who had the turn before may have taken back all of it, the folder that was waited for included.
            if lock is not None and not _is_still(root, lock):
                continue
            yield
            return


@contextlib.contextmanager
def at_work(folder: Path) -> Iterator[None]:
    """While a run writes what belongs to a split; `folder` is gear's own of it. Several may, if they make the same."""
    with _locked(folder, alone=False, wait=True):
        yield


@contextlib.contextmanager
def alone_at_work(root: Path) -> Iterator[None]:
    """While a run writes results into a folder of its own, which is made where it is missing.

    Raises:
        DatasetError: another run is at work there, or the folder cannot be made.
    """
    with explained(root):
        root.mkdir(parents=True, exist_ok=True)
    with contextlib.ExitStack() as work:
        try:
            work.enter_context(_locked(root, alone=True, wait=False))
        except BlockingIOError as error:
            problem = "another run is at work there just now; wait for its end, or use another --out"
            raise DatasetError(root, problem) from error
        yield


def is_at_work(folder: Path) -> bool:
    """Whether some run is `at_work` there, this one included."""
    try:
        with _locked(folder, alone=True, wait=False):
            return False
    except BlockingIOError:
        return True


@contextlib.contextmanager
def _locked(folder: Path, *, alone: bool, wait: bool) -> Iterator[int | None]:
    """The folder's descriptor while it is locked; None where there is no lock to be had.

    Raises:
        BlockingIOError: others have it, and waiting was not asked for.
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
    except OSError:  # there is no such folder, or it is not for us to read
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
