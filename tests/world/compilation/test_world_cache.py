"""Compiled worlds on disk: the same as fresh ones, never stale, never more than may lie there."""

from __future__ import annotations

import dataclasses
import errno
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import mujoco
import numpy as np
import pytest

from gear.testing.tiny_town import CLEAR, TINY_TOWN, build_tiny_world, tiny_scenes
from gear.values.array_shelf import NO_SHELF
from gear.values.errors import TownError
from gear.values.scene import Weather
from gear.world.assets.library import AssetLibrary
from gear.world.compilation import world_cache
from gear.world.compilation.drop_bvh import without_mesh_bvh
from gear.world.compilation.world_cache import load_or_compile
from gear.world.compilation.world_plan import plan_world
from gear.world.surfaces import patch_faces
from gear.world.world import World

SCENE = "truck"


@pytest.fixture
def town(tmp_path: Path) -> Path:
    """A tiny town that may be edited."""
    shutil.copytree(TINY_TOWN.parents[1], tmp_path / "mjcf")
    return tmp_path / "mjcf" / "towns" / TINY_TOWN.name


def take(tmp_path: Path, town: Path = TINY_TOWN, weather: Weather = CLEAR) -> World:
    return load_or_compile(
        town=town, scene_name=SCENE, scene=tiny_scenes().scenes[SCENE], weather=weather, cache_dir=tmp_path / "cache"
    )


def worlds(tmp_path: Path) -> set[str]:
    return {path.name for path in (tmp_path / "cache").iterdir() if path.is_dir()}


def never(*_: object) -> bool:
    raise AssertionError("nothing must be compiled now")


def model_bytes(model: mujoco.MjModel) -> bytes:
    """Everything but where its files lay, which no two compilations share."""
    content = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, content)
    return content.tobytes().replace(model.paths, bytes(len(model.paths)))


def test_a_world_of_the_cache_is_the_one_that_is_built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built, made = build_tiny_world(SCENE), take(tmp_path)
    monkeypatch.setattr(world_cache, "_compiled_in_subprocess", never)
    with without_mesh_bvh(built.model):
        seen = model_bytes(built.model)
    for world in (made, take(tmp_path)):
        assert model_bytes(world.model) == seen
        assert model_bytes(world.placement_model) == model_bytes(built.placement_model)
        assert world.slots == built.slots and world.surface_records(7) == built.surface_records(7)
        for name in ("label_code", "is_paint", "is_face"):
            assert np.array_equal(getattr(world.classes, name), getattr(built.classes, name))
    assert len(worlds(tmp_path)) == 1


def test_an_edit_makes_another_world(tmp_path: Path, town: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = take(tmp_path, town)
    vehicle = next((town.parents[1] / "vehicles").glob("*.xml"))
    vehicle.write_text(vehicle.read_text().replace("</mujoco>", "<!-- edited --></mujoco>"))
    take(tmp_path, town)
    assert len(worlds(tmp_path)) == 2
    assert take(tmp_path, town, dataclasses.replace(CLEAR, sun_altitude_deg=20.0)).weather != before.weather
    assert len(worlds(tmp_path)) == 3
    monkeypatch.setattr(world_cache, "_code_digest", lambda: "newer code")
    take(tmp_path, town)
    # The other process has the code as it is, so its world answers no order of newer code.
    assert len(worlds(tmp_path)) == 3


def test_files_from_afar_make_another_world_when_they_change(tmp_path: Path, town: Path) -> None:
    part = tmp_path / "part.xml"
    part.write_text("<mujoco><worldbody/></mujoco>")
    town.write_text(town.read_text().replace("<worldbody>", '<include file="../../part.xml"/><worldbody>', 1))
    assert "part.xml" in town.read_text()
    assert take(tmp_path, town).model.ngeom
    assert len(worlds(tmp_path)) == 1
    part.write_text('<mujoco><worldbody><body name="far"/></worldbody></mujoco>')
    assert take(tmp_path, town).model.body("far").id >= 0
    assert len(worlds(tmp_path)) == 2


def test_a_mesh_from_afar_makes_another_world_when_it_changes(tmp_path: Path, town: Path) -> None:
    far = tmp_path / "far.obj"
    far.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    text = town.read_text()
    assert "<asset>" in text
    town.write_text(text.replace("<asset>", '<asset><mesh name="far" file="../../far.obj"/>', 1))
    assert take(tmp_path, town).model.mesh("far").id >= 0
    assert len(worlds(tmp_path)) == 1
    far.write_text(far.read_text().replace("v 0 0 1", "v 0 0 2"))
    assert take(tmp_path, town).model.mesh("far").id >= 0
    assert len(worlds(tmp_path)) == 2


def test_a_town_that_strips_paths_finds_its_meshes(tmp_path: Path, town: Path) -> None:
    """They are referred to where they lie, by whole paths."""
    (town.parent / "a & b.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    text = town.read_text()
    assert text.count("<compiler ") == 1 and "<asset>" in text and "meshdir" not in text
    text = text.replace("<compiler ", '<compiler strippath="true" ')
    town.write_text(text.replace("<asset>", '<asset><mesh name="odd" file="a &amp; b.obj"/>', 1))
    assert take(tmp_path, town).model.mesh("odd").id >= 0


def test_half_a_world_is_made_anew(tmp_path: Path) -> None:
    whole = model_bytes(take(tmp_path).model)
    (name,) = worlds(tmp_path)
    seen = tmp_path / "cache" / name / "render.mjb"
    content = seen.read_bytes()
    middle = len(content) // 2
    for spoiled in (content[:middle], b"", content[:middle] + bytes(4096) + content[middle + 4096 :]):
        assert spoiled != content
        seen.write_bytes(spoiled)
        assert model_bytes(take(tmp_path).model) == whole
        assert seen.stat().st_size == len(content)


def test_who_compiles_for_others_ends_with_them(tmp_path: Path) -> None:
    """A batch system kills workers; what they had begun would take the memory of the next ones."""
    order = world_cache.world_key(plan_world(AssetLibrary.for_town(TINY_TOWN), tiny_scenes().scenes[SCENE], CLEAR))
    endless = (
        "import sys, time; from gear.world.compilation import compile_worker; "
        "compile_worker.compile_world = lambda *_, **__: time.sleep(40); "
        "compile_worker.main(sys.argv[1])"
    )
    parent = (
        "import subprocess, sys, time; "
        f"made = subprocess.Popen([sys.executable, '-c', {endless!r}, {str(tmp_path)!r}], stdin=subprocess.PIPE); "
        f"made.stdin.write({json.dumps(order).encode()!r} + b'\\n'); made.stdin.flush(); "
        "print('begun', flush=True); time.sleep(40)"
    )
    with subprocess.Popen([sys.executable, "-c", parent], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stdout.readline() == b"begun\n"
        process.kill()
        began_s = time.monotonic()
        process.stdout.read()  # both of them have it
        assert time.monotonic() - began_s < 30


def test_what_was_not_used_for_longest_goes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(world_cache, "CACHE_BYTES", 1)
    take(tmp_path)
    first = worlds(tmp_path)
    take(tmp_path, weather=dataclasses.replace(CLEAR, sun_altitude_deg=20.0))
    assert len(worlds(tmp_path)) == 1 and worlds(tmp_path) != first


def test_a_cache_that_knows_no_locks_keeps_worlds_all_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Homes on Lustre or NFS are often such."""

    def unsupported(*_: object) -> None:
        raise OSError(errno.ENOSYS, "Function not implemented")

    monkeypatch.setattr("fcntl.flock", unsupported)
    take(tmp_path)
    assert len(worlds(tmp_path)) == 1


@pytest.mark.parametrize("step", ["_locked", "tempfile.TemporaryDirectory"])
def test_a_full_cache_is_no_error(step: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Quotas count files, too."""
    seen = model_bytes(build_tiny_world(SCENE).model)

    def full(*_: object, **__: object) -> None:
        monkeypatch.undo()
        raise OSError(errno.EDQUOT, "Disk quota exceeded")

    monkeypatch.setattr(f"gear.world.compilation.world_cache.{step}", full)
    assert len(model_bytes(take(tmp_path).model)) == len(seen)
    assert not worlds(tmp_path)


def test_a_broken_town_says_what_is_wrong_with_it(tmp_path: Path, town: Path) -> None:
    town.write_text(town.read_text().replace("<worldbody>", "<worldbody><nonsense/>", 1))
    with pytest.raises(TownError, match=r"tiny\.xml"):
        take(tmp_path, town)
    assert not worlds(tmp_path)


def test_a_world_of_the_cache_has_a_shelf_beside_its_models(tmp_path: Path) -> None:
    made, read = take(tmp_path), take(tmp_path)
    (name,) = worlds(tmp_path)
    assert made.shelf == read.shelf and read.shelf.folder == tmp_path / "cache" / name
    assert made.shelf.owner != take(tmp_path, weather=dataclasses.replace(CLEAR, sun_altitude_deg=20.0)).shelf.owner


def test_a_world_of_a_temporary_folder_has_no_shelf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Somebody else could make a folder of the same name."""
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert take(tmp_path).shelf == build_tiny_world(SCENE).shelf == NO_SHELF


def test_faces_without_a_patch_look_the_same_from_the_shelf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built, made = build_tiny_world(SCENE), take(tmp_path)
    monkeypatch.setattr(patch_faces, "_neutral", never)
    for world in (made, take(tmp_path)):
        for face, other in zip(world.faces, built.faces, strict=True):
            assert np.array_equal(face.neutral, other.neutral)
            with pytest.raises(ValueError, match="read-only"):
                face.neutral[0, 0] = 7
