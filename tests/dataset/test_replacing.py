"""Splits that are in the way: what replaces them, and what is said of those of another version of gear."""

from __future__ import annotations

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from gear.dataset import store
from gear.dataset.plan import Plan, read_plan
from gear.dataset.store import Store, remove_split
from gear.formats.png import encode_rgb
from gear.plugins.datasets import open_dataset
from gear.plugins.tasks.common import read_plain, read_rgb
from gear.values.errors import DatasetError, ReplaceableError
from tests.dataset.splits import fill, plan, tree


def test_replacing_a_split_reads_each_of_its_files_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The manifest of a hundred thousand samples is the longest of them."""
    fill(tmp_path, plan())
    read, load = list[Path](), store.load_json

    def counted(path: Path) -> object:
        read.append(path)
        return load(path)

    monkeypatch.setattr(store, "load_json", counted)
    remove_split(tmp_path, "test")
    assert sorted(path.name for path in read) == ["000000.json", "000001.json", "000002.json", "manifest.json"]
    assert not tree(tmp_path)


def test_a_plan_of_another_version_may_be_replaced(tmp_path: Path) -> None:
    """Whoever asks says how: a bench has no --force."""
    fill(tmp_path, plan())
    path = tmp_path / "gear/test/plan.json"
    path.write_text("{}")
    with pytest.raises(ReplaceableError) as caught:
        read_plan(tmp_path, "test")
    assert (caught.value.path, caught.value.problem.split(" (")[0]) == (
        str(tmp_path), "gear/test/plan.json: is not of this version of gear"
    )  # fmt: skip
    assert str(caught.value).endswith("; use another --out, or replace split 'test' with --force")


def test_no_file_is_deleted_that_a_note_on_a_failed_sample_names(tmp_path: Path) -> None:
    fill(tmp_path, plan())
    (tmp_path / "thesis.tex").write_text("mine")
    note = tmp_path / "gear/test/failed/000001.json"
    note.parent.mkdir()
    note.write_text('{"files": {"thesis.tex": ""}, "indexes": {"thesis.tex": ""}}')
    remove_split(tmp_path, "test")
    assert tree(tmp_path) == {"thesis.tex": b"mine"}


def test_no_file_of_another_split_is_deleted_that_a_sidecar_or_a_manifest_names(tmp_path: Path) -> None:
    fill(tmp_path, plan("val"))
    alone = tree(tmp_path)
    fill(tmp_path, plan("test"))
    reserved = {"gear/val/plan.json": "", "gear/val/manifest.json": "", "README.md": ""}
    for name, content in (
        ("samples/000001.json", {"files": reserved}),
        ("manifest.json", {"samples": [{"files": reserved}]}),
    ):
        (tmp_path / "gear/test" / name).write_text(json.dumps(content))
    remove_split(tmp_path, "test")
    assert alone.items() <= tree(tmp_path).items()


def patched(split: str, digest: str) -> Plan:
    given = plan(split, patch={"label": "random", "sha256": digest})
    return dataclasses.replace(given, info=dataclasses.replace(given.info, patch_label="random"))


def test_what_another_split_refuses_is_refused_before_anything_is_replaced(tmp_path: Path) -> None:
    pictures = {"patch_0.png": b"1"}
    for split in ("test", "train"):
        fill(tmp_path, patched(split, "1"))
        Store(tmp_path, patched(split, "1")).open(pictures)
    before = tree(tmp_path)
    semseg = patched("test", "1")
    semseg = dataclasses.replace(semseg, task={**semseg.task, "name": "semseg"})
    with (
        pytest.raises(DatasetError, match="holds a depth dataset, semseg was asked for; use another --out"),
        Store(tmp_path, semseg).begun(pictures, force=True),
    ):
        pass
    assert tree(tmp_path) == before
    with (
        pytest.raises(DatasetError, match="split 'train' shows other patches of the name 'random'; use another --out"),
        Store(tmp_path, patched("test", "2")).begun({"patch_0.png": b"2"}, force=True),
    ):
        pass
    assert tree(tmp_path) == before
    for split in ("test", "train"):
        path = tmp_path / f"gear/{split}/plan.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | {"colour": "blue"}))
    before = tree(tmp_path)
    with (
        pytest.raises(DatasetError, match="or replace split 'test' with --force"),
        Store(tmp_path, patched("train", "1")).begun(pictures, force=True),
    ):
        pass
    assert tree(tmp_path) == before


@pytest.mark.parametrize("digest", ["1", "2"])
def test_what_no_other_split_refuses_is_replaced(tmp_path: Path, digest: str) -> None:
    """Its own plan may be unreadable, its copy of the patches another one or nobody's."""
    fill(tmp_path, plan("train"))
    fill(tmp_path, patched("test", "1"))
    Store(tmp_path, patched("test", "1")).open({"patch_0.png": b"1"})
    (tmp_path / "gear/test/plan.json").write_text("{}")
    with Store(tmp_path, patched("test", digest)).begun({"patch_0.png": digest.encode()}, force=True):
        assert (tmp_path / "gear/patches/random/patch_0.png").read_bytes() == digest.encode()
        assert Store(tmp_path, patched("test", digest)).missing() == [0, 1, 2]
    remove_split(tmp_path, "train")
    remove_split(tmp_path, "test")
    stray = tmp_path / "gear/patches/random/patch_0.png"
    stray.parent.mkdir(parents=True)
    stray.write_bytes(b"stray")
    with Store(tmp_path, patched("test", digest)).begun({"patch_0.png": digest.encode()}, force=True):
        assert stray.read_bytes() == digest.encode()


@pytest.mark.parametrize("damage", [{}, {"colour": "blue"}])
def test_a_copied_split_is_refused_and_takes_nothing_of_the_first_ones_with_it(
    tmp_path: Path, damage: dict[str, str]
) -> None:
    """What it names are the first one's files."""
    fill(tmp_path, plan("train"))
    shutil.copytree(tmp_path / "gear/train", tmp_path / "gear/val")
    path = tmp_path / "gear/val/plan.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | damage))
    before = tree(tmp_path)
    refusal = "gear/val/plan.json: is the plan of split 'train'; a split cannot be copied .*; delete gear/val, or"
    with pytest.raises(DatasetError, match=refusal):
        open_dataset(tmp_path, "val")
    for force in (False, True):
        with pytest.raises(DatasetError, match=refusal), Store(tmp_path, plan("val")).begun({}, force=force):
            pass
    assert tree(tmp_path) == before
    shutil.rmtree(tmp_path / "gear/val")
    assert open_dataset(tmp_path, "train").verify() == []


@pytest.mark.parametrize("relative", ["../secret.png", "linked/secret.png"])
def test_no_picture_is_read_from_outside_of_a_dataset(tmp_path: Path, relative: str) -> None:
    """Whatever its plan and sidecars were edited to say."""
    (tmp_path / "secret.png").write_bytes(encode_rgb(np.zeros((4, 8, 3), np.uint8)))
    (tmp_path / "data").mkdir()
    (tmp_path / "data/linked").symlink_to(tmp_path)
    for read in (read_rgb, read_plain):
        with pytest.raises(DatasetError, match=r"is not a path inside a dataset|leads outside the dataset"):
            read(tmp_path / "data", relative)
