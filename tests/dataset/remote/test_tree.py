"""Exports to an address: text files after pictures, the list of all files last, and exports that were stopped."""

from __future__ import annotations

import json
from pathlib import Path

import fsspec
import pytest

from gear.dataset.files import sha256
from gear.dataset.remote.folder import RemoteFolder
from gear.dataset.remote.tree import write_remote_tree
from gear.values.errors import DatasetError
from gear.verbs.export import export
from tests.dataset.remote.test_merge import remote_tree
from tests.dataset.splits import fill, plan, tree


def quiet() -> None: ...


def test_an_export_has_the_bytes_of_a_local_one(tmp_path: Path, remote: str) -> None:
    fill(tmp_path / "a", plan())
    export(tmp_path / "a", layout="kitti-depth", out=tmp_path / "b")
    seen: list[tuple[int, int]] = []
    assert export(
        tmp_path / "a", layout="kitti-depth", out=remote, on_progress=lambda *counts: seen.append(counts)
    ) == len(list((tmp_path / "b").rglob("groundtruth/**/*.png")))
    found = remote_tree(remote)
    listed = found.pop("gear-export.json")
    whole = json.loads(listed)
    assert found | {".gear-export.json": listed} == tree(tmp_path / "b")
    assert whole["files"] == {path: {"bytes": len(data), "sha256": sha256(data)} for path, data in found.items()}
    assert whole["layout"] == "kitti-depth" and len(seen) == len(found)
    assert seen == sorted(seen) and (seen[0], seen[-1]) == ((1, 3), (3, 3)), "samples, of a known number"
    with pytest.raises(DatasetError, match="is not empty; export into a new folder"):
        export(tmp_path / "a", layout="kitti-depth", out=remote)


def test_text_files_come_after_pictures_and_the_list_last(remote: str) -> None:
    folder = RemoteFolder(remote)
    order: list[str] = []

    class Noting(RemoteFolder):
        def write(self, relative: str, data: bytes) -> None:
            order.append(relative)
            super().write(relative, data)

    write_remote_tree(Noting(remote), [("a.json", b"{}"), ("b.png", b"1"), ("c.png", b"2")], {"layout": "x"}, quiet)
    assert order == ["gear-export.begun.json", "b.png", "c.png", "a.json", "gear-export.json"]
    assert folder.names() == ["a.json", "b.png", "c.png", "gear-export.json"]


def test_a_stopped_export_of_the_same_data_continues(remote: str) -> None:
    folder = RemoteFolder(remote)

    class StoppedError(Exception):
        pass

    def stopping() -> None:
        raise StoppedError

    files = [("b.png", b"1"), ("c.png", b"2")]
    with pytest.raises(StoppedError):
        write_remote_tree(folder, files, {"layout": "x"}, stopping)
    assert folder.names() == ["b.png", "gear-export.begun.json"]
    with pytest.raises(DatasetError, match="is not empty"):
        write_remote_tree(folder, files, {"layout": "y"}, quiet)
    write_remote_tree(folder, files, {"layout": "x"}, quiet)
    assert folder.names() == ["b.png", "c.png", "gear-export.json"]


def test_two_files_of_one_name_are_refused(remote: str) -> None:
    with pytest.raises(DatasetError, match=r"two samples of the dataset have the same name 'a\.png'"):
        write_remote_tree(RemoteFolder(remote), [("a.png", b"1"), ("a.png", b"2")], {}, quiet)
    assert "gear-export.json" not in RemoteFolder(remote).names()


def test_a_folder_of_others_is_kept(tmp_path: Path, remote: str) -> None:
    fill(tmp_path / "a", plan())
    fsspec.filesystem("memory").pipe_file("/gear-tests/notes.txt", b"mine")
    with pytest.raises(DatasetError, match="is not empty"):
        export(tmp_path / "a", layout="kitti-depth", out=remote)
    assert remote_tree(remote) == {"notes.txt": b"mine"}
