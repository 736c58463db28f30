"""Locks on folders, by which parallel runs detect each other; the system releases the locks of a killed run.

On a file system without locks, every run proceeds as if there were no other runs, and says so in one line.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

from gear.dataset.disk_errors import SYSTEM_LIMITS
from gear.dataset.files import explained
from gear.values.errors import DatasetError
from gear.values.progress import Warn

if sys.platform != "win32":
    import fcntl

__all__ = ["dataset_lock", "exclusive_lock", "is_locked", "lock_note", "shared_split_lock"]

ALONE = "other runs in this folder are not detected, so run one command at a time there"
"""What the lack of locks means for a folder of results."""

SHARED = (
    "runs that share this split may make a sample twice, a sample of a killed run is free again after 15 minutes, and "
    "a run that replaces the split does not detect them; the files are the same in any case"
)
"""What the lack of locks means for a split that several runs collect."""

MOUNTS = Path("/proc/self/mounts")
"""List of the mounted file systems on Linux."""

LOCAL_OPTIONS = {"nolock", "local_lock=all", "local_lock=flock", "localflock", "nobrl"}
"""Mount options of network file systems (NFS, Lustre, CIFS) with which locks do not reach other machines."""


@contextlib.contextmanager
def dataset_lock(root: Path) -> Iterator[None]:
    """A context that locks a dataset against other runs that start or remove splits; it waits until such runs end.

    A missing root is created.

    Raises:
        DatasetError: the root cannot be created.
    """
    while True:
        with explained(root):
            root.mkdir(parents=True, exist_ok=True)
        with _locked(root, exclusive=True, wait=True) as lock:
            # The run that held the lock may have removed the folder that this one waited for.
            if lock is not None and not _is_still(root, lock):
                continue
            yield
            return


@contextlib.contextmanager
def shared_split_lock(folder: Path) -> Iterator[None]:
    """A context that holds a shared lock on a split's folder while a run writes samples.

    Several runs with the same plan may hold the lock.
    """
    with _locked(folder, exclusive=False, wait=True):
        yield


@contextlib.contextmanager
def exclusive_lock(root: Path, on_warning: Warn | None = None) -> Iterator[None]:
    """A context that locks a folder of results for this run only; a missing folder is created.

    Args:
        root: the folder.
        on_warning: called with one line if locks do not work there.

    Raises:
        DatasetError: another run writes into the folder, or the folder cannot be created.
    """
    with explained(root):
        root.mkdir(parents=True, exist_ok=True)
    with contextlib.ExitStack() as work:
        try:
            work.enter_context(_locked(root, exclusive=True, wait=False))
        except BlockingIOError as error:
            problem = "another gear run is using this folder; wait for its end, or use another --out"
            raise DatasetError(root, problem) from error
        if on_warning is not None and (note := lock_note(root, ALONE)) is not None:
            on_warning(note)
        yield


def lock_note(folder: Path, meaning: str) -> str | None:
    """One line that says why locks on a folder do not work, or do not reach other machines.

    Args:
        folder: an existing folder.
        meaning: text that ends the line: what this means for the run. `ALONE` and `SHARED` are such texts.

    Returns:
        The line; None if locks work and reach other machines, as far as this machine can tell.
    """
    problem = _lock_problem(folder)
    return None if problem is None else f"{folder}: {problem}: {meaning}"


def _lock_problem(folder: Path) -> str | None:
    """Why locks on a folder do not work, or work on this machine only; None if they work."""
    if sys.platform == "win32":
        return "this system has no locks on folders"
    try:
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        finally:
            os.close(descriptor)
    except BlockingIOError:  # another run, or this one, holds the lock
        pass
    except OSError as error:
        if error.errno in SYSTEM_LIMITS:
            raise
        return f"the file system has no locks ({error.strerror})"
    option = _local_option(folder)
    return None if option is None else f"locks do not reach other machines (mount option {option})"


def _local_option(folder: Path) -> str | None:
    """The mount option of a folder's file system with which locks hold on this machine only; None if there is none."""
    try:
        lines = MOUNTS.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:  # not Linux
        return None
    path, found = folder.resolve(), ("", "")
    for line in lines:
        _, place, _, options, *_ = [*line.split(" "), "", "", "", ""]
        place = place.replace("\\040", " ")
        if place and path.is_relative_to(place) and len(place) >= len(found[0]):
            found = place, options
    return min(LOCAL_OPTIONS & set(found[1].split(",")), default=None)


def is_locked(folder: Path) -> bool:
    """Whether any run, including this one, is writing samples of a split, and therefore locks its folder."""
    try:
        with _locked(folder, exclusive=True, wait=False):
            return False
    except BlockingIOError:
        return True


@contextlib.contextmanager
def _locked(folder: Path, *, exclusive: bool, wait: bool) -> Iterator[int | None]:
    """Locks a folder and yields its descriptor; None if the file system has no locks.

    Raises:
        BlockingIOError: another run holds the lock, and `wait` is False.
        OSError: a limit of the machine, such as that of open files, is reached.
    """
    descriptor = _lock(folder, exclusive=exclusive, wait=wait)
    try:
        yield descriptor
    finally:
        if descriptor is not None:
            os.close(descriptor)


def _lock(folder: Path, *, exclusive: bool, wait: bool) -> int | None:
    if sys.platform == "win32":
        return None
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError as error:
        if error.errno in SYSTEM_LIMITS:  # without the lock, two runs could write into one folder
            raise
        return None  # missing, or unreadable
    try:
        fcntl.flock(descriptor, (fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH) | (0 if wait else fcntl.LOCK_NB))
    except BaseException as error:
        os.close(descriptor)
        is_limit = isinstance(error, OSError) and error.errno in SYSTEM_LIMITS
        if isinstance(error, OSError) and not isinstance(error, BlockingIOError) and not is_limit:
            return None  # a network file system
        raise
    return descriptor


def _is_still(folder: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(folder.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False
