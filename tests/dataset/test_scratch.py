from __future__ import annotations

import fcntl
import os
import platform
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gear.dataset import scratch as module
from gear.dataset.scratch import OLD_S, SCRATCH, SUFFIX, clear_scratch
from gear.values.errors import DatasetError

HERE = platform.node().replace("/", "_")


def left(root: Path, name: str, *, age_s: float = 0) -> Path:
    """A half-written file of another run."""
    path = root / SCRATCH / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"half")
    os.utime(path, (time.time() - age_s,) * 2)
    return path


def finished_process() -> int:
    with subprocess.Popen([sys.executable, "-c", "pass"]) as process:
        process.wait()
    return process.pid


def test_files_without_a_lock_are_deleted_and_files_being_written_stay(tmp_path: Path) -> None:
    gone = finished_process()
    kept = [left(tmp_path, f"{HERE}-{os.getppid()}-1"), left(tmp_path, f"not-{HERE}-{gone}-1"), left(tmp_path, "odd")]
    for name in (f"{HERE}-{gone}-1", f"{HERE}-{os.getpid()}-1", "123-456", f"other-77-abc{SUFFIX}"):
        left(tmp_path, name)
    clear_scratch(tmp_path)
    assert sorted((tmp_path / SCRATCH).iterdir()) == sorted(kept)


@pytest.mark.parametrize("name", ["oldhost-77-140211", "odd", f"oldhost-77-abc{SUFFIX}"])
def test_old_files_of_another_host_without_a_lock_are_deleted(tmp_path: Path, name: str) -> None:
    path = left(tmp_path, name, age_s=OLD_S + 1)
    with path.open("rb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        clear_scratch(tmp_path)
        assert path.exists()
    clear_scratch(tmp_path)
    assert not (tmp_path / "gear").exists()


def test_without_locks_age_and_process_decide(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "lock_of", lambda _: None)
    kept = [left(tmp_path, f"other-77-a{SUFFIX}"), left(tmp_path, f"{HERE}-{os.getppid()}-a{SUFFIX}")]
    left(tmp_path, f"other-77-b{SUFFIX}", age_s=OLD_S + 1)
    left(tmp_path, f"{HERE}-{finished_process()}-b{SUFFIX}")
    clear_scratch(tmp_path)
    assert sorted((tmp_path / SCRATCH).iterdir()) == sorted(kept)


def test_a_writer_holds_its_file_against_other_processes(tmp_path: Path) -> None:
    """As a process of another container: by its lock, whatever its name says."""
    folder = tmp_path / SCRATCH
    folder.mkdir(parents=True)
    script = (
        "import os, sys\nfrom gear.dataset import scratch\nscratch._host = lambda: 'container'\n"
        "folder = os.open(sys.argv[1], os.O_RDONLY)\n"
        "with scratch.half_written(folder, b'half'):\n    print('written', flush=True)\n    sys.stdin.read()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script, str(folder)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        assert other.stdout is not None and other.stdout.readline() == b"written\n"
        clear_scratch(tmp_path)
        assert len(list(folder.iterdir())) == 1
        other.kill()
        other.wait()
    clear_scratch(tmp_path)
    assert not (tmp_path / "gear").exists()


@pytest.mark.parametrize("place", ["gear", SCRATCH])
def test_no_leftover_is_cleared_through_a_link(tmp_path: Path, place: str) -> None:
    victim, root = tmp_path / "victim", tmp_path / "root"
    left(tmp_path, f"oldhost-77-1{SUFFIX}", age_s=OLD_S + 1)
    (tmp_path / ("gear" if place == "gear" else SCRATCH)).rename(victim)
    (root / place).parent.mkdir(parents=True, exist_ok=True)
    (root / place).symlink_to(victim)
    with pytest.raises(DatasetError, match="is a link"):
        clear_scratch(root)
    assert len([path for path in victim.rglob("*") if path.is_file()]) == 1


def test_what_is_no_file_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / SCRATCH / "folder").mkdir(parents=True)
    os.mkfifo(tmp_path / SCRATCH / "fifo")
    clear_scratch(tmp_path)
    assert sorted(path.name for path in (tmp_path / SCRATCH).iterdir()) == ["fifo", "folder"]
