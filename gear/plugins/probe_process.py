"""The separate process in which `gear.plugins.probe` loads one plugin as a test.

It writes its current stage to a file, and a final entry at its end. The parent process relies only on this file,
because the plugin may print, leave threads running or register functions that run at exit.
"""

from __future__ import annotations

import atexit
import os
import threading
from importlib.metadata import EntryPoint
from itertools import islice
from pathlib import Path

import pluggy

from gear.contracts import hookspecs
from gear.plugins.catalogue import as_iterable
from gear.plugins.manager import MOST_SPECS
from gear.plugins.probe import DONE, INTERRUPTED, REFUSED
from gear.plugins.spec_validation import HOOK_OF, spec_problem


def main(name: str, value: str, group: str, notes: str) -> None:
    """Imports the plugin, calls its hooks, checks its specs and ends the process; never returns.

    Args:
        name, value, group: the plugin's entry point.
        notes: path of the file to which each stage is written.
    """
    path = Path(notes)

    def note(line: str) -> None:
        with path.open("a", encoding="utf-8") as file:
            file.write(line + "\n")

    outputs = _outputs()
    try:
        note("import")
        plugin = EntryPoint(name=name, value=value, group=group).load()
        note("register")
        manager = pluggy.PluginManager(hookspecs.PROJECT)
        manager.add_hookspecs(hookspecs)
        manager.register(plugin)
        for kind, hook in HOOK_OF.items():
            for implementation in getattr(manager.hook, hook).get_hookimpls():
                note(f"hook {hook}")
                for spec in islice(as_iterable(implementation.function()), MOST_SPECS + 1):
                    spec_problem(kind, spec)
        if _outputs() != outputs:
            note(f"{REFUSED}closes or replaces the standard output of the process")
        elif any(not thread.daemon for thread in threading.enumerate() if thread is not threading.main_thread()):
            note(f"{REFUSED}leaves a thread running, so that no command would end")
        else:
            note("exit functions")
            atexit._run_exitfuncs()  # an exit in one of them would replace the exit code of every command
    except KeyboardInterrupt:
        note(INTERRUPTED)
    except BaseException:  # which the other process catches, too, and reports
        pass
    note(DONE)
    os._exit(0)


def _outputs() -> list[tuple[int, int] | None]:
    """Device and inode of stdout and stderr, by which a change of them is noticed; None for a closed one."""
    found: list[tuple[int, int] | None] = []
    for number in (1, 2):
        try:
            there = os.fstat(number)
            found.append((there.st_dev, there.st_ino))
        except OSError:
            found.append(None)
    return found
