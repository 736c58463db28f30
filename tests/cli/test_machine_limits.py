from __future__ import annotations

import errno
import os
import resource
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from gear.cli import main as module
from gear.cli.machine_limits import MEMORY, OPEN_FILES, SYSTEM_FILES, THREADS, limit_reached
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (OSError(errno.EMFILE, "Too many open files"), OPEN_FILES),
        (OSError(errno.ENFILE, "Too many open files in system"), SYSTEM_FILES),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), MEMORY),
        (MemoryError(), MEMORY),
        (ImportError("libx.so: cannot open shared object file: Too many open files"), OPEN_FILES),
        (RuntimeError("DefaultCPUAllocator: can't allocate memory: you tried to allocate 8 bytes"), MEMORY),
        (RuntimeError("can't start new thread"), THREADS),
        (cv2.error("OpenCV(4.10) alloc.cpp:73: error: (-4:Insufficient memory) Failed to allocate"), MEMORY),
        (RuntimeError("something else"), None),
        (ValueError("out of memory"), None),
        (FileNotFoundError(errno.ENOENT, "No such file or directory"), None),
    ],
)
def test_machine_limits_are_distinguished_from_bugs(error: Exception, line: str | None) -> None:
    assert limit_reached(error) == line
    outer = ValueError("at the end")
    outer.__cause__ = error
    assert limit_reached(outer) == line


def test_a_limit_is_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def fails(_: object) -> int:
        np.empty(1 << 60, np.uint8)
        return 0

    monkeypatch.setattr(module, "_run", fails)
    assert module.main(["doctor"]) == 2
    assert capsys.readouterr().err == f"gear: {MEMORY}\n"


def test_few_file_descriptors_are_one_line(tmp_path: Path) -> None:
    def few() -> None:
        resource.setrlimit(resource.RLIMIT_NOFILE, (16, 16))

    command = ["collect", "--task", "semseg", "--workers", "2", "--town", str(TINY_TOWN), "--scene", "board"]
    command += ["--split", "debug", "--renderer", "classic", "--set", f"scenes={TINY_SCENES}", "--out", str(tmp_path)]
    done = subprocess.run(
        [sys.executable, "-m", "gear.cli.main", *command], preexec_fn=few, capture_output=True, text=True, check=False,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    said = [line for line in done.stderr.splitlines() if "samples" not in line]  # a slow machine shows progress
    assert len(said) == 1 and said[0].startswith("gear: "), done.stderr
