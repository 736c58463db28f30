"""Loads plugins that are new on this machine in a separate process first, and caches the result.

Most exceptions can be caught in the process that raises them. Three failures cannot be handled there: the end of the
process (`os._exit`, a crash in C code), a hang, and a KeyboardInterrupt, which looks like the user's Ctrl-C. A plugin
that causes one of these during import, in a hook, in the checks of its specs or in its exit functions is reported and
not loaded into gear's process. The same applies to one that closes the standard output, or leaves a thread running.

Results are stored in `~/.cache/gear/plugins.json` (`$XDG_CACHE_HOME`), by distribution, version, and time and size of
the package's files. Failures that occur only later, for example by chance or in `build`, are not detected.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import importlib.util
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

from gear.plugins.text import printable
from gear.values.machine import cores, processor_time_s
from gear.values.user_cache import user_cache_folder

LIMIT_S = 30.0
"""Limit for the import and the hooks of a plugin: seconds of processor time, and seconds without any processor time.

On a machine with much other work an import takes a multiple of its processor time; importing torch needs a few seconds
of it. The result is stored, so that a limit of elapsed time could disable a plugin for good because of other programs.
"""

LONGEST_S = 20 * LIMIT_S
"""Largest elapsed time in seconds; it ends plugins that use a little processor time again and again without end."""

IDLE_S = 0.05
"""Processor time in seconds below which a process counts as idle; the system counts it in steps of 0.01 s."""

LOOK_S = 0.25
"""Time in seconds between two readings of the processor time."""

CHECKS = 3
"""Version of the checks in the separate process; a new number makes cached results of earlier checks invalid."""

MOST_FILES = 2000
"""Largest number of a package's files whose times and sizes are compared to detect changes."""

MOST_KEPT = 1000
"""Largest number of results in the cache; the newest are stored."""

Verdict = tuple[str, str]
"""Stage and problem of a plugin that must not be loaded; None for a safe plugin."""

UNKNOWN: Verdict = ("", "")
"""Marks a plugin without a cached result."""


def unsafe_plugins(entry_points: Iterable[EntryPoint]) -> dict[EntryPoint, Verdict]:
    """Finds the plugins that must not be loaded into this process, by loading new ones in a separate process each.

    The results are read from and written to the cache file. A plugin whose files have not changed is taken from the
    cache.

    Args:
        entry_points: entry points of other packages.

    Returns:
        For each unsafe plugin, the stage and the problem of its failure in the separate process.
    """
    importlib.invalidate_caches()  # a package may have been installed since this process began
    stamped = {one: stamp(one) for one in entry_points}
    if not stamped:
        return {}
    path = _cache_file()
    known = _read(path)
    fresh = {one: key for one, key in stamped.items() if key not in known}
    if fresh:
        with ThreadPoolExecutor(min(cores(), len(fresh))) as pool:
            probed = zip(fresh.values(), pool.map(_probe_if_possible, fresh), strict=True)
            known |= {key: verdict for key, verdict in probed if verdict != UNKNOWN}
        _write(path, known)
    return {one: verdict for one, key in stamped.items() if (verdict := known.get(key)) is not None}


def _probe_if_possible(entry_point: EntryPoint) -> Verdict | None:
    """Loads a plugin in a separate process; returns `UNKNOWN` if no process can be started.

    In that case the plugin is loaded into gear's process, and tested next time.
    """
    try:
        return probe(entry_point)
    except OSError:
        return UNKNOWN


def probe(entry_point: EntryPoint, limit_s: float = LIMIT_S) -> Verdict | None:
    """Loads one plugin in a separate process, to find out whether it is safe to load into gear's process.

    Args:
        entry_point: entry point of the plugin.
        limit_s: seconds of processor time, or seconds without processor time, after which the process and its
            children are ended.

    Returns:
        None for a safe plugin: the process ended normally, even if the plugin raised exceptions. Otherwise stage and
        problem, also if the plugin raised KeyboardInterrupt.

    Raises:
        OSError: the process failed before it loaded the plugin.
    """
    with tempfile.TemporaryDirectory(prefix="gear-probe-") as folder:
        notes = Path(folder) / "notes"
        words = [entry_point.name, entry_point.value, entry_point.group, str(notes)]
        process = subprocess.Popen(
            [sys.executable, "-c", CODE, json.dumps(sys.path), *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        try:
            status = _status(process, limit_s)
            ending = f"ended the process with status {status}" if status >= 0 else f"ended by {_signal_name(-status)}"
        except subprocess.TimeoutExpired:
            ending = f"took more than {limit_s:g} s"
        finally:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        said = notes.read_text(encoding="utf-8").splitlines() if notes.exists() else []
    stages = [line for line in said if line not in (INTERRUPTED, DONE) and not line.startswith(REFUSED)]
    if not stages:
        raise OSError(f"the process that probes {entry_point.name} did not start: {ending}")
    refused = next((line.removeprefix(REFUSED) for line in said if line.startswith(REFUSED)), None)
    if refused is not None:
        return stages[-1], refused
    if DONE in said:
        return (stages[-1], "KeyboardInterrupt") if INTERRUPTED in said else None
    return stages[-1], ending


def _status(process: subprocess.Popen[bytes], limit_s: float) -> int:
    """Waits for a process, as long as it and its children use processor time within the limit.

    Where the system does not tell the processor time, the limit is of elapsed time.

    Returns:
        The exit status; negative for the number of a signal.

    Raises:
        subprocess.TimeoutExpired: the process reached a limit.
    """
    began_s = busy_s = time.monotonic()
    counted_s = 0.0
    while True:
        with contextlib.suppress(subprocess.TimeoutExpired):
            return process.wait(min(LOOK_S, limit_s))
        used_s, now_s = processor_time_s(process.pid), time.monotonic()
        if used_s > counted_s + IDLE_S:
            counted_s, busy_s = used_s, now_s
        elapsed_s = now_s - began_s
        if used_s > limit_s or now_s - busy_s > limit_s or elapsed_s > LONGEST_S:
            raise subprocess.TimeoutExpired(process.args, elapsed_s)


DONE, INTERRUPTED, REFUSED = "done", "interrupted", "refused: "

CODE = """
import json, sys
sys.path[:] = json.loads(sys.argv[1])
from gear.plugins.probe_process import main
main(*sys.argv[2:])
"""
"""Python code of the separate process, which receives the import path of this process."""


def stamp(entry_point: EntryPoint) -> str:
    """Returns a hash that changes whenever a plugin may load differently: of its files, its Python environment and
    gear.

    It is the key of the plugin's result in the cache.

    Args:
        entry_point: entry point of the plugin.
    """
    facts: list[Any] = [CHECKS, sys.executable, sys.version, entry_point.name, entry_point.value, __file__]
    with contextlib.suppress(Exception):  # damaged metadata, or a finder that raises: then there is less to look at
        if entry_point.dist is not None:
            facts += [entry_point.dist.name, entry_point.dist.version]
    with contextlib.suppress(Exception):
        spec = importlib.util.find_spec(entry_point.value.partition(":")[0].partition(".")[0])
        origin = Path(spec.origin) if spec is not None and spec.origin is not None else None
        if origin is not None:
            files = sorted(origin.parent.rglob("*.py")) if origin.name == "__init__.py" else [origin]
            facts += [(str(file), *_time_and_size(file)) for file in files[:MOST_FILES]]
    # An installation of another package may mend or break this one.
    facts += [(folder, *_time_and_size(Path(folder))) for folder in sys.path if folder.endswith("-packages")]
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:32]


def _time_and_size(path: Path) -> tuple[int, int]:
    found = path.stat()
    return found.st_mtime_ns, found.st_size


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _cache_file() -> Path | None:
    """Path of the cache file; None if the user has no home folder."""
    try:
        return user_cache_folder() / "plugins.json"
    except RuntimeError:
        return None


def _read(path: Path | None) -> dict[str, Verdict | None]:
    """Reads the cached results by hash; returns an empty dictionary if there is no valid cache file."""
    if path is None:
        return {}
    try:
        there = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    known: dict[str, Verdict | None] = {}
    for key, value in there.items() if isinstance(there, dict) else ():
        if value is None:
            known[key] = None
        elif isinstance(value, list) and len(value) == 2:
            known[key] = (printable(str(value[0])), printable(str(value[1])))
    return known


def _write(path: Path | None, known: dict[str, Verdict | None]) -> None:
    """Writes the cache atomically. If it cannot be written, plugins are probed again next time."""
    if path is None:
        return
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        with tempfile.NamedTemporaryFile(
            "w", encoding="utf-8", dir=path.parent, prefix=".plugins-", delete=False
        ) as file:
            json.dump(dict(list(known.items())[-MOST_KEPT:]), file)
        Path(file.name).replace(path)
