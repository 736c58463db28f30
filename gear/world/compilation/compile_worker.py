"""The subprocess in which `gear.world.compilation.world_cache` compiles a world."""

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
from gear.world.compilation import quiet_mjcf
from gear.world.compilation.compiled_world import compile_world
from gear.world.compilation.world_cache import DONE, MAY_CACHE, world_key
from gear.world.compilation.world_plan import plan_world
from gear.world.scene_spec import SceneSpec
from gear.world.weather.light import Lighting, lighting_of

_SWITCH_S = 0.0005
"""Longest time in seconds for which one thread holds Python's interpreter lock. It is short, so that the threads that
read files for MuJoCo are not delayed.
"""

_READERS = 8
"""Largest number of threads that read assets; no town has more than forty batches of them."""

_CODE_SUFFIXES = (".py", ".pyc", ".so")


def main(folder: str) -> None:
    """Compiles a world and saves it into the folder. The world's key (a JSON text) is the first line of standard
    input.

    When the world is saved, the worker writes `DONE` to standard output. The worker also creates the file `MAY_CACHE`
    if the key covers every file that was read. The key does not cover files outside the town's assets, or a file that
    was edited in the meantime.

    Args:
        folder: existing, empty folder for the compiled world.
    """
    gc.disable()  # half a million objects live to the end; collecting garbage took a third of the time
    sys.setswitchinterval(_SWITCH_S)
    key = json.loads(sys.stdin.readline())
    library = AssetLibrary(Path(key["town"]))
    scene, weather = from_json(SceneSpec, key["scene"]), from_json(Weather, key["weather"])
    lighting = _lighting_in_process(weather)
    threading.Thread(target=_exit_with_parent, daemon=True).start()
    known = {os.path.realpath(path) for path in asset_files(library).values()}
    readers = min(_READERS, cores())  # reads files of the system, which do not determine the world
    assert quiet_mjcf.mjcf  # imported now, because it reads files of its own
    files_read = _record_files_read()
    plan = plan_world(library, scene, weather)
    compiled = compile_world(plan, lighting, readers=readers)
    is_covered = files_read <= known
    with ThreadPoolExecutor(1) as thread:
        key_afterwards = thread.submit(world_key, plan)
        compiled.save(Path(folder))
    if is_covered and key_afterwards.result() == key:
        (Path(folder) / MAY_CACHE).touch()
    os.write(sys.stdout.fileno(), DONE)


def _lighting_in_process(weather: Weather) -> Callable[[], Lighting] | None:
    """Starts to compute the light of a weather in another process, and returns a function that waits for the result.

    In this process the computation would compete with the composition for the interpreter. None if processes cannot be
    forked.
    """
    if sys.platform != "linux":
        return None
    fork = multiprocessing.get_context("fork")
    receiver, sender = fork.Pipe(duplex=False)

    def work() -> None:
        receiver.close()  # if the parent ends, sending fails and this process ends too
        sender.send(lighting_of(weather))

    fork.Process(target=work, daemon=True).start()
    sender.close()

    def wait() -> Lighting:
        try:
            lighting: Lighting = receiver.recv()
        except EOFError:
            return lighting_of(weather)
        return lighting

    return wait


def _exit_with_parent() -> None:
    """Ends this process when its parent has ended, for example because it was killed; the result would not be used."""
    while os.read(0, 1):
        pass
    os._exit(1)


def _record_files_read() -> set[str]:
    """Returns a set to which the real path of each file that Python opens for reading is added from now on,
    except code.
    """
    files: set[str] = set()

    def record(event: str, details: tuple[Any, ...]) -> None:
        if event == "open" and isinstance(details[0], str) and str(details[1] or "").startswith("r"):
            path = os.path.realpath(details[0])
            if not path.endswith(_CODE_SUFFIXES):
                files.add(path)

    sys.addaudithook(record)
    return files
