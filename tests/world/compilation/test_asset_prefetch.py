"""Files that are read ahead: the same world, each file read once, nothing kept, and errors as without."""

from __future__ import annotations

import os
import shutil
import threading
from pathlib import Path

import mujoco
import numpy as np
import pytest

from gear.testing.tiny_town import CLEAR, TINY_TOWN, tiny_scenes
from gear.values.errors import TownError
from gear.world.assets.library import AssetLibrary
from gear.world.compilation import asset_prefetch as prefetch_module
from gear.world.compilation import compiled_world
from gear.world.compilation.asset_prefetch import asset_prefetcher
from gear.world.compilation.compiled_world import compile_world
from gear.world.compilation.compose import Composition
from gear.world.compilation.model_compilation import render_model
from gear.world.compilation.world_plan import plan_world

SCENE = tiny_scenes().scenes["board"]
MESHES = 6


@pytest.fixture
def town(tmp_path: Path) -> Path:
    """The tiny town with meshes of its own: one is scaled, and one is asked for with another inertia."""
    shutil.copytree(TINY_TOWN.parents[1], tmp_path, dirs_exist_ok=True)
    town = tmp_path / "towns" / "tiny.xml"
    assets, geoms = "", ""
    for number in range(MESHES):
        (town.parent / f"rock_{number}.obj").write_text(
            f"v 0 0 0\nv {number + 1} 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
        )
        more = {0: 'scale="1 2 3" inertia="shell"', 1: ""}.get(number, 'inertia="shell"')
        assets += f'<mesh name="rock_{number}" file="rock_{number}.obj" {more}/>'
        geoms += f'<geom name="rock_{number}" class="bench" type="mesh" mesh="rock_{number}" pos="{number} 20 0"/>'
    text = TINY_TOWN.read_text().replace("<asset>", f"<asset>{assets}").replace("<worldbody>", f"<worldbody>{geoms}")
    town.write_text(text)
    return town


def arrays(model: mujoco.MjModel) -> dict[str, np.ndarray]:
    found = {name: getattr(model, name) for name in dir(model) if not name.startswith("_")}
    return {name: value for name, value in found.items() if isinstance(value, np.ndarray)}


def kept_bytes() -> int:
    return int(mujoco.mj_getCacheSize(mujoco.mj_getCache()))


def test_a_world_that_was_read_ahead_is_the_same(town: Path) -> None:
    library = AssetLibrary.for_town(town)
    plain, prefetched = (compile_world(plan_world(library, SCENE, CLEAR), readers=readers) for readers in (0, 3))
    assert (plain.classes.label_code == prefetched.classes.label_code).all() and plain.faces == prefetched.faces
    for one, other in ((plain.model, prefetched.model), (plain.placement_model, prefetched.placement_model)):
        others = arrays(other)
        different = [name for name, value in arrays(one).items() if not np.array_equal(value, others[name])]
        # The folder that textures are laid out in has another name each time.
        assert set(different) <= {"paths", "tex_pathadr", "mesh_pathadr"}
    assert plain.model.nmesh >= MESHES


def test_nothing_is_read_twice_and_nothing_is_kept(town: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = []

    def compile_there(composition: Composition) -> object:
        sizes.append(kept_bytes())
        both = render_model(composition)
        sizes.append(kept_bytes())
        return both

    monkeypatch.setattr(compiled_world, "render_model", compile_there)
    compile_world(plan_world(AssetLibrary.for_town(town), SCENE, CLEAR), readers=2)
    assert 0 < sizes[0] == sizes[1], "whatever is not there yet is put there when it is read"
    assert kept_bytes() == 0 == mujoco.mj_getCacheCapacity(mujoco.mj_getCache())
    sizes.clear()
    compile_world(plan_world(AssetLibrary.for_town(town), SCENE, CLEAR))
    assert sizes == [0, 0], "without readers nothing is in memory twice"


def test_a_broken_mesh_is_named_as_without(town: Path) -> None:
    (town.parent / "rock_3.obj").write_text("v 0 0 0\nf 1 2 3\n")
    library = AssetLibrary.for_town(town)
    told = []
    for readers in (0, 2):
        with pytest.raises(TownError) as caught:
            compile_world(plan_world(library, SCENE, CLEAR), readers=readers)
        told.append(str(caught.value))
    assert told[0] == told[1] and "rock_3" in told[0]
    assert kept_bytes() == 0


def test_assets_that_are_not_requested_are_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prefetch_module, "_BATCH_BYTES", 1)
    first_ends, read = threading.Event(), []

    def slow(files: list[str]) -> None:
        read.append(files)
        first_ends.wait(60)

    monkeypatch.setattr(prefetch_module, "_read", slow)
    files = [tmp_path / f"{number}.obj" for number in range(40)]
    for file in files:
        file.write_text("v 0 0 0\n")
    with pytest.raises(KeyboardInterrupt), asset_prefetcher(1) as prefetcher:
        prefetcher.prefetch(map(os.fspath, files))
        threading.Timer(0.3, first_ends.set).start()
        raise KeyboardInterrupt
    assert len(read) < len(files)
