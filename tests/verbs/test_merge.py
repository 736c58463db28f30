"""Shards of a collection, joined: the folder that one run makes, byte for byte."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import gear
from gear.cli.main import main
from gear.collecting.run import CollectReport
from gear.dataset.sharding.merging import estimated_bytes, find_parts
from gear.values.errors import DatasetError, GearError
from gear.verbs.merge import _merged
from tests.dataset.splits import fill, plan, tree
from tests.shared import ClockedLines
from tests.verbs.collect.test_run import command
from tests.verbs.conftest import Collected

Collect = Callable[..., CollectReport]


def deal(whole: Path, folder: Path, count: int) -> list[Path]:
    """The folders that `count` shards of a finished dataset fill."""
    roots = []
    for number in range(1, count + 1):
        root = folder / f"part{number}"
        files = [path.relative_to(whole).as_posix() for path in whole.glob("gear/*/plan.json")]
        files += [path.relative_to(whole).as_posix() for path in whole.glob("gear/patches/*/*")]
        for sidecar in sorted(whole.glob("gear/*/samples/*.json")):
            if int(sidecar.stem) % count == number - 1:
                files += [sidecar.relative_to(whole).as_posix(), *json.loads(sidecar.read_bytes())["files"]]
        for file in files:
            (root / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(whole / file, root / file)
        roots.append(root)
    return roots


def test_the_listing_of_a_merge_has_rate_and_time_left(
    tmp_path: Path, collected: Collected, monkeypatch: pytest.MonkeyPatch
) -> None:
    parts = deal(collected("depth", samples=3, patch="random", probes=True), tmp_path, 3)
    lines = ClockedLines(monkeypatch, "merge")
    _merged(parts, tmp_path / "merged", lines.callbacks)
    assert lines.counted("listing the samples of all folders") == [
        "gear merge: listing the samples of all folders, 1 of 3, 6 per minute, 20 seconds left",
        "gear merge: listing the samples of all folders, 2 of 3, 6 per minute, 10 seconds left",
        "gear merge: listing the samples of all folders, 3 of 3, 6 per minute",
    ]


TASKS = ["depth", *(pytest.param(task, marks=pytest.mark.slow) for task in ("semseg", "detect2d", "stereo3d"))]


@pytest.mark.parametrize("task", TASKS)
def test_shards_of_any_number_are_merged_to_the_bytes_of_one_run(
    task: str, tmp_path: Path, collected: Collected
) -> None:
    whole = collected(task, samples=3, patch="random", probes=True)
    for count in (1, 2, 7):
        report = gear.merge(deal(whole, tmp_path / f"of{count}", count), out=tmp_path / f"merged{count}")
        assert dict(report.samples) == {"debug": 3} and report.sources == count
        assert tree(tmp_path / f"merged{count}") == tree(whole)
    assert gear.verify(tmp_path / "merged7").is_whole


def test_shards_that_are_collected_apart_give_the_bytes_of_one_run(
    tmp_path: Path, collect_small: Collect, collected: Collected
) -> None:
    asked: dict[str, Any] = {"samples": 3, "patch": "random", "probes": True}
    for shard in ("2/2", "1/2"):
        report = collect_small("depth", tmp_path / shard[0], shard=shard, **asked)
        assert report.shard == shard and "gear merge" in report.summary()
        assert not (tmp_path / shard[0] / "gear/debug/manifest.json").exists()
    gear.merge([tmp_path / "1", tmp_path / "2"], out=tmp_path / "merged")
    assert tree(tmp_path / "merged") == tree(collected("depth", **asked))


def test_shards_in_one_folder_are_closed_by_a_run_without_a_shard(
    tmp_path: Path, collect_small: Collect, collected: Collected
) -> None:
    whole = collected("depth", samples=3)
    empty = collect_small("depth", tmp_path, samples=3, shard="5/6")
    assert (empty.samples, empty.made) == (0, 0), "a shard without a sample is no error"
    collect_small("depth", tmp_path, samples=3, shard="1/2")
    again = collect_small("depth", tmp_path, samples=3, shard="1/2")
    assert (again.samples, again.made) == (2, 0)
    last = collect_small("depth", tmp_path, samples=3)
    assert (last.samples, last.made) == (3, 1), "the second shard"
    assert tree(tmp_path) == tree(whole)


@pytest.mark.slow
def test_driving_sequences_stay_together(tmp_path: Path, collect_small: Collect) -> None:
    simulation = tmp_path / "simulation.yml"
    simulation.write_text("splits: {video: {seed: 60, samples: 3, frames: 2, interval_s: 0.2}}\n")
    drive: dict[str, Any] = {"split": "video", "samples": 3, "settings": [f"simulation={simulation}"]}
    collect_small("depth", tmp_path / "a", shard="1/2", **drive)
    collect_small("depth", tmp_path / "b", shard="2/2", **drive)
    assert sorted(path.stem for path in tmp_path.glob("b/gear/video/samples/*")) == ["000002", "000003"]
    collect_small("depth", tmp_path / "one", **drive)
    gear.merge([tmp_path / "b", tmp_path / "a"], out=tmp_path / "merged")
    assert tree(tmp_path / "merged") == tree(tmp_path / "one")


def test_a_merge_that_does_not_fit_its_disk_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    parts = halves(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=1000))
    with pytest.raises(GearError, match=r"the merged samples need about .*B, and .*B are free there; give --out"):
        gear.merge(parts, out=tmp_path / "merged")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b"]
    whole = find_parts(parts, "test")
    for index, root in enumerate(parts):
        files = [data for path, data in tree(root).items() if path.endswith((".png", ".tiff", f"{index:06d}.json"))]
        assert sum(map(len, files)) == pytest.approx(estimated_bytes(whole) / 2, rel=0.2)


def test_bad_shards_are_one_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for shard in ("0/2", "3/2", "two", "1/2/3", ""):
        assert main(["collect", "--task", "depth", "--out", str(tmp_path / "x"), "--shard", shard]) == 2
        said = capfd.readouterr().err
        assert said.count("\n") == 1 and f"shard {shard!r}: must be I/N" in said
    assert not (tmp_path / "x").exists()


@pytest.mark.slow
def test_killed_shards_and_a_killed_merge_give_the_same_bytes(tmp_path: Path, collect_small: Collect) -> None:
    samples = 16
    collect_small("depth", tmp_path / "one", samples=samples)
    parts = [tmp_path / "a", tmp_path / "b"]
    for number, part in enumerate(parts, 1):
        given = [*command(part, "--samples", str(samples)), "--shard", f"{number}/2"]
        running = subprocess.Popen(given, stderr=subprocess.PIPE, stdout=subprocess.PIPE)
        made = part / "gear/debug/samples"
        for _ in range(1200):
            if made.is_dir() and len(list(made.iterdir())) >= 3:
                break
            time.sleep(0.02)
        os.kill(running.pid, signal.SIGKILL)
        running.communicate()
        assert 3 <= len(list(made.iterdir())) < samples / 2
        subprocess.run(given, check=True, capture_output=True)
    script = (
        "import os, signal, sys\nimport gear\n"
        "gear.merge(sys.argv[1:3], out=sys.argv[3],"
        " on_progress=lambda done, _: done == 5 and os.kill(os.getpid(), signal.SIGKILL))"
    )
    out = tmp_path / "merged"
    killed = subprocess.run([sys.executable, "-c", script, *map(str, parts), str(out)], check=False)
    assert killed.returncode == -signal.SIGKILL and not out.exists()
    gear.merge(parts, out=out)
    assert tree(out) == tree(tmp_path / "one")
    assert not (tmp_path / ".merged.gear-merge").exists()


def halves(folder: Path) -> list[Path]:
    given = plan(samples=2, content={"scene": "billboard01", "seed": 5, "versions": {"gear": version("mujoco-gear")}})
    fill(folder / "a", given, [0], is_closed=False)
    fill(folder / "b", given, [1], is_closed=False)
    return [folder / "a", folder / "b"]


def test_folders_that_cannot_be_merged_are_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    roots = halves(tmp_path)
    with pytest.raises(GearError, match="no folder was given"):
        gear.merge([], out=tmp_path / "out")
    with pytest.raises(DatasetError, match="is not a dataset of gear's"):
        gear.merge([*roots, tmp_path / "nothing"], out=tmp_path / "out")
    with pytest.raises(DatasetError, match="is not empty; merge into a new folder"):
        gear.merge(roots, out=roots[0])
    with pytest.raises(DatasetError, match=r"lies in .*/a, which is merged"):
        gear.merge(roots, out=roots[0] / "merged")
    fill(tmp_path / "c", plan(samples=2, task={"name": "depth", "package": "mujoco-gear", "version": "0.0.1"}))
    with pytest.raises(DatasetError, match=r"made by mujoco-gear 0\.0\.1, this is .*; merge it with the version"):
        gear.merge([tmp_path / "c"], out=tmp_path / "out")
    assert main(["merge", str(roots[0]), "--out", str(tmp_path / "out")]) == 2
    said = capfd.readouterr().err
    assert said.count("\n") == 1 and "1 of 2 samples of split 'test' are in none of the folders" in said
    assert not (tmp_path / "out").exists()


def test_an_error_leaves_nothing(tmp_path: Path) -> None:
    roots = halves(tmp_path)
    next(iter(sorted(roots[1].rglob("*.png")))).unlink()
    with pytest.raises(DatasetError, match="is gone"):
        gear.merge(roots, out=tmp_path / "out")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b"]
