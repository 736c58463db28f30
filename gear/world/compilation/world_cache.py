"""A cache of compiled worlds on disk. Loading a cached world takes about a second, and less memory than compiling the
world.

A world that is not in the cache is compiled in a subprocess, so the memory for compiling is freed when the subprocess
ends. The world is stored under a hash of everything that determines it: gear's code, versions of packages, the content
of every MJCF file, mesh and texture, scene and weather. A change to any of them gives a new entry.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

import mujoco

from gear.values.array_shelf import NO_SHELF, ArrayShelf
from gear.values.errors import GearError
from gear.values.scene import Weather
from gear.values.serial import Json, to_json
from gear.values.user_cache import user_cache_folder
from gear.world.assets.asset_hash import asset_files, assets_digest
from gear.world.assets.library import AssetLibrary
from gear.world.compilation.compiled_world import CompiledWorld, compile_world
from gear.world.compilation.world_plan import WorldPlan, plan_world
from gear.world.scene_spec import SceneSpec
from gear.world.world import World

CACHE_BYTES = 4 << 30
"""Largest size of the cache, about twelve towns with their shelves; the least recently used entries are removed."""

NOT_CACHED_BELOW_BYTES = 4 << 20
"""Towns with fewer bytes of assets are not cached, because compiling them takes less time than starting a
subprocess.
"""

MAY_CACHE = "may-cache"
"""Name of the file by which the subprocess reports that the key covers every file that it read."""

DONE = b"done"
"""Text that the subprocess writes to its standard output when the world is saved."""

_ROOMS = ("values", "contracts", "camera", "world")
_SCRATCH = ".making-"
_ABANDONED_S = 3600.0


def load_or_compile(
    *, town: str | Path, scene_name: str, scene: SceneSpec, weather: Weather, cache_dir: Path | None = None
) -> World:
    """Loads a world from the cache. If the cache does not contain the world, it is compiled and, unless the town is
    small, added.

    Args:
        town, scene_name, scene, weather: name or MJCF path of the town, name of the scene in records, the scene, and
            the weather.
        cache_dir: folder of the cache; None for `gear/worlds` in the user's cache folder.

    Raises:
        UnknownNameError: there is no such town, board or truck.
        TownError: a file breaks the conventions.
    """
    plan = plan_world(AssetLibrary.for_town(town), scene, weather)
    asset_bytes = sum(path.stat().st_size for path in asset_files(plan.assets.library).values())
    shelf = NO_SHELF
    if cache_dir is None and asset_bytes < NOT_CACHED_BELOW_BYTES:
        compiled = compile_world(plan)
    else:
        with _folder(cache_dir) as (folder, is_kept):
            compiled, entry = _from_cache(folder, plan)
        # Once a temporary folder is removed, anybody could make a folder of its name.
        if is_kept and compiled.checksum and entry.is_dir():
            shelf = ArrayShelf(folder=entry, owner=compiled.checksum)
    return World.of(plan, scene_name, compiled, shelf)


@contextlib.contextmanager
def _folder(cache_dir: Path | None) -> Iterator[tuple[Path, bool]]:
    """The cache's folder, and whether it stays; a temporary folder if the user's cache folder cannot be written."""
    try:
        folder = cache_dir or user_cache_folder() / "worlds"
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        usable = os.access(folder, os.W_OK)
    except (OSError, RuntimeError):
        usable = False
    if usable:
        yield folder, True
    else:
        with tempfile.TemporaryDirectory(prefix="gear-") as temporary:
            yield Path(temporary), False


def _from_cache(cache_dir: Path, plan: WorldPlan) -> tuple[CompiledWorld, Path]:
    """Loads a world, or compiles it in a subprocess and stores it. Returns the world, and the folder of its entry."""
    key = world_key(plan)
    entry = cache_dir / hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()[:32]
    compiled = _load(entry, plan)
    if compiled is not None:
        return compiled, entry
    with contextlib.suppress(OSError), _locked(entry):  # a full disk must not keep a world from being compiled
        compiled = _load(entry, plan)
        if compiled is not None:
            return compiled, entry
        with tempfile.TemporaryDirectory(prefix=_SCRATCH, dir=cache_dir, ignore_cleanup_errors=True) as name:
            scratch = Path(name) / "world"
            scratch.mkdir()
            with _compiled_in_subprocess(key, scratch) as is_done:
                if is_done:
                    compiled = _load(scratch, plan)
                    if (scratch / MAY_CACHE).exists():
                        _store(scratch, entry)
    # If the subprocess failed, compiling here fails too, with an error that says why.
    return compiled or compile_world(plan), entry


def world_key(plan: WorldPlan) -> dict[str, Json]:
    """The key of a compiled world in the cache, as JSON.

    Args:
        plan: the contents of the world.

    Returns:
        Town, scene and weather of the plan, a hash of its assets, a hash of gear's code, and the versions of MuJoCo and
        dm_control. A world is compiled again if any of them changes.
    """
    return {
        "town": str(plan.town.resolve()),
        "scene": to_json(plan.scene),
        "weather": to_json(plan.weather),
        "assets": assets_digest(plan.assets.library),
        "code": _code_digest(),
        "versions": [mujoco.__version__, metadata.version("dm-control")],
    }


def _code_digest() -> str:
    """sha256 over the source files of the packages that determine how a world is made."""
    package = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256()
    for path in (path for room in _ROOMS for path in sorted((package / room).rglob("*.py"))):
        digest.update(
            f"{path.relative_to(package).as_posix()}\0{hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode()
        )
    return digest.hexdigest()


def _load(entry: Path, plan: WorldPlan) -> CompiledWorld | None:
    """The world of a cache entry; None if the entry does not exist or is damaged."""
    try:
        compiled = CompiledWorld.load(entry, plan.slots)
        os.utime(entry)
    except (OSError, ValueError, KeyError, GearError, mujoco.FatalError):
        return None
    return compiled


@contextlib.contextmanager
def _compiled_in_subprocess(key: dict[str, Json], folder: Path) -> Iterator[bool]:
    """Compiles the world for a key into a folder, in a subprocess, and yields whether that succeeded.

    The subprocess reports success before it ends, because freeing its memory takes a tenth of a second; in that time
    this process can already load the world.
    """
    # os._exit skips the shutdown of the interpreter, which would free half a million objects one by one.
    code = "import os, sys; from gear.world.compilation.compile_worker import main; main(sys.argv[1]); os._exit(0)"
    search_path = os.pathsep.join(path for path in sys.path if path)
    with subprocess.Popen(
        [sys.executable, "-c", code, str(folder)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        # The subprocess does not render, and importing MuJoCo's renderers takes time.
        env={**os.environ, "PYTHONPATH": search_path, "PYTHONSAFEPATH": "1", "MUJOCO_GL": "disabled"},
    ) as compiler:
        assert compiler.stdin is not None and compiler.stdout is not None
        try:
            with contextlib.suppress(BrokenPipeError):
                compiler.stdin.write(json.dumps(key).encode() + b"\n")
                compiler.stdin.flush()  # stays open: the subprocess ends when this process ends and so closes it
            yield compiler.stdout.read(len(DONE)) == DONE
        except BaseException:
            compiler.kill()
            raise


@contextlib.contextmanager
def _locked(entry: Path) -> Iterator[None]:
    """Context in which no other process compiles the same entry. On systems where files cannot be locked, each
    process compiles it.
    """
    if sys.platform == "win32":
        yield
        return
    import fcntl

    with entry.with_suffix(".lock").open("w") as lock:
        with contextlib.suppress(OSError):  # network file systems may not support locks
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _store(scratch: Path, entry: Path) -> None:
    """Moves a compiled world into the cache and removes the least recently used entries."""
    with contextlib.suppress(OSError):
        shutil.rmtree(entry, ignore_errors=True)
        scratch.rename(entry)
        kept_bytes = 0
        worlds = [path for path in entry.parent.iterdir() if path.is_dir()]
        for world in sorted(worlds, key=lambda path: path.stat().st_mtime, reverse=True):
            if world.name.startswith(_SCRATCH):
                if time.time() - world.stat().st_mtime > _ABANDONED_S:
                    shutil.rmtree(world, ignore_errors=True)
                continue
            kept_bytes += sum(path.stat().st_size for path in world.iterdir())
            if kept_bytes > CACHE_BYTES and world != entry:
                shutil.rmtree(world, ignore_errors=True)
                world.with_suffix(".lock").unlink(missing_ok=True)
