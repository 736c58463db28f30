"""Cores and memory that a process may use."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from gear.values import machine
from gear.values.machine import cores, free_memory_bytes, processor_time_s


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system has no CPU affinity")
def test_cores_follow_the_affinity_of_the_process() -> None:
    before = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(before)})
        assert cores() == 1
    finally:
        os.sched_setaffinity(0, before)
    assert cores() == len(before)


@pytest.fixture
def grouped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str, dict[str, str]], None]:
    """Puts this process into control groups: the lines of `/proc/self/cgroup`, and files below `/sys/fs/cgroup`."""

    def put(lines: str, files: dict[str, str]) -> None:
        for name, text in files.items():
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_text(text)
        read = machine._lines

        def lines_of(path: Path) -> list[str]:
            return lines.splitlines() if path == Path("/proc/self/cgroup") else read(path)

        monkeypatch.setattr(machine, "_CONTROL_GROUPS", tmp_path)
        monkeypatch.setattr(machine, "_lines", lines_of)
        monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(16)), raising=False)

    return put


def test_cores_follow_the_quota_of_the_container(grouped: Callable[[str, dict[str, str]], None]) -> None:
    grouped("0::/a/b\n", {"a/b/cpu.max": "150000 100000\n", "a/cpu.max": "max 100000\n"})
    assert cores() == 2


def test_the_tightest_group_counts(grouped: Callable[[str, dict[str, str]], None]) -> None:
    grouped("0::/a/b\n", {"a/b/cpu.max": "max 100000\n", "a/cpu.max": "300000 100000\n"})
    assert cores() == 3


def test_version_1_of_control_groups(grouped: Callable[[str, dict[str, str]], None]) -> None:
    grouped(
        "4:memory:/job\n3:cpu,cpuacct:/job\n",
        {
            "cpu/job/cpu.cfs_quota_us": "400000",
            "cpu/job/cpu.cfs_period_us": "100000",
            "memory/job/memory.limit_in_bytes": "3000000",
            "memory/job/memory.usage_in_bytes": "1000000",
        },
    )
    assert cores() == 4
    assert free_memory_bytes() == 2_000_000


def test_free_memory_is_what_the_container_has_left(grouped: Callable[[str, dict[str, str]], None]) -> None:
    stat = "anon 600000\ninactive_file 250000\n"
    grouped("0::/x\n", {"memory.max": "1000000", "memory.current": "900000", "memory.stat": stat})
    assert free_memory_bytes() == 350_000


def test_without_limits_all_that_is_available_is_free(grouped: Callable[[str, dict[str, str]], None]) -> None:
    grouped("0::/x\n", {"x/memory.max": "max", "x/memory.current": "5", "x/cpu.max": "max 100000"})
    assert cores() == 16
    free = free_memory_bytes()
    assert free is None or free > 50_000_000


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="this system does not report processor time")
def test_the_processor_time_of_a_session_includes_children_and_not_sleep() -> None:
    busy = "import time\nwhile time.process_time() < 0.3: pass"
    code = f"import subprocess, sys, time; subprocess.run([sys.executable, '-c', {busy!r}]); print(1, flush=True)"
    with subprocess.Popen(
        [sys.executable, "-c", f"{code}; time.sleep(600)"], stdout=subprocess.PIPE, start_new_session=True
    ) as child:
        try:
            assert child.stdout is not None and child.stdout.readline() == b"1\n"
            used_s = processor_time_s(child.pid)
            time.sleep(0.5)
            assert 0.3 <= used_s <= processor_time_s(child.pid) <= used_s + 0.1
        finally:
            child.kill()
    assert processor_time_s(child.pid) == 0
