"""Compiled worlds on disk: whoever needs one next loads it in a second, and never has the memory that compiling takes.

A world is compiled in a process of its own and kept under a hash of everything that decides it: gear's code, versions,
the content of every MJCF file, mesh and texture, scene and weather. An edit of any of them is another world.
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

from gear.values.errors import GearError
from gear.values.scene import Weather
from gear.values.serial import Json, to_json
from gear.world.assets.asset_hash import asset_files, assets_digest
from gear.world.assets.library import AssetLibrary
from gear.world.compilation.compiled_world import CompiledWorld, compile_world
from gear.world.scene_spec import SceneSpec
from gear.world.world import World

CACHE_BYTES = 3 << 30
"""Worlds that were used last are kept up to this, about sixteen towns."""

NOT_CACHED_BELOW_BYTES = 4 << 20
"""A town with fewer bytes of assets compiles sooner than a process starts."""

MAY_CACHE = "may-cache"
"""Name of the file by which the compiling process says that the hash covers all that it read."""

DONE = b"done"
"""What the compiling process says when all is written."""

_ROOMS = ("values", "contracts", "camera", "world")
_SCRATCH = ".making-"
_ABANDONED_S = 3600.0


def load_or_compile(
    *, town: str | Path, scene_name: str, scene: SceneSpec, weather: Weather, cache_dir: Path | None = None
) -> World:
    """As `World.build`, from the shelf where the same world lies there.

    Args:
        town, scene_name, scene, weather: as for `World.build`.
        cache_dir: folder that worlds are kept in; the user's cache unless given.

    Raises:
        UnknownNameError: there is no such town, board or truck.
        TownError: a file breaks the conventions.
    """
    library = AssetLibrary.for_town(town)
    if (
        cache_dir is None
        and sum(path.stat().st_size for path in asset_files(library).values()) < NOT_CACHED_BELOW_BYTES
    ):
        compiled = compile_world(library, scene, weather)
    else:
        with _folder(cache_dir) as folder:
            compiled = _from_cache(folder, library, scene, weather)
    return World.of(library, scene_name, scene, weather, compiled)


@contextlib.contextmanager
def _folder(cache_dir: Path | None) -> Iterator[Path]:
    """The shelf; one that is gone afterwards where the user's cache cannot be written."""
    try:
        folder = cache_dir or Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gear" / "worlds"
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        usable = os.access(folder, os.W_OK)
    except (OSError, RuntimeError):
        usable = False
    if usable:
        yield folder
    else:
        with tempfile.TemporaryDirectory(prefix="gear-") as passing:
            yield Path(passing)


def _from_cache(cache_dir: Path, library: AssetLibrary, scene: SceneSpec, weather: Weather) -> CompiledWorld:
    order = world_key(library, scene, weather)
    entry = cache_dir / hashlib.sha256(json.dumps(order, sort_keys=True).encode()).hexdigest()[:32]
    compiled = _load(entry, library, scene)
    if compiled is not None:
        return compiled
    with contextlib.suppress(OSError), _locked(entry):  # a disk that takes no more files must stand in nobody's way
        compiled = _load(entry, library, scene)
        if compiled is not None:
            return compiled
        with tempfile.TemporaryDirectory(prefix=_SCRATCH, dir=cache_dir, ignore_cleanup_errors=True) as name:
            scratch = Path(name) / "world"
            scratch.mkdir()
            with _compiled_in_subprocess(order, scratch) as is_done:
                if is_done:
                    compiled = _load(scratch, library, scene)
                    if (scratch / MAY_CACHE).exists():
                        _store(scratch, entry)
    # Where it failed, it fails here too, and says why.
    return compiled or compile_world(library, scene, weather)


def world_key(library: AssetLibrary, scene: SceneSpec, weather: Weather) -> dict[str, Json]:
    """Everything that decides a compiled world, as JSON."""
    return {
        "town": str(library.town.resolve()),
        "scene": to_json(scene),
        "weather": to_json(weather),
        "assets": assets_digest(library),
        "code": _code_digest(),
        "versions": [mujoco.__version__, metadata.version("dm-control")],
    }


def _code_digest() -> str:
    """sha256 over the sources of what makes worlds: whoever edits that gets new ones."""
    package = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256()
    for path in (path for room in _ROOMS for path in sorted((package / room).rglob("*.py"))):
        digest.update(
            f"{path.relative_to(package).as_posix()}\0{hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode()
        )
    return digest.hexdigest()


def _load(entry: Path, library: AssetLibrary, scene: SceneSpec) -> CompiledWorld | None:
    try:
        compiled = CompiledWorld.load(entry, library, scene)
        os.utime(entry)
    except (OSError, ValueError, KeyError, GearError, mujoco.FatalError):
        return None
    return compiled


@contextlib.contextmanager
def _compiled_in_subprocess(order: dict[str, Json], folder: Path) -> Iterator[bool]:
    """Compiles into a folder, in another process; whether that went well.

    That process says so before it ends: giving back its memory takes a tenth of a second, in which others can load.
    """
    # Without Python's own end, which would free half a million objects one by one.
    code = "import os, sys; from gear.world.compilation.compile_worker import main; main(sys.argv[1]); os._exit(0)"
    places = os.pathsep.join(path for path in sys.path if path)
    with subprocess.Popen(
        [sys.executable, "-c", code, str(folder)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        # Nothing is drawn there, and what would draw takes its time to be imported.
        env={**os.environ, "PYTHONPATH": places, "PYTHONSAFEPATH": "1", "MUJOCO_GL": "disabled"},
    ) as compiler:
        assert compiler.stdin is not None and compiler.stdout is not None
        try:
            with contextlib.suppress(BrokenPipeError):
                compiler.stdin.write(json.dumps(order).encode() + b"\n")
                compiler.stdin.flush()  # and stays open: that it is closed is how the other sees this process end
            yield compiler.stdout.read(len(DONE)) == DONE
        except BaseException:
            compiler.kill()
            raise


@contextlib.contextmanager
def _locked(entry: Path) -> Iterator[None]:
    """Of several workers that need a world one compiles it; without such locks each of them does."""
    if sys.platform == "win32":
        yield
        return
    import fcntl

    with entry.with_suffix(".lock").open("w") as lock:
        with contextlib.suppress(OSError):  # a network file system
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _store(scratch: Path, entry: Path) -> None:
    """Puts a world on the shelf, and takes down those that were not used for longest."""
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
