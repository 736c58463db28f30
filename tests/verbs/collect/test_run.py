"""The main job on a tiny town: the four tasks, twins, resuming, workers, and what bad input gets."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import gear
from gear.collecting.run import CollectReport
from gear.dataset.sealed_json import sealed_json
from gear.formats import rle
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import (
    BackendError,
    ConfigError,
    DatasetError,
    SamplesFailedError,
    TownError,
)
from tests.dataset.splits import tree
from tests.verbs.conftest import Copy

Collect = Callable[..., CollectReport]
TASKS = ("semseg", "detect2d", "stereo3d", "depth")


def reach(sample: Any, camera: str, margin_px: int = 2) -> np.ndarray:
    """Where the surfaces are seen, grown by a margin for the edge filter."""
    height, width = sample.images[camera].shape[:2]
    seen = np.zeros((height, width), np.uint8)
    for surface in sample.surfaces:
        if surface.camera == camera:
            seen |= rle.decode(surface.mask_rle, height, width).astype(np.uint8)
    return cv2.dilate(seen, np.ones((2 * margin_px + 1,) * 2, np.uint8)).astype(bool)


@pytest.mark.parametrize("task", TASKS)
def test_ground_truth_of_a_task_is_read_back_and_has_a_perfect_metric(
    task: str, tmp_path: Path, collect_small: Collect
) -> None:
    report = collect_small(task, tmp_path / "out")
    assert (report.samples, report.made) == (2, 2)
    dataset = gear.open_dataset(tmp_path / "out")
    assert dataset.verify() == []
    evaluator = dataset.task.evaluator()
    for sample in dataset:
        assert sample.record.town == "tiny"
        for picture in sample.images.values():
            assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 30
        assert sample.surfaces[0].visible_px > 50
        evaluator.update(sample, dataset.task.as_prediction(sample))
    assert evaluator.result()
    assert not list((tmp_path / "out").rglob("*scratch*"))
    again = collect_small(task, tmp_path / "out")
    assert again.made == 0


def test_two_runs_and_two_workers_give_the_same_bytes(tmp_path: Path, collect_small: Collect) -> None:
    collect_small("stereo3d", tmp_path / "a", samples=3, patch="random")
    collect_small("stereo3d", tmp_path / "b", samples=3, patch="random", workers=2)
    assert tree(tmp_path / "a") == tree(tmp_path / "b")


def test_a_worker_apart_gives_the_same_bytes(
    tmp_path: Path, collect_small: Collect, monkeypatch: pytest.MonkeyPatch
) -> None:
    collect_small("depth", tmp_path / "a")
    monkeypatch.setattr("gear.collecting.missing.open_session", lambda job: pytest.fail("rendered in this process"))
    collect_small("depth", tmp_path / "b", in_subprocess=True)
    assert tree(tmp_path / "a") == tree(tmp_path / "b")


def test_twins_differ_where_the_patch_is_seen_and_nowhere_else(tmp_path: Path, collect_small: Collect) -> None:
    collect_small("semseg", tmp_path / "none", samples=3)
    collect_small("semseg", tmp_path / "random", samples=3, patch="random")
    twins = gear.open_twins(tmp_path / "none", tmp_path / "random")
    for clean, patched in twins:
        assert clean.record == patched.record
        assert np.array_equal(clean.label_ids, patched.label_ids)
        for camera, picture in clean.images.items():
            differs = (picture != patched.images[camera]).any(axis=2)
            inside = reach(clean, camera)
            assert not (differs & ~inside).any()
            assert differs[reach(clean, camera, 0)].mean() > 0.9
    collect_small("semseg", tmp_path / "other", samples=3, patch="random", seed=11)
    with pytest.raises(DatasetError, match="is no twin of"):
        gear.open_twins(tmp_path / "none", tmp_path / "other")


def test_a_sample_is_the_same_alone_and_in_company(tmp_path: Path, collect_small: Collect) -> None:
    collect_small("depth", tmp_path / "long", samples=4)
    collect_small("depth", tmp_path / "short", samples=2)
    collect_small("depth", tmp_path / "short", samples=4)
    assert tree(tmp_path / "long") == tree(tmp_path / "short")


def test_double_boards_take_two_patches(tmp_path: Path, collect_small: Collect) -> None:
    collect_small("detect2d", tmp_path, scene="double", patch="random")
    sample = gear.open_dataset(tmp_path)[0]
    assert [s.name for s in sample.record.surfaces] == ["surface_0", "surface_1"]
    assert sorted(p.name for p in (tmp_path / "gear/patches/random").iterdir()) == ["patch_0.png", "patch_1.png"]
    info = json.loads(next(tmp_path.rglob("camera_billboard_info.json")).read_text())
    assert info["info"]["num_billboards"] == 2


@pytest.mark.parametrize(("scene", "patch"), [("truck", "random"), ("no_billboard", "none")])
def test_scenes_without_boards(scene: str, patch: str, tmp_path: Path, collect_small: Collect) -> None:
    collect_small("stereo3d", tmp_path, scene=scene, patch=patch)
    for sample in gear.open_dataset(tmp_path):
        carriers = [a for a in sample.record.actors if a.role == "carrier"]
        assert len(carriers) == len(sample.record.surfaces) == (scene == "truck")
        if scene == "truck":
            assert 2 < sample.surfaces[0].distance_m < 60
            assert sample.surfaces[0].incidence_deg < 60


def test_the_video_split_drives(tmp_path: Path, collect_small: Collect) -> None:
    simulation = tmp_path / "simulation.yml"
    simulation.write_text("splits: {video: {seed: 60, samples: 1, frames: 4, interval_s: 0.2}}\n")
    out = tmp_path / "out"
    report = collect_small("depth", out, split="video", samples=1, settings=[f"simulation={simulation}"])
    assert report.samples == 4
    records = [sample.record for sample in gear.open_dataset(out)]
    assert [(r.sequence, r.frame) for r in records] == [(0, 0), (0, 1), (0, 2), (0, 3)]
    assert [r.time_s for r in records] == pytest.approx([0.0, 0.2, 0.4, 0.6])
    assert len({tuple(a.id for a in r.actors) for r in records}) == 1
    ego = np.array([r.ego.world_from_actor.position_m for r in records])
    speed = np.linalg.norm(np.diff(ego, axis=0), axis=1) / 0.2
    assert speed == pytest.approx([np.linalg.norm(r.ego.velocity_world_mps) for r in records[1:]], abs=0.5)


def command(out: Path, *more: str) -> list[str]:
    return [
        sys.executable, "-m", "gear.cli.main", "collect", "--task", "depth", "--town", str(TINY_TOWN), "--set",
        f"scenes={TINY_SCENES}", "--scene", "board", "--renderer", "classic", "--quality", "fast", "--split", "debug",
        "--set", "options.width_px=320", "--set", "options.height_px=96", "--out", str(out), *more,
    ]  # fmt: skip


def test_a_killed_run_goes_on_where_it_was(tmp_path: Path, collect_small: Collect) -> None:
    out = tmp_path / "killed"
    running = subprocess.Popen(command(out, "--samples", "200"), stderr=subprocess.PIPE, stdout=subprocess.PIPE)
    samples = out / "gear/debug/samples"
    for _ in range(1200):
        if samples.is_dir() and len(list(samples.iterdir())) >= 3:
            break
        time.sleep(0.05)
    os.kill(running.pid, signal.SIGKILL)
    running.communicate()
    kept = {p.name: p.stat().st_mtime_ns for p in samples.iterdir()}
    assert 3 <= len(kept) < 200
    total = len(kept) + 2
    plan = out / "gear/debug/plan.json"
    content = json.loads(plan.read_text().replace('"samples": 200', f'"samples": {total}'))
    del content["sha256"]
    plan.write_bytes(sealed_json(content))
    report = collect_small("depth", out, samples=total)
    assert report.made == total - len(kept)
    assert all((samples / name).stat().st_mtime_ns == stamp for name, stamp in kept.items())
    collect_small("depth", tmp_path / "straight", samples=total)
    assert tree(out) == tree(tmp_path / "straight")


@pytest.mark.skipif(sys.platform == "win32", reason="no process groups there")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGKILL, -signal.SIGKILL)])
def test_workers_do_not_outlive_the_command(tmp_path: Path, number: signal.Signals, code: int) -> None:
    """Batch systems end the process that they started, and kill the one that took too much memory; its workers went on,
    beside whoever gave the command again."""
    running = subprocess.Popen(
        command(tmp_path / "out", "--samples", "2000", "--workers", "2"),
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    samples = tmp_path / "out/gear/debug/samples"
    for _ in range(1200):
        if samples.is_dir() and len(list(samples.iterdir())) >= 2:
            break
        time.sleep(0.05)
    running.send_signal(number)
    assert running.wait(timeout=60) == code
    with contextlib.suppress(ProcessLookupError):  # its group is gone with the last worker
        for _ in range(600):
            os.killpg(running.pid, 0)
            time.sleep(0.05)
        pytest.fail("workers are still there")
    said = running.communicate()[1]
    assert said.endswith("gear: stopped; run the same command again to go on\n") == (number == signal.SIGTERM)
    assert "Traceback" not in said and 2 <= len(list(samples.iterdir())) < 2000


@pytest.mark.skipif(sys.platform == "win32", reason="there a terminal interrupts otherwise")
def test_ctrl_c_while_workers_start_is_one_line(tmp_path: Path) -> None:
    """A terminal interrupts the whole group, workers that still import included."""
    (tmp_path / "sitecustomize.py").write_text(
        "import os, signal, sys\n"
        "if '--multiprocessing-fork' in sys.orig_argv:\n"
        "    held_back = signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])\n"
        f"    with open({str(tmp_path / 'held_back')!r}, 'a') as file:\n"
        "        file.write(f'{held_back} ')\n"
        "    os.killpg(0, signal.SIGINT)\n"
    )
    # A shell's background ignores it, and so would all that is started there.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        done = subprocess.run(
            command(tmp_path / "out", "--samples", "8", "--workers", "2"),
            capture_output=True, text=True, check=False, start_new_session=True, timeout=120,
            env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])},
        )  # fmt: skip
    finally:
        signal.signal(signal.SIGINT, before)
    assert done.returncode == 130
    assert done.stderr == "gear: stopped; run the same command again to go on\n"
    assert not (tmp_path / "out").exists()
    assert set((tmp_path / "held_back").read_text().split()) == {"True"}, "from the first worker on"


def test_another_configuration_needs_force(tmp_path: Path, collect_small: Collect, copy_small: Copy) -> None:
    copy_small("depth", tmp_path)
    before = tree(tmp_path)
    with pytest.raises(DatasetError, match=r"another configuration \(content\.seed: 10 there, 11 now"):
        collect_small("depth", tmp_path, seed=11)
    assert tree(tmp_path) == before
    collect_small("depth", tmp_path, seed=11, force=True)
    assert gear.open_dataset(tmp_path)[0].record.seed == 11


def test_a_first_try_that_makes_nothing_leaves_nothing(tmp_path: Path, collect_small: Collect) -> None:
    town = tmp_path / "towns" / "tiny.xml"
    town.parent.mkdir()
    whole = TINY_TOWN.read_text()
    town.write_text(whole.replace("building.plaster", "bilding.plaster"))
    for folder in TINY_TOWN.parents[1].iterdir():
        if folder.name != "towns":
            (tmp_path / folder.name).symlink_to(folder)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("x")
    for out in (tmp_path / "new" / "below", tmp_path / "mine"):
        with pytest.raises(TownError, match=r"bilding\.plaster"):
            collect_small("depth", out, town=town, patch="random")
    assert not (tmp_path / "new").exists()
    assert tree(tmp_path / "mine").keys() == {"notes.txt"}
    town.write_text(whole)
    assert collect_small("depth", tmp_path / "mine", town=town, seed=4).made == 2


def test_the_command_line_says_it_in_one_line_and_leaves_with_2(tmp_path: Path) -> None:
    done = subprocess.run(command(tmp_path / "out", "--weather", "Foggy"), capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("gear: no weather named 'Foggy'")
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path: Path, collect_small: Collect) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(DatasetError, match="choose another --out"):
        collect_small("depth", tmp_path / "file" / "out")


def test_limits_that_are_too_tight_say_which(tmp_path: Path, collect_small: Collect) -> None:
    library = tmp_path / "s.yml"
    library.write_text(
        "town: tiny\nscenes:\n  far:\n    boards: [{position_m: [55, -8.5, 0], facing_deg: 175}]\n"
        "    ego: {ahead_m: [900, 901], lateral_m: [900, 901]}\n"
    )
    with pytest.raises(SamplesFailedError, match=r"2 of 2 samples .*scene far: "):
        collect_small("depth", tmp_path / "out", scene="far", settings=[f"scenes={library}"])


def test_a_worker_that_dies_is_reported(
    tmp_path: Path, collect_small: Collect, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MUJOCO_GL", "no-such-backend")
    with pytest.raises(BackendError):
        collect_small("depth", tmp_path / "out", workers=2)


@pytest.mark.slow
def test_filament_keeps_the_same_promises(tmp_path: Path, collect_small: Collect) -> None:
    for name, patch in (("a", "random"), ("b", "random"), ("none", "none")):
        collect_small("stereo3d", tmp_path / name, renderer="filament", quality="film", patch=patch)
    assert tree(tmp_path / "a") == tree(tmp_path / "b")
    for clean, patched in gear.open_twins(tmp_path / "none", tmp_path / "a"):
        for camera, picture in clean.images.items():
            differs = (picture != patched.images[camera]).any(axis=2)
            assert differs[reach(clean, camera, 0)].mean() > 0.9
            assert (differs & ~reach(clean, camera)).mean() < 0.001


RAIN = ["weather.precipitation=60", "weather.precipitation_deposits=80", "weather.fog_density=20"]


def test_twins_in_rain_and_fog_differ_only_where_the_patch_is_seen(tmp_path: Path, collect_small: Collect) -> None:
    for name, patch in (("none", "none"), ("random", "random"), ("again", "random")):
        collect_small("semseg", tmp_path / name, patch=patch, settings=RAIN)
    assert tree(tmp_path / "random") == tree(tmp_path / "again")
    collect_small("semseg", tmp_path / "dry")
    for dry, (clean, patched) in zip(
        gear.open_dataset(tmp_path / "dry"), gear.open_twins(tmp_path / "none", tmp_path / "random"), strict=True
    ):
        assert np.array_equal(clean.label_ids, patched.label_ids) and np.array_equal(clean.label_ids, dry.label_ids)
        for camera, picture in clean.images.items():
            assert (picture != dry.images[camera]).any(axis=2).mean() > 0.5
            differs = (picture != patched.images[camera]).any(axis=2)
            assert not (differs & ~reach(clean, camera)).any()
            assert differs[reach(clean, camera, 0)].mean() > 0.9


def test_camera_effects_bend_picture_and_truth_alike_and_are_written_down(
    tmp_path: Path, collect_small: Collect
) -> None:
    effects = ["camera.lens.k1=-0.15", "camera.vignette=0.3", "camera.shot_noise=1.5"]
    for name, patch in (("none", "none"), ("random", "random"), ("again", "random")):
        collect_small("semseg", tmp_path / name, patch=patch, settings=effects)
    assert tree(tmp_path / "random") == tree(tmp_path / "again")
    collect_small("semseg", tmp_path / "plain")
    plain = gear.open_dataset(tmp_path / "plain")
    for straight, (clean, patched) in zip(plain, gear.open_twins(tmp_path / "none", tmp_path / "random"), strict=True):
        (camera,) = clean.record.cameras
        assert camera.lens is not None and camera.lens.k1 == -0.15 and camera.lens.focal_px > camera.focal_px
        assert straight.record.cameras[0].lens is None
        assert (clean.label_ids != straight.label_ids).mean() > 0.01
        for name, picture in clean.images.items():
            differs = (picture != patched.images[name]).any(axis=2)
            assert not (differs & ~reach(clean, name)).any(), "the same grain, and the mask is where the patch is seen"
            assert differs[reach(clean, name, 0)].mean() > 0.9
    with pytest.raises(DatasetError, match="is no twin of"):
        gear.open_twins(tmp_path / "plain", tmp_path / "random")
    with pytest.raises(ConfigError, match=r"camera.lens.k1: must be -0.5 to 0.5"):
        collect_small("semseg", tmp_path / "bad", settings=["camera.lens.k1=3"])
    folding = ["camera.lens.k1=-0.5", "camera.lens.k2=-0.5", "options.hfov_deg=150"]
    with pytest.raises(ConfigError, match=r"camera: lens: a lens of k1 -0.5 and k2 -0.5 folds"):
        collect_small("semseg", tmp_path / "folded", settings=folding)
    assert not (tmp_path / "folded").exists(), "nothing was begun"


def test_a_task_that_fails_is_named_and_the_note_has_the_traceback(
    tmp_path: Path, collect_small: Collect, monkeypatch: pytest.MonkeyPatch
) -> None:
    from gear.plugins import manager
    from gear.plugins.catalogue import Catalogue, Owner
    from gear.plugins.tasks.depth import DepthTask

    def fails(*_: Any) -> Any:
        raise KeyError("boom")

    monkeypatch.setattr("gear.collecting.missing.FRESH_TRIES", 0)
    monkeypatch.setattr(DepthTask, "ground_truth", fails)
    with pytest.raises(SamplesFailedError, match=r"2 of 2 samples .* \(sample 0: KeyError: 'boom'\).*debug/failed"):
        collect_small("depth", tmp_path / "a")
    note = json.loads((tmp_path / "a/gear/debug/failed/000001.json").read_text())
    assert note["error"] == "KeyError: 'boom'" and any("in fails" in line for line in note["traceback"])
    owner = Owner(plugin="their-depth", package="their-package", version="1.2")
    found = tuple(dataclasses.replace(f, owner=owner) for f in manager.catalogue().of_kind("task"))
    monkeypatch.setattr("gear.plugins.build.catalogue", lambda: Catalogue(found))
    named = r"plugin depth \(their-package 1\.2\) failed at sample 0: KeyError: 'boom'"
    with pytest.raises(SamplesFailedError, match=named):
        collect_small("depth", tmp_path / "b")
