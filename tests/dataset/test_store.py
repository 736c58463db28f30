from __future__ import annotations

import dataclasses
import json
import os
import pickle
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gear.config.load import load_collection
from gear.config.nodes import parse_text
from gear.dataset.plan import Plan
from gear.dataset.store import Store, plan_of, remove_split, splits_of
from gear.plugins.build import build_task
from gear.plugins.datasets import open_dataset, open_twins, roots_of
from gear.plugins.manager import catalogue
from gear.testing.synthetic import synthetic_frame
from gear.values.errors import DatasetError, GearError
from gear.verbs.export import export
from gear.verbs.sheet import contact_sheet
from tests.dataset.splits import OPTIONS, fill, plan, tree


def test_a_broken_off_run_goes_on_and_ends_in_the_same_bytes(tmp_path: Path) -> None:
    fill(tmp_path / "a", plan())
    store = fill(tmp_path / "b", plan(), [2], is_closed=False)
    assert store.missing() == [0, 1]
    with pytest.raises(DatasetError, match="'test' is not finished; run its `gear collect` again"):
        open_dataset(tmp_path / "b")
    (tmp_path / "b/gear/scratch").mkdir(exist_ok=True)
    (tmp_path / "b/gear/scratch/123-456").write_bytes(b"half")
    before = (tmp_path / "b/gear/test/samples/000002.json").stat().st_mtime_ns
    fill(tmp_path / "b", plan())
    assert (tmp_path / "b/gear/test/samples/000002.json").stat().st_mtime_ns == before
    assert tree(tmp_path / "a") == tree(tmp_path / "b")


def test_a_dataset_reads_back(tmp_path: Path) -> None:
    fill(tmp_path, plan())
    dataset = open_dataset(tmp_path)
    assert len(dataset) == 3
    assert [s.record.index for s in dataset] == [0, 1, 2]
    frame, _ = synthetic_frame(dataset.task.rig(), index=1, seed=5)
    (name,) = frame.views
    assert np.array_equal(dataset[1].images[name], frame.views[name].rgb)
    assert dataset[-1].record.index == 2
    assert dataset.verify() == []
    with pytest.raises(IndexError):
        dataset[3]
    victim = next(iter(dataset.sidecar(1).files))
    (tmp_path / victim).write_bytes(b"x")
    assert dataset.verify() == [victim]


def test_more_samples_are_added_and_fewer_are_refused(tmp_path: Path) -> None:
    fill(tmp_path, plan(samples=2))
    store = Store(tmp_path, plan(samples=3))
    store.open({})
    assert store.missing() == [2]
    assert len(open_dataset(tmp_path)) == 2, "nothing has come yet: it is as whole as before"
    fill(tmp_path, plan(samples=4), [3], is_closed=False)
    refusal = "split 'test' is not finished: 4 samples were begun, its manifest has 2; run its `gear collect` again"
    with pytest.raises(DatasetError, match=refusal):
        open_dataset(tmp_path)
    with pytest.raises(DatasetError, match=refusal):
        export(tmp_path, layout="kitti-depth", out=tmp_path / "tree")
    fill(tmp_path, plan(samples=4))
    assert len(open_dataset(tmp_path)) == 4
    with pytest.raises(DatasetError, match="was begun with 4 samples, 2 were asked for; use another --out, or --force"):
        Store(tmp_path, plan(samples=2)).open({})


def test_another_configuration_is_never_mixed_in(tmp_path: Path) -> None:
    fill(tmp_path, plan())
    before = tree(tmp_path)
    with pytest.raises(DatasetError, match=r'content.scene: "billboard01" there, "truck" now'):
        Store(tmp_path, plan(content={"scene": "truck", "seed": 5})).open({})
    with pytest.raises(DatasetError, match="holds a depth dataset, semseg was asked for"):
        Store(tmp_path, plan("val", task={"name": "semseg", "package": "x", "version": "1"})).open({})
    assert tree(tmp_path) == before


def test_several_splits_share_a_root_and_go_one_by_one(tmp_path: Path) -> None:
    fill(tmp_path, plan("test"))
    alone = tree(tmp_path)
    fill(tmp_path, plan("val"))
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(DatasetError, match=r"several splits \(test, val\); say which"):
        open_dataset(tmp_path)
    assert len(open_dataset(tmp_path, "val")) == 3
    remove_split(tmp_path, "val")
    assert tree(tmp_path) == alone | {"notes.txt": b"mine"}
    with pytest.raises(DatasetError, match="has no split 'val'; there are: test"):
        open_dataset(tmp_path, "val")


def test_twins_are_paired_by_index_or_refused(tmp_path: Path) -> None:
    fill(tmp_path / "a", plan())
    fill(tmp_path / "b", plan(samples=2, patch={"label": "random", "sha256": "1"}))
    fill(tmp_path / "c", plan(content={"scene": "billboard01", "seed": 6}))
    twins = open_twins(tmp_path / "a", tmp_path / "b")
    assert len(twins) == 2
    assert [a.record == b.record for a, b in twins] == [True, True]
    with pytest.raises(DatasetError, match="is no twin of"):
        open_twins(tmp_path / "a", tmp_path / "c")


def test_a_stranger_is_no_dataset(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="is not a dataset of gear's"):
        open_dataset(tmp_path)
    with pytest.raises(DatasetError, match="is not a dataset of gear's"):
        open_dataset(tmp_path / "nowhere")


def test_a_sidecar_that_leads_outside_is_refused(tmp_path: Path) -> None:
    fill(tmp_path / "a", plan())
    path = tmp_path / "a/gear/test/samples/000000.json"
    sidecar = json.loads(path.read_text())
    (tmp_path / "secret").write_text("s")
    sidecar["files"] = {"../secret": "0"}
    path.write_text(json.dumps(sidecar))
    with pytest.raises(DatasetError, match="not a path inside"):
        remove_split(tmp_path / "a", "test")
    assert (tmp_path / "secret").exists()


def test_a_sheet_shows_every_sample(tmp_path: Path) -> None:
    fill(tmp_path, plan())
    sheet = contact_sheet(tmp_path)
    assert sheet.dtype == np.uint8
    one, two = (contact_sheet(tmp_path, samples=samples).shape[0] for samples in (1, 2))
    assert two - one > 100 and sheet.shape[0] == one + 2 * (two - one)
    assert len(np.unique(sheet[one:two].reshape(-1, 3), axis=0)) > 50


def test_a_split_that_was_killed_before_its_first_sample_is_nothing(tmp_path: Path) -> None:
    Store(tmp_path, plan(samples=9, content={"scene": "truck", "seed": 5})).open({})
    Store(tmp_path, plan("val", task={"name": "semseg", "package": "x", "version": "1"})).open({})
    fill(tmp_path, plan())
    fill(tmp_path / "fresh", plan())
    assert tree(tmp_path).keys() == {*tree(tmp_path / "fresh"), *(f"fresh/{name}" for name in tree(tmp_path / "fresh"))}
    Store(tmp_path, plan("val")).open({})
    Store(tmp_path, plan("train")).open({})
    assert splits_of(tmp_path) == ["test", "train", "val"], "of the same task: another run may be at it"


def test_the_copy_of_the_patches_is_that_of_the_pictures(tmp_path: Path) -> None:
    copy = tmp_path / "gear/patches/random/patch_0.png"

    def begin(split: str, digest: str) -> None:
        given = plan(split, patch={"label": "random", "sha256": digest})
        info = dataclasses.replace(given.info, patch_label="random")
        Store(tmp_path, dataclasses.replace(given, info=info)).open({"patch_0.png": digest.encode()})

    begin("test", "1")
    begin("val", "1")
    copy.write_bytes(b"half")
    begin("test", "1")
    assert copy.read_bytes() == b"1"
    with pytest.raises(DatasetError, match="split 'test' shows other patches of the name 'random'; use another --out"):
        begin("train", "2")
    remove_split(tmp_path, "train")
    remove_split(tmp_path, "test")
    assert copy.exists(), "split val shows it"
    remove_split(tmp_path, "val")
    assert not copy.parent.exists()
    begin("test", "1")
    begin("test", "2")
    assert copy.read_bytes() == b"2"


def test_replacing_that_is_cut_short_leaves_no_sample_without_its_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fill(tmp_path, plan())
    count = iter(range(5))
    unlink = os.unlink

    def cut_short(name: str, *, dir_fd: int | None = None) -> None:
        if next(count, None) is None:
            raise KeyboardInterrupt
        unlink(name, dir_fd=dir_fd)

    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr(os, "unlink", cut_short)
        remove_split(tmp_path, "test")
    left = Store(tmp_path, plan())
    assert 0 in left.missing() and left.missing() != [0, 1, 2]
    fill(tmp_path, plan())
    assert len(open_dataset(tmp_path)[:]) == 3


def test_what_a_killed_run_had_not_finished_goes_with_its_split(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fill(tmp_path, plan(), [0], is_closed=False)
    whole = set(tree(tmp_path))

    def killed(*_: Any) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr("gear.dataset.store.sidecar_bytes", killed)
        fill(tmp_path, plan(), [1], is_closed=False)
    assert {path for path in set(tree(tmp_path)) - whole if path.endswith(".png")}, "a sample without its sidecar"
    remove_split(tmp_path, "test")
    assert tree(tmp_path) == {}
    fill(tmp_path, plan(), [0, 1, 2], is_closed=False)
    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr("gear.dataset.store.sealed_json", killed)
        fill(tmp_path, plan())
    fill(tmp_path, plan())
    assert not any("/begun/" in path for path in tree(tmp_path))


@pytest.mark.parametrize("text", ["", "{"])
def test_files_of_a_sample_whose_sidecar_is_gone_or_damaged_go_with_their_split(tmp_path: Path, text: str) -> None:
    """Readers of the format list folders: what is left over would be one of the next split's pictures."""
    fill(tmp_path, plan())
    sidecar = tmp_path / "gear/test/samples/000002.json"
    sidecar.unlink()  # as messages about damaged files advise
    if text:
        sidecar.write_text(text)
    fewer = Store(tmp_path, plan(samples=2))
    with fewer.begun({}, force=True):
        assert not [path for path in tree(tmp_path) if "rgb_" in path]


@pytest.mark.parametrize("text", ["[]", "{", '{"files": [1], "indexes": 3}', '{"samples": [3, {"files": [1]}, {}]}'])
def test_what_is_damaged_can_be_replaced(tmp_path: Path, text: str) -> None:
    fill(tmp_path, plan())
    (tmp_path / "gear/test/samples/000001.json").write_text(text)
    (tmp_path / "gear/test/manifest.json").write_text(text)
    remove_split(tmp_path, "test")
    assert not (tmp_path / "gear/test").exists()


def test_what_is_not_gears_stays_and_stands_in_no_ones_way(tmp_path: Path) -> None:
    fill(tmp_path, plan())
    strays = {"gear/test/.DS_Store", "gear/test/samples/.nfs0001", "gear/test/probes/000001_surface_0.png"}
    for stray in strays:
        (tmp_path / stray).parent.mkdir(exist_ok=True)
        (tmp_path / stray).touch()
    changed = Store(tmp_path, plan(content={"scene": "billboard02", "seed": 5}))
    with changed.begun({}, force=True):
        assert changed.missing() == [0, 1, 2]
    remove_split(tmp_path, "test")
    assert tree(tmp_path).keys() == strays


@pytest.mark.parametrize(
    "damage",
    [{"samples": 3}, {"samples": {}}, {"samples": [{}]}, {"samples": [{"files": [1]}]}, {"indexes": {"a": 1}}, None],
)
def test_a_manifest_that_lists_no_files_is_one_line(tmp_path: Path, damage: dict[str, Any] | None) -> None:
    fill(tmp_path, plan())
    path = tmp_path / "gear/test/manifest.json"
    path.write_text(json.dumps(damage and json.loads(path.read_text()) | damage))
    with pytest.raises(
        DatasetError, match=r"(is no manifest of|has no list of samples).*run the same collection again"
    ):
        open_dataset(tmp_path)


@pytest.mark.parametrize("weather", [None, "fog", {"name": 3}])
def test_a_manifest_that_names_no_weather_is_one_line(tmp_path: Path, weather: Any) -> None:
    fill(tmp_path, plan())
    dataset = dataclasses.replace(open_dataset(tmp_path), manifest={"weather": weather})
    with pytest.raises(DatasetError, match="says no name of a weather"):
        dataset.named("weather")


@pytest.mark.parametrize("name", ["plan.json", "manifest.json", "samples/000000.json"])
def test_brackets_in_brackets_are_one_line(tmp_path: Path, name: str) -> None:
    fill(tmp_path, plan())
    (tmp_path / "gear/test" / name).write_text("[" * 200_000)
    with pytest.raises(DatasetError, match="is not JSON"):
        open_dataset(tmp_path)[0]


@pytest.mark.parametrize("field", ["task", "patch"])
def test_a_plan_that_says_too_little_is_one_line(tmp_path: Path, field: str) -> None:
    fill(tmp_path, plan())
    path = tmp_path / "gear/test/plan.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {field: {}}))
    with pytest.raises(DatasetError, match=f"plan.{field}: must have"):
        fill(tmp_path, plan())


def test_a_plan_of_another_version_says_which_split_to_replace(tmp_path: Path) -> None:
    """Every split of a dataset is looked at; `--force` replaces the one that is collected."""
    fill(tmp_path, plan("val"))
    path = tmp_path / "gear/val/plan.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"colour": "blue"}))
    for force in (False, True):
        with (
            pytest.raises(DatasetError, match="another --out, or replace split 'val' with --force"),
            Store(tmp_path, plan("test")).begun({}, force=force),
        ):
            pass
    with Store(tmp_path, plan("val")).begun({}, force=True):
        assert splits_of(tmp_path) == ["val"]


def test_folders_of_gears_own_are_no_datasets_and_no_splits(tmp_path: Path) -> None:
    (tmp_path / "code/gear/world").mkdir(parents=True)
    fill(tmp_path / "code/data", plan())
    assert roots_of(tmp_path / "code") == [tmp_path / "code/data"]
    for name in ("scratch", "patches", "gear"):
        with pytest.raises(GearError, match="split"):
            load_collection(None, {"task": "depth", "split": name}, ())


def test_a_dataset_is_read_by_the_task_that_wrote_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Somebody else's task may have the same name."""
    fill(tmp_path, plan())
    there = catalogue()
    (own,) = (found for found in there.found if found.full_name == "mujoco-gear/depth")
    other = dataclasses.replace(own, owner=dataclasses.replace(own.owner, package="somebody"))
    both = dataclasses.replace(there, found=(*there.found, other))
    monkeypatch.setattr("gear.plugins.build.catalogue", lambda: both)
    assert len(open_dataset(tmp_path)[:]) == 3


@pytest.mark.parametrize("is_more_first", [True, False])
def test_of_two_runs_side_by_side_the_one_of_more_samples_has_the_last_word(
    tmp_path: Path, is_more_first: bool
) -> None:
    fewer = fill(tmp_path, plan(samples=2), is_closed=False)
    more = fill(tmp_path, plan(), is_closed=False)
    _, task = build_task("depth", parse_text(json.dumps(OPTIONS), "options"))
    for store in (more, fewer) if is_more_first else (fewer, more):
        store.close(task, {"seed": 5})
    assert len(open_dataset(tmp_path)) == 3
    assert open_dataset(tmp_path).verify() == []


def begun_elsewhere(root: Path, given: Plan, held: Path) -> subprocess.Popen[bytes]:
    """Another process that has begun a split and is at work on it until it is killed."""
    script = """
import pickle, sys, time
from pathlib import Path
from gear.dataset.store import Store
root, plan, held = pickle.loads(sys.stdin.buffer.read())
with Store(root, plan).begun({}):
    held.touch()
    time.sleep(600)
"""
    other = subprocess.Popen([sys.executable, "-c", script], stdin=subprocess.PIPE)
    assert other.stdin is not None
    other.stdin.write(pickle.dumps((root, given, held)))
    other.stdin.close()
    while not held.exists():
        assert other.poll() is None, "it has ended by itself"
        time.sleep(0.02)
    return other


def test_what_another_run_has_just_begun_is_not_forgotten(tmp_path: Path) -> None:
    other = begun_elsewhere(tmp_path / "d", plan(), tmp_path / "held")
    changed = Store(tmp_path / "d", plan(content={"scene": "billboard02", "seed": 5}))
    try:
        before = tree(tmp_path / "d")
        for force in (False, True):
            with pytest.raises(DatasetError, match="another run is making split 'test' just now"):
                changed.begun({}, force=force).__enter__()
        assert tree(tmp_path / "d") == before
        fill(tmp_path / "d", plan(), [1], is_closed=False)
        with pytest.raises(DatasetError, match="another run is making split 'test' just now"):
            changed.begun({}, force=True).__enter__()
        with pytest.raises(DatasetError, match="was made with another configuration"):
            changed.begun({}).__enter__()
    finally:
        other.kill()
        other.wait()
    assert Store(tmp_path / "d", plan()).missing() == [0, 2]
    with changed.begun({}, force=True):
        assert changed.missing() == [0, 1, 2]


def test_two_runs_in_one_folder_share_the_work_and_a_failure_leaves_the_other_intact(
    tmp_path: Path,
) -> None:
    other = begun_elsewhere(tmp_path / "d", plan(), tmp_path / "held")
    try:
        with pytest.raises(KeyboardInterrupt), Store(tmp_path / "d", plan()).begun({}):
            raise KeyboardInterrupt
        assert splits_of(tmp_path / "d") == ["test"]
    finally:
        other.kill()
        other.wait()
    changed = Store(tmp_path / "d", plan(content={"scene": "billboard02", "seed": 5}))
    with changed.begun({}):  # nobody is at work any more, and no sample was made
        assert plan_of(tmp_path / "d", "test") == changed.plan


def test_more_samples_are_welcome_before_the_other_run_has_its_first(tmp_path: Path) -> None:
    other = begun_elsewhere(tmp_path / "d", plan(samples=2), tmp_path / "held")
    try:
        with Store(tmp_path / "d", plan(samples=3)).begun({}):
            assert plan_of(tmp_path / "d", "test").samples == 3
        with (
            pytest.raises(DatasetError, match="another run is making split 'test' just now"),
            Store(tmp_path / "d", plan(samples=1)).begun({}),
        ):
            pass
    finally:
        other.kill()
        other.wait()


def test_of_many_that_begin_one_split_differently_at_once_one_does(tmp_path: Path) -> None:
    ready, outcomes = threading.Barrier(8), []

    def run(scene: int) -> None:
        store = Store(tmp_path / "d", plan(content={"scene": f"billboard{scene:02d}", "seed": 5}))
        ready.wait()
        try:
            with store.begun({}):
                assert plan_of(tmp_path / "d", "test") == store.plan
                outcomes.append(True)
                while len(outcomes) < 8:
                    time.sleep(0.01)
                assert plan_of(tmp_path / "d", "test") == store.plan
        except DatasetError as error:
            assert "another run is making split" in str(error)
            outcomes.append(False)

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(run, range(8)))
    assert sorted(outcomes) == [False] * 7 + [True]
