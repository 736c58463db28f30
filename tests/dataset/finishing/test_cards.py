import dataclasses
import itertools
import os
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from gear.dataset.files import sha256
from gear.dataset.finishing.cards import cards, damaged_cards, own_cards, write_cards
from gear.dataset.json_text import load_json
from gear.dataset.layout import CARDS
from gear.dataset.sealed_json import load_sealed
from gear.dataset.store import remove_split
from gear.values.errors import DatasetError
from tests.dataset.splits import fill, plan, tree


def test_a_finished_split_has_both_files_and_an_unfinished_one_has_none(tmp_path: Path) -> None:
    fill(tmp_path, plan(), is_closed=False)
    assert cards(tmp_path) == {} and not any((tmp_path / name).exists() for name in CARDS)
    fill(tmp_path, plan())
    assert {name: (tmp_path / name).read_bytes() for name in CARDS} == cards(tmp_path)
    front = yaml.safe_load((tmp_path / "README.md").read_text().split("---\n")[1])
    assert front["task_categories"] == ["depth-estimation"] and front["license"] == "mit"
    found = {one["config_name"]: one["data_files"] for one in front["configs"]}
    assert found["gtfine_tiff"] == [{"split": "test", "path": ["gtFine/test/*.tiff"]}]
    assert next(iter(found)) == "leftimg8bit"
    for name, files in found.items():
        (glob,) = files[0]["path"]
        assert len(list(tmp_path.glob(glob))) == 3, name


def test_croissant_lists_the_files_of_all_splits_with_hashes(tmp_path: Path) -> None:
    fill(tmp_path, plan("train"))
    fill(tmp_path, plan("val", 2))
    content = load_sealed(tmp_path / "croissant.json")
    objects = {one["@id"]: one for one in content["distribution"] if one["@type"] == "cr:FileObject"}
    assert {"gear/train/manifest.json", "gear/val/manifest.json", "filenames/val_list.txt"} <= objects.keys()
    for path, one in objects.items():
        assert one["sha256"] == sha256((tmp_path / path).read_bytes())
    sets = {one["@id"]: one["includes"] for one in content["distribution"] if one["@type"] == "cr:FileSet"}
    assert {name: sum(len(list(tmp_path.glob(glob))) for glob in globs) for name, globs in sets.items()} == {
        "leftimg8bit": 5, "gtfine_png": 5, "gtfine_tiff": 5, "samples": 5,
    }  # fmt: skip


def test_the_order_of_splits_and_runs_does_not_matter(tmp_path: Path) -> None:
    trees = []
    for number, order in enumerate(itertools.permutations(("train", "val", "test"))):
        for split in order:
            fill(tmp_path / str(number), plan(split, 1))
        trees.append(tree(tmp_path / str(number)))
    assert all(one == trees[0] for one in trees)


def test_a_split_that_is_removed_leaves_the_card_of_the_others(tmp_path: Path) -> None:
    fill(tmp_path / "a", plan("train", 1))
    fill(tmp_path / "b", plan("train", 1))
    fill(tmp_path / "b", plan("val", 1))
    remove_split(tmp_path / "b", "val")
    assert [(tmp_path / "a" / name).read_bytes() for name in CARDS] == [
        (tmp_path / "b" / name).read_bytes() for name in CARDS
    ]
    remove_split(tmp_path / "b", "train")
    assert tree(tmp_path / "b") == {}


@pytest.mark.parametrize("name", CARDS)
def test_a_file_of_the_users_own_is_never_touched(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("mine")
    fill(tmp_path, plan("train", 1))
    write_cards(tmp_path, is_repair=True)
    remove_split(tmp_path, "train")
    assert (tmp_path / name).read_text() == "mine" and damaged_cards(tmp_path) == []


@pytest.mark.parametrize("make", [Path.mkdir, os.mkfifo])
@pytest.mark.parametrize("name", CARDS)
def test_a_folder_or_a_fifo_of_the_users_own_is_never_touched(
    tmp_path: Path, name: str, make: Callable[[Path], None]
) -> None:
    make(tmp_path / name)
    fill(tmp_path, plan("train", 1))
    write_cards(tmp_path, is_repair=True)
    assert damaged_cards(tmp_path) == [] and own_cards(tmp_path) == set(CARDS) - {name}
    remove_split(tmp_path, "train")
    assert (tmp_path / name).exists() and set(tree(tmp_path)) == set()


@pytest.mark.parametrize("name", CARDS)
def test_a_damaged_file_is_noticed_stays_and_is_repaired(tmp_path: Path, name: str) -> None:
    fill(tmp_path, plan("train", 1))
    whole = (tmp_path / name).read_bytes()
    assert damaged_cards(tmp_path) == []
    for position in range(0, len(whole) - 150, 97):
        spoilt = whole[:position] + bytes([whole[position] ^ 1]) + whole[position + 1 :]
        (tmp_path / name).write_bytes(spoilt)
        assert damaged_cards(tmp_path) == [name]
    fill(tmp_path, plan("val", 1))
    assert (tmp_path / name).read_bytes() == spoilt, "somebody may have edited it"
    write_cards(tmp_path, is_repair=True)
    assert (tmp_path / name).read_bytes() == cards(tmp_path)[name]
    (tmp_path / name).unlink()
    assert damaged_cards(tmp_path) == [], "as in datasets of earlier versions"
    write_cards(tmp_path, is_repair=True)
    assert (tmp_path / name).read_bytes() == cards(tmp_path)[name]


@pytest.mark.parametrize("name", CARDS)
def test_no_card_is_written_through_a_link(tmp_path: Path, name: str) -> None:
    fill(tmp_path / "data", plan("train", 1))
    outside = tmp_path / "outside"
    outside.write_text("theirs")
    (tmp_path / "data" / name).unlink()
    (tmp_path / "data" / name).symlink_to(outside)
    for is_repair in (False, True):
        with pytest.raises(DatasetError, match="is a link"):
            write_cards(tmp_path / "data", is_repair=is_repair)
    with pytest.raises(DatasetError, match="leads outside"):
        damaged_cards(tmp_path / "data")
    assert outside.read_text() == "theirs"


def test_a_split_with_a_damaged_manifest_is_left_out(tmp_path: Path) -> None:
    fill(tmp_path, plan("train", 1))
    fill(tmp_path, plan("val", 1))
    manifest = tmp_path / "gear/train/manifest.json"
    manifest.write_text(manifest.read_text().replace('"version": 1', '"version": 7'))
    assert b"gear/train" not in cards(tmp_path)["croissant.json"]
    manifest.write_text("[1]")
    assert b"gear/train" not in cards(tmp_path)["croissant.json"]


def test_facts_come_from_plan_and_manifest(tmp_path: Path) -> None:
    base = plan("train", 1)
    fill(tmp_path, dataclasses.replace(base, info=dataclasses.replace(base.info, patch_label="random")))
    text = (tmp_path / "README.md").read_text()
    assert "| train | 1 | town10/billboard01 | unknown | random | 5 |" in text
    assert load_json(tmp_path / "croissant.json")["name"] == "gear depth town10 billboard01, patch random"
