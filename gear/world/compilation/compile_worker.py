"""The process that compiles a world for others to load."""

from __future__ import annotations

import gc
import json
import multiprocessing
import os
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from gear.values.machine import cores
from gear.values.scene import Weather
from gear.values.serial import from_json
from gear.world.assets.asset_hash import asset_files
from gear.world.assets.library import AssetLibrary
from gear.world.compilation.compiled_world import compile_world
from gear.world.compilation.world_cache import DONE, MAY_CACHE, world_key
from gear.world.scene_spec import SceneSpec
from gear.world.weather.light import Lighting, lighting_of

_SWITCH_S = 0.0005
"""How long one thread may keep others from Python: what runs beside is quick to go on."""

_READERS = 8
"""There are no more than forty shares to read."""

_CODE_SUFFIXES = (".py", ".pyc", ".so")


def main(folder: str) -> None:
    """Compiles the order on the first line of standard input into a folder, and says there whether the order covers
    all that was read, and on standard output when it is done.

    The order does not where a town refers to files far from it, or where somebody edited one meanwhile.
    """
    gc.disable()  # half a million objects of MJCF, all kept to the end: looking for garbage took a third of the time
    sys.setswitchinterval(_SWITCH_S)
    order = json.loads(sys.stdin.readline())
    library = AssetLibrary(Path(order["town"]))
    scene, weather = from_json(SceneSpec, order["scene"]), from_json(Weather, order["weather"])
    lighting = _lighting_in_process(weather)
    threading.Thread(target=_exit_with_parent, daemon=True).start()
    known = {os.path.realpath(path) for path in asset_files(library).values()}
    files_read = _record_files_read()
    compiled = compile_world(library, scene, weather, lighting, readers=min(_READERS, cores()))
    is_covered = files_read <= known
    with ThreadPoolExecutor(1) as aside:
        read = aside.submit(world_key, library, scene, weather)
        compiled.save(Path(folder))
    if is_covered and read.result() == order:
        (Path(folder) / MAY_CACHE).touch()
    os.write(sys.stdout.fileno(), DONE)


def _lighting_in_process(weather: Weather) -> Callable[[], Lighting] | None:
    """What waits for a weather's light, which another process works out: in this one Python would hold it up."""
    if sys.platform != "linux":
        return None
    fork = multiprocessing.get_context("fork")
    here, there = fork.Pipe(duplex=False)

    def work() -> None:
        here.close()  # so that it ends with the one that waits
        there.send(lighting_of(weather))

    fork.Process(target=work, daemon=True).start()
    there.close()

    def wait() -> Lighting:
        try:
            lighting: Lighting = here.recv()
        except EOFError:
            return lighting_of(weather)
        return lighting

    return wait


def _exit_with_parent() -> None:
    """Ends this process when the one that waits for the world is gone, killed perhaps: who gives the command again
    should have the machine for itself."""
    while os.read(0, 1):
        pass
    os._exit(1)


def _record_files_read() -> set[str]:
    """Real paths of the files that Python opens to read from now on, code left out."""
    read: set[str] = set()

    def record(event: str, details: tuple[Any, ...]) -> None:
        if event == "open" and isinstance(details[0], str) and str(details[1] or "").startswith("r"):
            path = os.path.realpath(details[0])
            if not path.endswith(_CODE_SUFFIXES):
                read.add(path)

    sys.addaudithook(record)
    return read
