"""Exports: new folders, disks, exports that are stopped or killed, links."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from gear.cli.main import main
from gear.collecting.run import CollectReport
from gear.values.errors import DatasetError, GearError
from gear.verbs import export as run
from gear.verbs.export import export
from tests.dataset.splits import fill, plan, tree

DRIVE = Path(__file__).parents[1] / "formats/driving/drive.yml"


def test_exports_go_into_new_folders_and_fit_their_task(tmp_path: Path) -> None:
    fill(tmp_path / "a", plan())
    assert export(tmp_path / "a", layout="kitti-depth", out=tmp_path / "b") == 3
    assert len(list((tmp_path / "b").rglob("proj_depth/groundtruth/image_02/*.png"))) == 3
    assert not (tmp_path / "b/gear").exists()
    with pytest.raises(DatasetError, match="is not empty"):
        export(tmp_path / "a", layout="kitti-depth", out=tmp_path / "b")
    with pytest.raises(DatasetError, match="the layout 'kitti' is for stereo3d"):
        export(tmp_path / "a", layout="kitti", out=tmp_path / "c")


def test_an_export_can_be_checked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Every file in turn with one bit flipped, cut by a byte, and deleted; caches of other tools do not count."""
    fill(tmp_path / "a", plan())
    export(tmp_path / "a", layout="kitti-depth", out=tmp_path / "b")
    (tmp_path / "b/labels.cache").write_text("of another tool")
    files = sorted(path for path in (tmp_path / "b").rglob("*") if path.is_file() and path.name != "labels.cache")
    listed = tmp_path / "b/.gear-export.json"
    assert len(files) > 6 and listed in files
    assert main(["verify", str(tmp_path / "b")]) == 0
    assert f"{len(files) - 1} files, all as they were written" in capsys.readouterr().out
    for path in files:
        whole = path.read_bytes()
        flipped = bytearray(whole)
        flipped[len(whole) // 2] ^= 1
        for data in (bytes(flipped), whole[:-1], None):
            path.unlink()
            if data is not None:
                path.write_bytes(data)
            code, (out, err) = main(["verify", str(tmp_path / "b")]), capsys.readouterr()
            if path == listed:
                assert code == 2 and len(err.splitlines()) == 1
            else:
                problem = "missing" if data is None else "damaged"
                first, total = out.splitlines()
                assert code == 1 and first == f"{problem:<10} {path.relative_to(tmp_path / 'b')}"
                assert total.endswith(f"1 {problem} of {len(files) - 1} files")
            path.write_bytes(whole)
    assert main(["verify", str(tmp_path / "b"), "--repair"]) == 2
    assert "is an export, of which only all files can be checked" in capsys.readouterr().err


def test_an_export_that_does_not_fit_its_disk_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fill(tmp_path / "a", plan())
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=1000))
    with pytest.raises(GearError, match=r"the exported files need about .* kB, and 1 kB are free there"):
        export(tmp_path / "a", layout="kitti-depth", out=tmp_path / "b")
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_an_export_with_larger_files_than_the_dataset_ends_after_its_first_samples(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fill(tmp_path / "a", plan(samples=8))
    seen: list[tuple[int, int]] = []
    monkeypatch.setattr(run, "_size_of", lambda root, files: 0)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=1000))
    with pytest.raises(GearError, match=r"the exported files need about .* kB, and 1 kB are free there"):
        export(tmp_path / "a", layout="kitti-depth", out=tmp_path / "b", on_progress=lambda *now: seen.append(now))
    assert seen[-1] == (3, 8) and [path.name for path in tmp_path.iterdir()] == ["a"]


def test_the_files_of_a_killed_export_need_no_room_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fill(tmp_path / "a", plan())
    export(tmp_path / "a", layout="kitti-depth", out=tmp_path / "whole")
    shutil.copytree(tmp_path / "whole", tmp_path / ".b.gear-export")
    next(path for path in (tmp_path / ".b.gear-export").rglob("*.png")).unlink()
    size = sum(len(data) for path, data in tree(tmp_path / "a").items() if "/" in path and not path.startswith("gear/"))
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=size - 1000))
    with pytest.raises(GearError, match="the exported files need"):
        export(tmp_path / "a", layout="kitti-depth", out=tmp_path / "c")
    assert export(tmp_path / "a", layout="kitti-depth", out=tmp_path / "b") == 3
    assert tree(tmp_path / "b") == tree(tmp_path / "whole")


def test_an_export_that_is_stopped_leaves_nothing_and_can_be_given_again(tmp_path: Path) -> None:
    fill(tmp_path / "a", plan())

    def stop(done: int, _: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        export(tmp_path / "a", layout="kitti-depth", out=tmp_path / "b", on_progress=stop)
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    assert export(tmp_path / "a", layout="kitti-depth", out=tmp_path / "b") == 3


def test_an_export_that_is_killed_shows_nothing_and_the_same_command_goes_on(tmp_path: Path) -> None:
    fill(tmp_path / "a", plan())
    export(tmp_path / "a", layout="kitti-depth", out=tmp_path / "whole")
    script = (
        "import os, sys\nfrom gear.verbs.export import export\n"
        "export(sys.argv[1], layout='kitti-depth', out=sys.argv[2],"
        " on_progress=lambda done, _: done == 2 and os._exit(9))"
    )
    killed = subprocess.run([sys.executable, "-c", script, str(tmp_path / "a"), str(tmp_path / "b")], check=False)
    assert killed.returncode == 9 and not (tmp_path / "b").exists()
    unfinished = tmp_path / ".b.gear-export"
    stray, first = unfinished / "stray/of_another.png", next(path for path in unfinished.rglob("*.*") if path.is_file())
    stray.parent.mkdir()
    stray.write_bytes(b"stray")
    before = first.stat().st_ino
    assert export(tmp_path / "a", layout="kitti-depth", out=tmp_path / "b") == 3
    assert tree(tmp_path / "b") == tree(tmp_path / "whole") and not unfinished.exists()
    assert (tmp_path / "b" / first.relative_to(unfinished)).stat().st_ino == before, "what was there was not rewritten"


def test_an_export_writes_through_no_link(tmp_path: Path) -> None:
    fill(tmp_path / "a", plan())
    victim, unfinished = tmp_path / "victim", tmp_path / ".b.gear-export"
    victim.mkdir()
    (victim / "mine.txt").write_text("mine")
    unfinished.mkdir()
    (unfinished / "train").symlink_to(victim)
    with pytest.raises(DatasetError, match="train: is a link"):
        export(tmp_path / "a", layout="kitti-depth", out=tmp_path / "b")
    hidden = unfinished / "val/.inner/link"
    hidden.parent.mkdir(parents=True)
    (unfinished / "train").rename(hidden)
    with pytest.raises(DatasetError, match="link: is a link"):
        export(tmp_path / "a", layout="kitti-depth", out=tmp_path / "b")
    hidden.rename(unfinished / "train")
    shutil.rmtree(unfinished / "val")
    unlinked = unfinished / "train"
    unlinked.unlink()
    unfinished.rmdir()
    unfinished.symlink_to(victim)
    with pytest.raises(DatasetError, match=r"\.b\.gear-export: is a link"):
        export(tmp_path / "a", layout="kitti-depth", out=tmp_path / "b")
    assert tree(victim) == {"mine.txt": b"mine"} and not (tmp_path / "b").exists()


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory, collect_small: Callable[..., CollectReport]) -> dict[str, Path]:
    """A driving sequence of four frames of each task with a layout of its own."""
    roots = {}
    for task, extra in (("stereo3d", ["flow=true", "scans=true"]), ("detect2d", [])):
        roots[task] = tmp_path_factory.mktemp("drives") / task
        settings = [f"simulation={DRIVE}", *extra]
        collect_small(task, roots[task], settings=settings, split="video", samples=None, scene="no_billboard")
    return roots


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["kitti-tracking", "kitti-flow", "kitti-odometry", "kitti-raw", "mot"])
def test_a_drive_exported_twice_has_the_same_bytes(tmp_path: Path, drives: dict[str, Path], layout: str) -> None:
    root = drives["detect2d" if layout == "mot" else "stereo3d"]
    moved = tmp_path / "elsewhere/moved"
    shutil.copytree(root, moved)
    code = "import sys; from gear.cli.main import main; sys.exit(main(sys.argv[1:]))"
    for number, data in enumerate((root, moved)):
        words = ["export", str(data), "--layout", layout, "--out", str(tmp_path / f"out{number}")]
        environment = {**os.environ, "PYTHONHASHSEED": str(number), "TZ": ("UTC", "Asia/Tokyo")[number]}
        subprocess.run([sys.executable, "-c", code, *words], check=True, env=environment, capture_output=True)
    first, second = tree(tmp_path / "out0"), tree(tmp_path / "out1")
    assert len(first) > 4 and first == second
