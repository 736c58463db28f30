"""Merges into an address: the bytes of one run, manifests last, and merges that were stopped."""

from __future__ import annotations

import shutil
from importlib.metadata import version
from pathlib import Path
from typing import Any

import fsspec
import pytest

import gear
from gear.cli.main import main
from gear.values.errors import DatasetError
from tests.dataset.splits import fill, plan, tree


def remote_tree(address: str) -> dict[str, bytes]:
    files = fsspec.filesystem("memory")
    root = "/" + address.removeprefix("memory://")
    return {path.removeprefix(f"{root}/"): files.cat_file(path) for path in files.find(root)}


@pytest.fixture
def parts(tmp_path: Path) -> list[Path]:
    """Two copies of a dataset, of which each lacks a sample; the merge of local folders is in `whole`."""
    content = {"seed": 5, "versions": {"gear": version("mujoco-gear")}}
    fill(tmp_path / "a", plan(content=content | dict.fromkeys(("renderer", "scene", "weather", "assets"))))
    shutil.copytree(tmp_path / "a", tmp_path / "b")
    for name, index in (("a", 0), ("b", 2)):
        (tmp_path / name / f"gear/test/samples/{index:06d}.json").unlink()
    roots = [tmp_path / "a", tmp_path / "b"]
    gear.merge(roots, out=tmp_path / "whole")
    return roots


@pytest.fixture
def written(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The paths that are written in the memory of this process, in order."""
    memory, order = fsspec.filesystem("memory"), list[str]()
    write = memory.pipe_file

    def noted(path: str, data: bytes, **options: Any) -> None:
        order.append(path.removeprefix("/gear-tests/"))
        write(path, data, **options)

    monkeypatch.setattr(memory, "pipe_file", noted)
    return order


def test_the_bytes_are_those_of_a_local_merge_and_the_manifest_is_last(
    parts: list[Path], tmp_path: Path, remote: str, written: list[str]
) -> None:
    report = gear.merge(parts, out=remote)
    assert report.root == remote and report.summary().startswith(f"{remote}: 3 samples in split 'test' from 2")
    assert remote_tree(remote) == tree(tmp_path / "whole")
    assert written[0] == "gear/test/plan.json" and written[-1] == "gear/test/manifest.json"
    for index in range(3):
        sidecar = written.index(f"gear/test/samples/{index:06d}.json")
        mine = [at for at, path in enumerate(written) if path.endswith(f"_{index:04d}.png")]
        assert mine and max(mine) < sidecar


def test_a_merge_that_was_stopped_copies_only_the_rest(
    parts: list[Path], tmp_path: Path, remote: str, written: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    memory = fsspec.filesystem("memory")
    with monkeypatch.context() as broken:
        write = memory.pipe_file

        def stop(path: str, data: bytes, **options: Any) -> None:
            if path.endswith("manifest.json"):
                raise OSError("the network is down")
            write(path, data, **options)

        broken.setattr(memory, "pipe_file", stop)
        with pytest.raises(DatasetError, match=r"cannot write gear/test/manifest\.json \(the network is down\)"):
            gear.merge(parts, out=remote)
    assert "gear/test/manifest.json" not in remote_tree(remote)
    written.clear()
    gear.merge(parts, out=remote)
    assert not [path for path in written if path.endswith((".png", "plan.json"))]
    assert remote_tree(remote) == tree(tmp_path / "whole")


def test_a_folder_with_anything_else_is_refused_and_kept(
    parts: list[Path], remote: str, capsys: pytest.CaptureFixture[str]
) -> None:
    fsspec.filesystem("memory").pipe_file("/gear-tests/notes.txt", b"mine")
    assert main(["merge", *map(str, parts), "--out", remote]) == 2
    assert capsys.readouterr().err.strip() == f"gear: {remote}: is not empty; merge into a new folder"
    assert remote_tree(remote) == {"notes.txt": b"mine"}


def test_a_finished_merge_is_not_written_again(parts: list[Path], remote: str) -> None:
    gear.merge(parts, out=remote)
    with pytest.raises(DatasetError, match="is not empty"):
        gear.merge(parts, out=remote)


def test_an_address_of_this_machine_is_a_path(parts: list[Path], tmp_path: Path) -> None:
    gear.merge(parts, out=f"file://{tmp_path}/c")
    assert tree(tmp_path / "c") == tree(tmp_path / "whole")


def test_a_damaged_sample_is_one_line(parts: list[Path], remote: str) -> None:
    for root in parts:
        next(root.rglob("*.png")).write_bytes(b"damaged")
    with pytest.raises(DatasetError, match=r"\.png"):
        gear.merge(parts, out=remote)
    assert "gear/test/manifest.json" not in remote_tree(remote)
