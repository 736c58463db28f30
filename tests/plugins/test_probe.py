"""What a plugin does that cannot be caught in one process: it ends a process of its own, and is named."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from gear.plugins import probe as probing
from gear.plugins.manager import discover
from gear.plugins.probe import probe, stamp, unsafe_plugins
from gear.plugins.text import printable

HOOK = """
from gear.contracts.hookspecs import hookimpl

@hookimpl
def gear_defenses():
    {body}
"""


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path


def put(site: Path, name: str, code: str) -> EntryPoint:
    (site / f"{name}.py").write_text(code)
    importlib.invalidate_caches()
    return EntryPoint(name=name, value=name, group="gear")


@pytest.mark.parametrize(
    ("code", "verdict"),
    [
        ("import os; os._exit(3)", ("import", "ended the process with status 3")),
        ("raise KeyboardInterrupt", ("import", "KeyboardInterrupt")),
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", ("import", "ended by SIGSEGV")),
        (HOOK.format(body="import os; os._exit(0)"), ("hook gear_defenses", "ended the process with status 0")),
        (HOOK.format(body="raise KeyboardInterrupt"), ("hook gear_defenses", "KeyboardInterrupt")),
        ("raise SystemExit(3)", None),
        ("raise GeneratorExit", None),
        (HOOK.format(body="return [3]"), None),
        (HOOK.format(body="yield from iter(int, 1)"), None),
        ("print('hello'); import atexit; atexit.register(print, 'bye'); atexit.register(1 .__truediv__, 0)", None),
        ("import atexit, os; atexit.register(os._exit, 7)", ("exit functions", "ended the process with status 7")),
        ("import os; os.close(2)", ("register", "closes or replaces the standard output of the process")),
    ],
)
def test_what_a_plugin_does_is_found_in_a_process_of_its_own(
    site: Path, code: str, verdict: tuple[str, str] | None
) -> None:
    assert probe(put(site, "stranger", code)) == verdict


def test_one_that_hangs_is_ended_with_what_it_started(site: Path) -> None:
    code = "import subprocess, sys, time\nwords = [sys.executable, '-c', 'import time; time.sleep(600)']\n"
    code += "child = subprocess.Popen(words)\n"
    code += f"open({str(site / 'child')!r}, 'w').write(str(child.pid))\ntime.sleep(600)"
    assert probe(put(site, "sleeper", code), limit_s=8) == ("import", "took more than 8 s")
    child = int((site / "child").read_text())
    state = Path(f"/proc/{child}/stat")
    assert not state.exists() or state.read_text().rpartition(")")[2].split()[0] == "Z"


def test_a_busy_machine_disables_no_plugin(site: Path) -> None:
    """The plugin takes longer than the limit, as on a busy machine, but uses less processor time than that."""
    code = "import time\nfor turn in range(14):\n    time.sleep(0.25)\n    end = time.process_time() + 0.06\n"
    code += "    while time.process_time() < end: pass"
    assert probe(put(site, "slow", code), limit_s=3.5) is None


@pytest.mark.parametrize(
    ("code", "limit_s", "longest_s"), [("pass", 0.3, 600), ("time.sleep(600)", 0.5, 600), ("time.sleep(0.001)", 60, 1)]
)
def test_a_process_ends_at_each_limit(
    monkeypatch: pytest.MonkeyPatch, code: str, limit_s: float, longest_s: float
) -> None:
    monkeypatch.setattr(probing, "LONGEST_S", longest_s)
    words = [sys.executable, "-c", f"import time\nwhile True: {code}"]
    with subprocess.Popen(words, start_new_session=True) as process:
        try:
            with pytest.raises(subprocess.TimeoutExpired):
                probing._status(process, limit_s)
        finally:
            process.kill()


def test_verdicts_are_kept_until_the_files_change(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    entry = put(site, "leaver", "import os; os._exit(3)")
    assert unsafe_plugins([entry]) == {entry: ("import", "ended the process with status 3")}
    monkeypatch.setattr(probing, "probe", lambda entry_point: pytest.fail("probed again"))
    assert unsafe_plugins([entry]) == {entry: ("import", "ended the process with status 3")}
    put(site, "leaver", "import os  # mended")
    monkeypatch.undo()
    monkeypatch.syspath_prepend(site)
    monkeypatch.setenv("XDG_CACHE_HOME", str(site / "cache"))
    assert unsafe_plugins([entry]) == {}


def test_no_verdict_is_kept_of_a_process_that_did_not_start(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    entry = put(site, "fine", "")
    monkeypatch.setattr(probing, "CODE", "raise SystemExit(1)")
    assert unsafe_plugins([entry]) == {}
    assert json.loads((site / "cache/gear/plugins.json").read_text()) == {}


@pytest.mark.parametrize("text", ["", "{", "[]", '{"a": 3}', '{"a": ["x"]}'])
def test_a_damaged_cache_is_made_anew(site: Path, text: str) -> None:
    entry = put(site, "fine", "")
    cache = site / "cache/gear/plugins.json"
    cache.parent.mkdir(parents=True)
    cache.write_text(text)
    assert unsafe_plugins([entry]) == {}
    assert json.loads(cache.read_text())[stamp(entry)] is None


def test_a_cache_that_cannot_be_written_is_done_without(site: Path) -> None:
    (site / "cache").write_text("")
    entry = put(site, "leaver", "import os; os._exit(3)")
    assert unsafe_plugins([entry]) == {entry: ("import", "ended the process with status 3")}


RAISES = {
    "exits": "raise SystemExit(3)",
    "generator": "raise GeneratorExit('gone')",
    "interrupt": "raise KeyboardInterrupt",
    "base": "class Odd(BaseException): pass\nraise Odd('odd')",
    "mute": "class Mute(Exception):\n    def __str__(self): raise SystemExit\nraise Mute",
    "endless": HOOK.format(body="yield from iter(int, 1)"),
    "hook": HOOK.format(body="raise GeneratorExit"),
    "escapes": "raise ValueError('\\x1b[31mred')",
}


def test_whatever_is_raised_is_reported_and_the_others_work(site: Path) -> None:
    entries = [put(site, f"raises_{name}", code) for name, code in RAISES.items()]
    entries.append(EntryPoint(name="\x1b[2Jname", value="no_such_module", group="gear"))
    found = discover(entries)
    broken = {one.owner.plugin.removeprefix("raises_"): (one.stage, one.problem) for one in found.broken}
    assert broken.pop(printable("\x1b[2Jname"))[0] == "import"
    assert broken == {
        "exits": ("import", "SystemExit: 3"),
        "generator": ("import", "GeneratorExit: gone"),
        "interrupt": ("import", "KeyboardInterrupt"),
        "base": ("import", "Odd: odd"),
        "mute": ("import", "Mute (whose text cannot be had: SystemExit)"),
        "endless": ("hook gear_defenses", "ValueError: returns more than 1000 specs"),
        "hook": ("hook gear_defenses", "GeneratorExit"),
        "escapes": ("import", r"ValueError: \x1b[31mred"),
    }
    assert all(one.owner.plugin.isprintable() for one in found.broken)
    assert found.get("task", "semseg").owner.package == "mujoco-gear"


def test_a_command_names_those_that_end_or_hang_a_process(tmp_path: Path) -> None:
    """A site folder as pip would leave it, with a plugin that leaves, one that works and a damaged distribution."""
    site = tmp_path / "site"
    for name, code, line in (
        ("leaver", "import os; os._exit(3)", "leaver = leaver"),
        ("worker", HOOK.format(body="return []"), "worker = worker"),
        ("damaged", "", "no equals sign"),
    ):
        info = site / f"{name}-1.0.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[gear]\n{line}\n")
        put(site, name, code)
    env = os.environ | {
        "PYTHONPATH": os.pathsep.join([str(site), *sys.path]),
        "XDG_CACHE_HOME": str(tmp_path / "cache"),
    }
    for _ in range(2):
        words = [sys.executable, "-m", "gear.cli.main", "plugins", "--json"]
        done = subprocess.run(words, env=env, capture_output=True, text=True, check=True)
        broken = {one["plugin"]: (one["stage"], one["problem"]) for one in json.loads(done.stdout)["broken"]}
        assert broken["leaver"] == ("import", "ended the process with status 3")
        assert broken["damaged"][0] == "entry_points.txt" and "worker" not in broken
