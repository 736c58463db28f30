"""The separate process that loads a plugin as a test."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from gear.plugins.probe import DONE, INTERRUPTED, REFUSED

LAST = "exit functions"

MODULES = {
    "sound": "from gear.contracts.hookspecs import hookimpl\n@hookimpl\ndef gear_tasks():\n    return []\n",
    "fails": "raise ValueError('broken')\n",
    "interrupts": "raise KeyboardInterrupt\n",
    "ends": "import os\nos._exit(3)\n",
    "prints": "print('hello')\n",
    "threads": "import threading\nthreading.Thread(target=threading.Event().wait).start()\n",
    "closes": "import os\nos.close(1)\n",
    "leaves": "import atexit, os\natexit.register(os._exit, 7)\n",
}


def notes_of(name: str, folder: Path) -> tuple[int, list[str]]:
    (folder / f"{name}_plugin.py").write_text(MODULES[name])
    notes = folder / "notes"
    code = f"from gear.plugins.probe_process import main; main({name!r}, '{name}_plugin', 'gear', {str(notes)!r})"
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(folder)!r}); {code}"],
        capture_output=True, timeout=120, check=False,
    )  # fmt: skip
    return done.returncode, notes.read_text().splitlines()


@pytest.mark.parametrize(
    ("name", "code", "notes"),
    [
        ("sound", 0, ["import", "register", "hook gear_tasks", LAST, DONE]),
        ("fails", 0, ["import", DONE]),
        ("interrupts", 0, ["import", INTERRUPTED, DONE]),
        ("ends", 3, ["import"]),
        ("prints", 0, ["import", "register", LAST, DONE]),
        ("threads", 0, ["import", "register", f"{REFUSED}leaves a thread running, so that no command would end", DONE]),
        ("closes", 0, ["import", "register", f"{REFUSED}closes or replaces the standard output of the process", DONE]),
        ("leaves", 7, ["import", "register", LAST]),
    ],
)
def test_the_notes_say_how_far_it_came(name: str, code: int, notes: list[str], tmp_path: Path) -> None:
    assert notes_of(name, tmp_path) == (code, notes)
