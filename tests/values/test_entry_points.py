from __future__ import annotations

from pathlib import Path

import pytest

from gear.values.entry_points import installed_entry_points


def put(site: Path, folder: str, entry_points: str, metadata: str | None) -> None:
    info = site / folder
    info.mkdir(parents=True)
    (info / "entry_points.txt").write_text(entry_points)
    if metadata is not None:
        (info / "METADATA").write_text(metadata)


def test_a_malformed_line_costs_its_own_distribution_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(tmp_path, "aa_bad-1.0.dist-info", "[console_scripts]\nno equals sign\n", "Name: aa-bad\nVersion: 1.0\n")
    put(tmp_path, "bb_good-2.0.dist-info", "[probing]\nmine = some.module\n", "Name: bb-good\nVersion: 2.0\n")
    put(tmp_path, "cc_nameless-3.0.dist-info", "[probing]\nnameless\n", None)
    monkeypatch.syspath_prepend(tmp_path)
    found, damaged = installed_entry_points("probing")
    assert [(one.name, one.value) for one in found] == [("mine", "some.module")]
    assert [(one.name, one.version) for one in damaged] == [("aa-bad", "1.0"), ("cc_nameless", "3.0")]


def test_the_first_of_two_installations_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder, value in (("late", "old.module"), ("early", "new.module")):
        put(tmp_path / folder, "x-1.dist-info", f"[probing]\nmine = {value}\n", "Name: x\nVersion: 1\n")
        monkeypatch.syspath_prepend(tmp_path / folder)
    found, damaged = installed_entry_points("probing")
    assert [one.value for one in found] == ["new.module"] and not damaged
