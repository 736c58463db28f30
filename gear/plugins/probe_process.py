"""The separate process in which `gear.plugins.probe` loads one plugin as a test.

It writes its current stage to a file, and a final entry at its end. The parent process relies only on this file,
because the plugin may print, leave threads running or register functions that run at exit.
"""

from __future__ import annotations

import os
from importlib.metadata import EntryPoint
from itertools import islice
from pathlib import Path

import pluggy

from gear.contracts import hookspecs
from gear.plugins.catalogue import as_iterable
from gear.plugins.manager import MOST_SPECS
from gear.plugins.probe import DONE, INTERRUPTED
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
    except KeyboardInterrupt:
        note(INTERRUPTED)
    except BaseException:  # which the other process catches, too, and reports
        pass
    note(DONE)
    os._exit(0)
