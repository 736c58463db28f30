"""Hashes and metadata of installed packages."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from gear.leaderboard.package_facts import code_sha256, package_metadata, printable, wheel_sha256


def test_a_changed_file_changes_the_hash(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "their_code"
    folder.mkdir()
    (folder / "__init__.py").write_text("x = 1\n")
    (folder / "table.bin").write_bytes(b"1")
    monkeypatch.syspath_prepend(str(tmp_path))
    hashes = []
    for data in (b"1", b"2"):
        (folder / "table.bin").write_bytes(data)
        code_sha256.cache_clear()
        hashes.append(code_sha256("their_code.sub.module"))
    assert hashes[0] != hashes[1] and "their_code" not in sys.modules, "the code is not run"
    assert code_sha256("made_at_run_time") == code_sha256("made_at_run_time.more")
    code_sha256.cache_clear()


def test_facts_of_packages() -> None:
    assert package_metadata("mujoco-gear")["licence"]
    assert package_metadata("no-such-package") == {"licence": "", "authors": "", "paper": ""}
    assert wheel_sha256("no-such-package") is None
    assert printable("a\n<b>\x07" + "x" * 400).startswith("a <b>x") and len(printable("x" * 400)) == 300
