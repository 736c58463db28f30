"""Plugins that are new here are loaded in a process of their own first, and what that process came to is remembered.

An exception can be caught in the process that raises it, so it makes no plugin unsafe. What cannot be caught there are
an end of the process (`os._exit`, a crash in C code), a hang, and a KeyboardInterrupt, which looks as if the user had
pressed Ctrl-C. A plugin that does any of these while its module is imported, in a hook or as its specs are checked is
reported and never loaded into gear's own process.

The verdicts lie in `~/.cache/gear/plugins.json` (`$XDG_CACHE_HOME`), by distribution, version, and time and size of the
package's files. A plugin that behaves otherwise later (by chance, by the clock, in `build`) is beyond this.
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
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

from gear.plugins.text import printable
from gear.values.machine import cores

LIMIT_S = 30.0
"""Seconds that a plugin may take to be imported and to say what it has; far more than importing torch takes."""

MOST_FILES = 2000
"""Of a package, whose times and sizes are looked at."""

MOST_KEPT = 1000
"""Verdicts in the cache; the newest stay."""

Verdict = tuple[str, str]
"""Stage and problem of a plugin that must not be loaded."""

UNKNOWN: Verdict = ("", "")
"""In place of a verdict where there is none."""


def unsafe_plugins(entry_points: Iterable[EntryPoint]) -> dict[EntryPoint, Verdict]:
    """The plugins that must not be loaded into this process, with what they did in a process of their own.

    Args:
        entry_points: of third parties; those that were probed before are not probed again while their files stay.
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
    """`UNKNOWN` where no process can be started; the plugin is then loaded as if it were safe, and probed next time."""
    try:
        return probe(entry_point)
    except OSError:
        return UNKNOWN


def probe(entry_point: EntryPoint, limit_s: float = LIMIT_S) -> Verdict | None:
    """Loads one plugin in a process of its own.

    Args:
        entry_point: of the plugin.
        limit_s: seconds after which the process, with all that it started, is ended.

    Returns:
        None where the process came to its end, whatever exceptions the plugin raised; else stage and problem.

    Raises:
        OSError: the process did not come so far as to load the plugin.
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
            status = process.wait(limit_s)
            ending = f"ended the process with status {status}" if status >= 0 else f"ended by {_signal_name(-status)}"
        except subprocess.TimeoutExpired:
            ending = f"took more than {limit_s:g} s"
        finally:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        said = notes.read_text(encoding="utf-8").splitlines() if notes.exists() else []
    stages = [line for line in said if line not in (INTERRUPTED, DONE)]
    if not stages:
        raise OSError(f"the process that probes {entry_point.name} did not start: {ending}")
    if DONE in said:
        return (stages[-1], "KeyboardInterrupt") if INTERRUPTED in said else None
    return stages[-1], ending


DONE, INTERRUPTED = "done", "interrupted"

CODE = """
import json, sys
sys.path[:] = json.loads(sys.argv[1])
from gear.plugins.probe_process import main
main(*sys.argv[2:])
"""
"""What the probing process runs; the path is given, so that it finds what this process finds."""


def stamp(entry_point: EntryPoint) -> str:
    """A hash that changes with whatever may change how a plugin loads: its files, its environment, gear."""
    facts: list[Any] = [sys.executable, sys.version, entry_point.name, entry_point.value, __file__]
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
    """None where the user has no home."""
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gear" / "plugins.json"
    except RuntimeError:
        return None


def _read(path: Path | None) -> dict[str, Verdict | None]:
    """Verdicts by stamp; none where there is no file, or one that is not gear's."""
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
    """Whole or not at all; where the cache cannot be written, plugins are probed again next time."""
    if path is None:
        return
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        with tempfile.NamedTemporaryFile(
            "w", encoding="utf-8", dir=path.parent, prefix=".plugins-", delete=False
        ) as file:
            json.dump(dict(list(known.items())[-MOST_KEPT:]), file)
        Path(file.name).replace(path)


MOST_KEPT = 1000
"""Verdicts that are kept; those of the last probes stay."""
