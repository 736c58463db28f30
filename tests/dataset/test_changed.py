"""Sidecars that somebody edited: known by the manifest's hashes, and never taken for collected ones."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gear.dataset.store import Store
from gear.plugins.datasets import open_dataset
from gear.values.errors import DatasetError
from tests.dataset.splits import fill, plan, tree

SIDECAR, MANIFEST = "gear/test/samples/000001.json", "gear/test/manifest.json"


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def without_hashes(root: Path) -> None:
    """As former versions wrote it."""
    manifest = json.loads((root / MANIFEST).read_text(encoding="utf-8"))
    del manifest["sidecars"]
    (root / MANIFEST).write_text(json.dumps(manifest), encoding="utf-8")


def test_a_sidecar_that_was_edited_is_not_collected_over(tmp_path: Path) -> None:
    fill(tmp_path, plan())
    whole = tree(tmp_path)
    edit(tmp_path / SIDECAR, '"distance_m": ', '"distance_m": 1')
    assert open_dataset(tmp_path).verify() == [SIDECAR]
    edited = tree(tmp_path)
    for samples in (3, 4):
        with pytest.raises(DatasetError, match=rf"{SIDECAR}: is damaged: .*; `gear verify DIR --repair`"):
            Store(tmp_path, plan(samples=samples)).open({})
    assert tree(tmp_path) == edited
    (tmp_path / SIDECAR).unlink()
    fill(tmp_path, plan())
    assert tree(tmp_path) == whole and open_dataset(tmp_path).verify() == []


def test_a_sidecar_that_another_program_has_rewritten_is_not_collected_over(tmp_path: Path) -> None:
    fill(tmp_path, plan())
    sidecar = json.loads((tmp_path / SIDECAR).read_text(encoding="utf-8"))
    (tmp_path / SIDECAR).write_text(json.dumps(sidecar), encoding="utf-8")
    with pytest.raises(DatasetError, match=rf"{SIDECAR}: is not what the manifest says .*; `gear verify DIR --repair`"):
        Store(tmp_path, plan()).open({})


def test_a_damaged_sidecar_is_reported_before_samples_are_collected(tmp_path: Path) -> None:
    fill(tmp_path, plan())
    sidecar = json.loads((tmp_path / SIDECAR).read_text(encoding="utf-8"))
    sidecar["record"]["seed"] = "five"
    (tmp_path / SIDECAR).write_text(json.dumps(sidecar), encoding="utf-8")
    with pytest.raises(DatasetError, match=r"000001.json: is not a sidecar .*record.seed: expected int, got 'five'"):
        Store(tmp_path, plan()).open({})


def test_datasets_of_former_versions_open_and_go_on(tmp_path: Path) -> None:
    fill(tmp_path / "new", plan())
    fill(tmp_path / "old", plan(samples=2))
    without_hashes(tmp_path / "old")
    assert open_dataset(tmp_path / "old").verify() == [] and len(list(open_dataset(tmp_path / "old"))) == 2
    fill(tmp_path / "old", plan())
    assert tree(tmp_path / "old") == tree(tmp_path / "new")


@pytest.mark.parametrize("hashes", [3, [], {"gear/test/samples/000001.json": 4}])
def test_hashes_that_are_none_are_one_line(tmp_path: Path, hashes: object) -> None:
    fill(tmp_path, plan())
    manifest = json.loads((tmp_path / MANIFEST).read_text(encoding="utf-8"))
    (tmp_path / MANIFEST).write_text(json.dumps(manifest | {"sidecars": hashes}), encoding="utf-8")
    with pytest.raises(DatasetError, match=r"manifest.json: is no manifest of this version of gear \(sidecars"):
        open_dataset(tmp_path)
