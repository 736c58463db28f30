from __future__ import annotations

import errno
import os
import socket
from pathlib import Path

import pytest

from gear.values.regular_file import FileTooLargeError, NotAFileError, check_regular, read_regular


def test_a_file_and_a_link_to_it_are_read(tmp_path: Path) -> None:
    path, link = tmp_path / "a", tmp_path / "b"
    path.write_bytes(b"12345")
    link.symlink_to(path)
    assert read_regular(path) == read_regular(str(link)) == b"12345"
    assert read_regular(path, most_bytes=3) == b"123"
    assert check_regular(link) == link


def test_what_would_wait_or_never_end_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "fifo")
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "socket"))
        for path, kind in (
            ("/dev/zero", "character device"), (tmp_path / "fifo", "FIFO"), (tmp_path / "socket", "socket"),
            (tmp_path, "folder"),
        ):  # fmt: skip
            for read in (read_regular, check_regular):
                with pytest.raises(NotAFileError, match=f"is a {kind}; a file was asked for") as caught:
                    read(path)
                assert caught.value.filename == str(path)
                assert caught.value.errno == (errno.EISDIR if kind == "folder" else errno.EINVAL)


def test_a_file_that_becomes_a_fifo_before_it_is_opened_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, opened = tmp_path / "a", os.open
    path.write_bytes(b"1")

    def replaced(target: Path, flags: int) -> int:
        path.unlink()
        os.mkfifo(path)
        return opened(target, flags)

    monkeypatch.setattr(os, "open", replaced)
    with pytest.raises(NotAFileError, match="is a FIFO"):
        read_regular(path)


def test_a_file_that_is_not_there_is_the_usual_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read_regular(tmp_path / "a")


def test_a_file_that_does_not_fit_into_the_memory_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "huge"
    with path.open("wb") as stream:
        stream.truncate(1 << 42)  # it needs no space on the disk
    with pytest.raises(FileTooLargeError, match=r"has 4096\.0 GiB, more than the free memory") as caught:
        read_regular(path)
    assert caught.value.filename == str(path) and caught.value.errno == errno.EFBIG
    assert read_regular(path, most_bytes=3) == bytes(3)
