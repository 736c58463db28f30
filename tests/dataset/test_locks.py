"""Locks on folders: runs that detect each other, and file systems whose locks fail."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from gear.dataset import locks
from gear.dataset.locks import ALONE, SHARED, dataset_lock, exclusive_lock, is_locked, lock_note, shared_split_lock
from gear.values.errors import DatasetError
from tests.shared import few_files


def test_a_folder_of_results_is_locked_for_one_run(tmp_path: Path) -> None:
    notes: list[str] = []
    with exclusive_lock(tmp_path / "a", notes.append):
        assert lock_note(tmp_path / "a", ALONE) is None, "a lock that is held is one that works"
        with pytest.raises(DatasetError, match="another gear run is using this folder"), exclusive_lock(tmp_path / "a"):
            pass
    with exclusive_lock(tmp_path / "a", notes.append):
        pass
    assert notes == []


def test_several_runs_may_collect_a_split(tmp_path: Path) -> None:
    with shared_split_lock(tmp_path), shared_split_lock(tmp_path):
        assert is_locked(tmp_path)
    assert not is_locked(tmp_path)


@pytest.fixture(params=[errno.ENOLCK, errno.EOPNOTSUPP, errno.EBADF])
def refused(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """A file system that refuses locks; the words of its error."""

    def refuse(descriptor: int, operation: int) -> None:
        raise OSError(request.param, os.strerror(request.param))

    monkeypatch.setattr(locks.fcntl, "flock", refuse)
    return os.strerror(request.param)


def test_a_file_system_without_locks_is_named_once_and_nothing_waits(tmp_path: Path, refused: str) -> None:
    notes: list[str] = []
    with (
        dataset_lock(tmp_path),
        dataset_lock(tmp_path),
        exclusive_lock(tmp_path, notes.append),
        shared_split_lock(tmp_path),
    ):
        assert not is_locked(tmp_path)
    assert notes == [f"{tmp_path}: the file system has no locks ({refused}): {ALONE}"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("rw,relatime,vers=4.2,local_lock=none", None),
        ("rw,vers=3,nolock,local_lock=all", "mount option local_lock=all"),
        ("rw,localflock", "mount option localflock"),
    ],
)
def test_locks_that_stay_on_this_machine_are_known_by_the_mount(
    options: str, said: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "a disk" / "data"
    folder.mkdir(parents=True)
    place = str(folder.parent.resolve()).replace(" ", "\\040")
    mounts = tmp_path / "mounts"
    mounts.write_text(
        f"/dev/root / ext4 rw 0 0\nserver:/x {place} nfs4 {options} 0 0\ntmpfs /elsewhere tmpfs nolock 0 0\n"
    )
    monkeypatch.setattr(locks, "MOUNTS", mounts)
    note = lock_note(folder, SHARED)
    assert note == (None if said is None else f"{folder}: locks do not reach other machines ({said}): {SHARED}")
    assert lock_note(tmp_path, SHARED) is None


def test_without_file_descriptors_no_lock_is_passed_over(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="Too many open files"), few_files(0), exclusive_lock(tmp_path):
        pytest.fail("the folder is not locked")
    with pytest.raises(OSError, match="Too many open files"), few_files(0):
        lock_note(tmp_path, "meaning")
