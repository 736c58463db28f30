"""Hashes of files."""

from __future__ import annotations

import hashlib
import os
import threading
from pathlib import Path

import pytest

from gear.dataset.hashing import PIECE_BYTES, file_hash, in_threads
from gear.values.errors import DatasetError


@pytest.mark.parametrize("size", [0, 1, PIECE_BYTES, PIECE_BYTES + 1])
def test_a_hash_is_that_of_the_whole_file(size: int, tmp_path: Path) -> None:
    data = bytes(range(256)) * (size // 256 + 1)
    (tmp_path / "a").write_bytes(data[:size])
    assert file_hash(tmp_path / "a") == hashlib.sha256(data[:size]).hexdigest()


def test_a_missing_file_a_folder_and_a_fifo_are_one_line(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "fifo")
    for path in (tmp_path / "missing", tmp_path, tmp_path / "fifo"):
        with pytest.raises(DatasetError, match=path.name) as caught:
            file_hash(path)
        assert "\n" not in str(caught.value)


def test_results_keep_the_order_of_the_items() -> None:
    first_may_end = threading.Event()

    def call(item: int) -> int:
        if item == 0:
            first_may_end.wait(0.05)
        return item * item

    assert list(in_threads(call, range(20))) == [item * item for item in range(20)]


def test_an_error_reaches_the_caller() -> None:
    def call(item: int) -> float:
        return 1 / item

    with pytest.raises(ZeroDivisionError):
        list(in_threads(call, [1, 0]))
