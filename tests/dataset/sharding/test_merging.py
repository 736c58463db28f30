"""Joining folders: what is refused, and that nothing is written outside."""

from __future__ import annotations

import dataclasses
import json
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from gear.dataset.files import sha256
from gear.dataset.layout import sidecar_path
from gear.dataset.locks import shared_split_lock
from gear.dataset.plan import Plan, write_plan
from gear.dataset.sealed_json import sealed_json
from gear.dataset.sharding.merging import Parts, copy_patches, copy_samples, find_parts, prepare_merge
from gear.dataset.store import Store
from gear.values.errors import DatasetError
from tests.dataset.splits import fill, plan, tree


def merged(roots: list[Path], out: Path, split: str = "test") -> Parts:
    parts = find_parts(roots, split)
    prepare_merge(out, [parts.plan])
    copy_samples(parts, out, lambda done, total: None)
    return parts


@pytest.fixture
def halves(tmp_path: Path) -> list[Path]:
    fill(tmp_path / "a", plan(samples=4), [0, 2], is_closed=False)
    fill(tmp_path / "b", plan(samples=4), [1, 3], is_closed=False)
    return [tmp_path / "a", tmp_path / "b"]


def test_two_halves_are_the_whole(halves: list[Path], tmp_path: Path) -> None:
    merged(halves, tmp_path / "out")
    fill(tmp_path / "whole", plan(samples=4), is_closed=False)
    assert tree(tmp_path / "out") == tree(tmp_path / "whole")


def test_a_sample_that_two_folders_have_must_be_the_same(halves: list[Path], tmp_path: Path) -> None:
    fill(halves[1], plan(samples=4), [2], is_closed=False)
    assert find_parts(halves, "test").homes == ((0,), (1,), (0, 1), (1,))
    merged(halves, tmp_path / "out")
    shutil.rmtree(halves[1])
    fill(halves[1], plan(samples=4), [1, 2, 3], is_closed=False, seed=6)
    with pytest.raises(DatasetError, match=r"000002.json: is another sample than that of .*/a; check both"):
        merged(halves, tmp_path / "out2")


def test_missing_samples_are_counted_and_the_remedy_is_named(halves: list[Path]) -> None:
    with pytest.raises(DatasetError, match=r"2 of 4 samples .* \(first: sample 1\); collect the missing shard"):
        find_parts(halves[:1], "test")


def test_a_plan_of_any_number_of_samples_costs_no_memory(tmp_path: Path) -> None:
    fill(tmp_path, plan(samples=3), [0, 2], is_closed=False)
    write_plan(tmp_path, plan(samples=10**12))
    with pytest.raises(DatasetError, match=r"999999999998 of 1000000000000 samples .* \(first: sample 1\)"):
        find_parts([tmp_path], "test")


def test_a_sidecar_of_a_stopped_merge_counts_only_with_its_files(halves: list[Path], tmp_path: Path) -> None:
    merged(halves, tmp_path / "out")
    whole = tree(tmp_path / "out")
    next(path for path in sorted((tmp_path / "out").rglob("*.png"))).unlink()
    merged(halves, tmp_path / "out")
    assert tree(tmp_path / "out") == whole
    next(path for path in sorted((tmp_path / "out").rglob("*.png"))).write_bytes(b"planted")
    with pytest.raises(DatasetError, match="belongs to two samples, or is another one"):
        merged(halves, tmp_path / "out")


def test_pictures_of_the_patch_are_checked_before_they_are_read(halves: list[Path], tmp_path: Path) -> None:
    """The first folder has none; those of the others are sparse files, which would not fit the memory."""
    (tmp_path / "c").mkdir()
    pictures = [root / "gear/patches/none/patch_0.png" for root in (halves[1], tmp_path / "c")]
    for picture in pictures:
        picture.parent.mkdir(parents=True)
        picture.write_bytes(b"small")
    parts = dataclasses.replace(find_parts(halves, "test"), roots=(*halves, tmp_path / "c"))
    copy_patches(parts, tmp_path / "out", lambda paths: None)
    assert tree(tmp_path / "out") == {"gear/patches/none/patch_0.png": b"small"}
    os.truncate(pictures[1], 1 << 42)
    with pytest.raises(DatasetError, match=rf"c/gear/patches/none: holds other pictures than {halves[1]};"):
        copy_patches(parts, tmp_path / "out", lambda paths: None)
    os.truncate(pictures[0], 1 << 42)

    def refuse(paths: Mapping[str, Path]) -> None:
        raise DatasetError(paths["patch_0.png"], "is too large")

    with pytest.raises(DatasetError, match="is too large"):
        copy_patches(parts, tmp_path / "out", refuse)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"samples": 5}, r"plan.samples: 4 in .*/a, 5 in .*/b"),
        ({"content": {"scene": "truck", "seed": 5}}, r'plan.content.scene: "billboard01" in .*/a, "truck" in .*/b'),
        ({"patch": {"label": "none", "sha256": "1"}}, r"plan.patch.sha256"),
        ({"auxiliary": ("probes",)}, r"plan.auxiliary"),
        ({"recipe": {"quality": "film"}}, r"plan.recipe"),
    ],
)
def test_folders_of_different_commands_are_refused(changes: dict[str, Any], said: str, tmp_path: Path) -> None:
    Store(tmp_path / "a", plan(samples=4)).open({})
    Store(tmp_path / "b", plan(**{"samples": 4, **changes})).open({})
    with pytest.raises(
        DatasetError, match=rf"/b: split 'test' was made with another configuration \({said}.*; merge only"
    ):
        find_parts([tmp_path / "a", tmp_path / "b"], "test")


def test_a_folder_where_a_run_is_at_work_is_refused(halves: list[Path]) -> None:
    with (
        shared_split_lock(halves[1] / "gear/test"),
        pytest.raises(DatasetError, match=r"/b: a run is making split 'test' just now; wait for its end"),
    ):
        find_parts(halves, "test")


def test_a_damaged_or_missing_file_is_found(halves: list[Path], tmp_path: Path) -> None:
    picture = next(path for path in sorted(halves[0].rglob("*.png")))
    data = bytearray(picture.read_bytes())
    data[-20] ^= 1
    picture.write_bytes(bytes(data))
    with pytest.raises(DatasetError, match="is damaged"):
        merged(halves, tmp_path / "out")
    picture.unlink()
    with pytest.raises(DatasetError, match="is gone"):
        merged(halves, tmp_path / "out")


def change_files(path: Path, change: dict[str, str]) -> None:
    content = json.loads(path.read_bytes())
    del content["sha256"]
    content["files"] |= change
    path.write_bytes(sealed_json(content))


@pytest.mark.parametrize(
    "place",
    [
        "../victim.png",
        "/victim.png",
        "a/../../x",
        "gear/test/plan.json",
        "gear/test/manifest.json",
        "gear/test/samples/000007.json",
        "gear/test/begun/x.json",
        "gear/test/claims/000000.claim",
        "gear/test/failed/000000.json",
        "gear/evil/plan.json",
        "./gear//evil/plan.json",
        "GEAR/evil/plan.json",
        "gear/evil/probes/000000_x.png",
        "gear/test/probes/deeper/x.png",
        "gear/scratch/x",
        "gear/patches/none/patch_0.png",
        "README.md",
        "croissant.json",
    ],
)
def test_a_sidecar_that_names_a_file_of_no_sample_is_refused(halves: list[Path], tmp_path: Path, place: str) -> None:
    victim = tmp_path / "victim.png"
    victim.write_bytes(b"mine")
    data = b"mine"
    if ".." not in place and not place.startswith("/"):
        named = halves[0] / place
        named.parent.mkdir(parents=True, exist_ok=True)
        if not named.exists():
            named.write_bytes(data)
        data = named.read_bytes()
    change_files(halves[0] / sidecar_path("test", 0), {place: sha256(data)})
    before = find_parts(halves, "test")
    with pytest.raises(DatasetError, match=r"is not a path inside|is no file of a sample"):
        prepare_merge(tmp_path / "out", [before.plan])
        copy_samples(before, tmp_path / "out", lambda done, total: None)
    assert victim.read_bytes() == b"mine"


def test_two_samples_that_name_one_file_are_refused(halves: list[Path], tmp_path: Path) -> None:
    foreign = next(iter(json.loads((halves[1] / sidecar_path("test", 1)).read_bytes())["files"]))
    (halves[0] / foreign).write_bytes(b"mine")
    change_files(halves[0] / sidecar_path("test", 0), {foreign: sha256(b"mine")})
    with pytest.raises(DatasetError, match="belongs to two samples"):
        merged(halves, tmp_path / "out")


def test_no_link_of_a_folder_that_is_read_leads_out(halves: list[Path], tmp_path: Path) -> None:
    picture = next(path for path in sorted(halves[0].rglob("*.png")))
    elsewhere = tmp_path / "elsewhere.png"
    picture.rename(elsewhere)
    picture.symlink_to(elsewhere)
    with pytest.raises(DatasetError, match="leads outside the dataset through a link"):
        merged(halves, tmp_path / "out")


def test_what_a_stopped_merge_of_other_folders_left_is_removed(halves: list[Path], tmp_path: Path) -> None:
    merged(halves, tmp_path / "out")
    (tmp_path / "out" / "stray.txt").write_text("of the other merge")
    stamps = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("*.png")}
    merged(halves, tmp_path / "out")
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("*.png")} == stamps, "kept"
    others: list[Path] = []
    (tmp_path / "victim").mkdir()
    (tmp_path / "victim/mine.txt").write_text("mine")
    given: Plan = dataclasses.replace(plan(samples=2), content={"scene": "truck", "seed": 5})
    fill(tmp_path / "c", given, is_closed=False)
    others.append(tmp_path / "c")
    merged(others, tmp_path / "out")
    assert tree(tmp_path / "out") == tree(tmp_path / "c")
