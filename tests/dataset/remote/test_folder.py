"""Folders at addresses: files are read and written, and every error is one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import fsspec
import pytest

from gear.dataset.remote.folder import RemoteFolder, is_address, local_path
from gear.values.errors import DatasetError


@pytest.mark.parametrize(
    ("out", "is_remote", "path"),
    [
        ("s3://bucket/a", True, None),
        ("memory://a", True, None),
        ("simplecache::gs://bucket/a", True, None),
        ("data/a", False, "data/a"),
        ("C:/data", False, "C:/data"),
        ("file:///data/a%20b", False, "/data/a b"),
        ("local:///data/a", False, "/data/a"),
        (Path("s3://bucket"), False, "s3:/bucket"),
    ],
)
def test_paths_and_addresses(out: str | Path, is_remote: bool, path: str | None) -> None:
    assert is_address(out) == is_remote
    if path is not None:
        assert local_path(out) == Path(path)


def test_files_are_written_and_read(remote: str) -> None:
    folder = RemoteFolder(f"{remote}/folder")
    assert folder.names() == [] and folder.read("a/b.txt") is None
    folder.write("a/b.txt", b"1")
    folder.write("c", b"2")
    assert folder.names() == ["a", "c"] and folder.read("a/b.txt") == b"1"
    folder.write("c", b"3")
    assert RemoteFolder(f"{remote}/folder/").read("c") == b"3"
    folder.remove("c")
    assert folder.names() == ["a"]


@pytest.mark.parametrize(
    "address",
    ["file://{}/a", "local://{}/a", "file://a", "local://a", "dir::file://{}/a", "simplecache::file://{}/a",
     "simplecache::local://{}/a", "simplecache::{}/a", "blockcache::dir::file://{}/a"],
)  # fmt: skip
def test_folders_of_this_machine_are_refused(address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(DatasetError, match="is a folder of this machine; give its path"):
        RemoteFolder(address.format(tmp_path)).write("b", b"1")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("relative", ["../x", "a/../../x", "/x", "a//x", "", "a\\..\\x"])
def test_no_file_is_written_outside(relative: str, remote: str) -> None:
    with pytest.raises(DatasetError, match="is no path of a file in this folder"):
        RemoteFolder(f"{remote}/folder").write(relative, b"")


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("nosuch://a", "no file system can be opened there (Protocol not known: nosuch)"),
        ("s3://bucket/a", "needs s3fs (no module s3fs here); install it with pip"),
    ],
)
def test_an_address_that_cannot_be_opened_is_one_line(address: str, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if address.startswith("s3"):

        def missing(*given: Any, **options: Any) -> None:
            raise ImportError("no module s3fs here\nand more")

        monkeypatch.setattr(fsspec.core, "url_to_fs", missing)
    with pytest.raises(DatasetError) as caught:
        RemoteFolder(address)
    assert str(caught.value) == f"{address}: {said}"


class CredentialsError(Exception):
    """An error of a package's own kind."""


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (PermissionError("Access Denied"), "no permission (Access Denied)"),
        (CredentialsError("Unable to locate credentials\nmore"), "(Unable to locate credentials)"),
        (OSError(), "(OSError)"),
    ],
)
def test_an_error_of_the_file_system_is_one_line(
    error: Exception, said: str, remote: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*given: Any, **options: Any) -> None:
        raise error

    monkeypatch.setattr(fsspec.filesystem("memory"), "pipe_file", fail)
    with pytest.raises(DatasetError, match="cannot write a") as caught:
        RemoteFolder(f"{remote}/folder").write("a", b"")
    assert str(caught.value).endswith(said) and "\n" not in str(caught.value)


@pytest.mark.parametrize(("address", "count"), [("memory://gear-tests/folder", 1), ("s3://gear-tests/folder", 0)])
def test_no_bucket_is_created(address: str, count: int, remote: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Object stores have no folders, and a misspelt bucket is an error."""
    memory, made = fsspec.filesystem("memory"), list[str]()
    monkeypatch.setattr(fsspec.core, "url_to_fs", lambda address: (memory, "/gear-tests/folder"))
    monkeypatch.setattr(memory, "makedirs", lambda path, exist_ok: made.append(path))
    RemoteFolder(address).write("a", b"1")
    assert len(made) == count and memory.cat_file("/gear-tests/folder/a") == b"1"
