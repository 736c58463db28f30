from __future__ import annotations

import errno
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from gear.dataset.files import check_output_file, clear_scratch, inside, named_alone, write_alone, write_whole
from gear.values.errors import DatasetError


def test_a_file_appears_whole_and_leaves_nothing_beside_it(tmp_path: Path) -> None:
    write_whole(tmp_path, "a/b/c.bin", b"12345")
    assert (tmp_path / "a/b/c.bin").read_bytes() == b"12345"
    assert [p.name for p in (tmp_path / "a/b").iterdir()] == ["c.bin"]
    clear_scratch(tmp_path)
    assert not (tmp_path / "gear/scratch").exists()


def test_a_file_of_another_package_has_its_name_only_when_it_is_complete(tmp_path: Path) -> None:
    path = tmp_path / "new/a"
    with named_alone(path) as unfinished:
        unfinished.write_bytes(b"1")
        assert not path.exists()
    with pytest.raises(KeyboardInterrupt), named_alone(path) as unfinished:
        unfinished.write_bytes(b"2")
        raise KeyboardInterrupt
    assert path.read_bytes() == b"1" and [one.name for one in path.parent.iterdir()] == ["a"]
    with pytest.raises(DatasetError, match="is a folder"), named_alone(tmp_path):
        pass


def test_no_device_fifo_socket_or_link_is_replaced_by_a_file(tmp_path: Path) -> None:
    fifo, link, dangling = tmp_path / "fifo", tmp_path / "link", tmp_path / "dangling"
    os.mkfifo(fifo)
    (tmp_path / "file").write_bytes(b"old")
    link.symlink_to(tmp_path / "file")
    dangling.symlink_to(tmp_path / "nothing")
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "socket"))
        before = {path: os.lstat(path).st_ino for path in tmp_path.iterdir()}
        # Only the check itself gets a device: as root, a write that is not refused would replace the device.
        for path, kind in (
            (Path("/dev/null"), "character device"), (Path("/dev/stdout"), "link"), (fifo, "FIFO"),
            (tmp_path / "socket", "socket"), (link, "link"), (dangling, "link"),
        ):  # fmt: skip
            with pytest.raises(DatasetError, match=f"{path}: is a {kind}; "):
                check_output_file(path)
            if path.parent == tmp_path:
                with pytest.raises(DatasetError, match=f"is a {kind}; "):
                    write_alone(path, b"new")
        assert {path: os.lstat(path).st_ino for path in tmp_path.iterdir()} == before
    assert (tmp_path / "file").read_bytes() == b"old"
    with pytest.raises(DatasetError, match="null character"):
        check_output_file(Path("a\0b"))


@pytest.mark.parametrize("relative", ["/etc/passwd", "../x", "a/../../x", "", "a\\b", "a\0b"])
def test_no_path_leaves_the_root(tmp_path: Path, relative: str) -> None:
    with pytest.raises(DatasetError, match="not a path inside"):
        inside(tmp_path, relative)


def test_no_link_leaves_the_root(tmp_path: Path) -> None:
    root = tmp_path / "root"
    root.mkdir()
    (root / "out").symlink_to(tmp_path)
    with pytest.raises(DatasetError, match="through a link"):
        inside(root, "out/x")
    with pytest.raises(DatasetError, match=f"{root}/out: is a link; gear writes and deletes nothing through links"):
        write_whole(root, "out/x", b"")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["root"]


@pytest.mark.parametrize(
    ("number", "message"), [(errno.ENOSPC, "disk is full"), (errno.EROFS, "read-only"), (errno.EACCES, "no permission")]
)
def test_a_refusing_disk_is_one_line_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, message: str
) -> None:
    def refuse(_: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(DatasetError, match=message):
        write_whole(tmp_path, "a.bin", b"1")
    assert not (tmp_path / "a.bin").exists()
    assert list((tmp_path / "gear/scratch").iterdir()) == []


def test_ctrl_c_leaves_nothing_half_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(_: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_alone(tmp_path / "sheet.png", b"1")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(KeyboardInterrupt):
        write_whole(tmp_path, "a.bin", b"1")
    assert not (tmp_path / "a.bin").exists()
    assert list((tmp_path / "gear/scratch").iterdir()) == []


def test_a_file_where_a_folder_should_be(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("x")
    with pytest.raises(DatasetError, match="a file is where a folder should be"):
        write_whole(tmp_path, "a/b", b"1")


def test_tidying_up_beside_a_writer_costs_nothing(tmp_path: Path) -> None:
    """A folder of half-written files goes whenever it is empty, whoever writes next."""
    tidying = (
        "import sys\nfrom pathlib import Path\nfrom gear.dataset.files import clear_scratch\n"
        "while not Path(sys.argv[1], 'end').exists(): clear_scratch(Path(sys.argv[1]))"
    )
    with subprocess.Popen([sys.executable, "-c", tidying, str(tmp_path)], stderr=subprocess.PIPE) as other:
        try:
            for number in range(150):
                write_whole(tmp_path, f"{number}.bin", b"1")
        finally:
            (tmp_path / "end").touch()
        _, errors = other.communicate(timeout=60)
    assert other.returncode == 0, errors
    assert len(list(tmp_path.glob("*.bin"))) == 150


def test_a_folder_that_goes_while_it_is_made_is_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mkdir = os.mkdir

    def there_for_a_moment(path: Path, mode: int = 0o777, *, dir_fd: int | None = None) -> None:
        if Path(path).name == "scratch":
            monkeypatch.setattr("os.mkdir", mkdir)
            raise FileExistsError(errno.EEXIST, "File exists", str(path))
        mkdir(path, mode, dir_fd=dir_fd)

    monkeypatch.setattr("os.mkdir", there_for_a_moment)
    write_whole(tmp_path, "a.bin", b"1")
    assert os.mkdir is mkdir and (tmp_path / "a.bin").read_bytes() == b"1"


def test_a_folder_that_another_run_tidies_up_is_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that closes a split removes its folder of notes; one beside it may just be writing into that."""
    fsync, notes = os.fsync, tmp_path / "gear/test/begun"

    def closed_meanwhile(descriptor: int) -> None:
        fsync(descriptor)
        monkeypatch.setattr("os.fsync", fsync)
        notes.rmdir()

    monkeypatch.setattr("os.fsync", closed_meanwhile)
    write_whole(tmp_path, "gear/test/begun/000003.json", b"[]")
    assert (notes / "000003.json").read_bytes() == b"[]"


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    for path in (tmp_path, Path()):
        with pytest.raises(DatasetError, match="is a folder, a file was asked for"):
            write_alone(path, b"1")
