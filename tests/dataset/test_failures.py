"""Notes on samples that could not be made."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.contracts.executors import Outcome
from gear.dataset.failures import clear_failures, failures_folder, note_failure, noted_failures
from gear.dataset.layout import failed_path
from gear.dataset.sealed_json import load_sealed
from gear.values.errors import DatasetError


def outcome(index: int) -> Outcome:
    return Outcome(index=index, error="ValueError: broken", trace="line 1\nline \udce4")


def test_notes_hold_error_traceback_and_tries(tmp_path: Path) -> None:
    assert noted_failures(tmp_path, "test") == set()
    note_failure(tmp_path, "test", outcome(3), tries=2)
    content = load_sealed(tmp_path / failed_path("test", 3))
    assert content == {
        "index": 3,
        "tries": 2,
        "error": "ValueError: broken",
        "traceback": ["line 1", r"line \udce4"],
    }
    assert noted_failures(tmp_path, "test") == {3}
    assert noted_failures(tmp_path, "val") == set()


def test_notes_of_samples_that_exist_are_removed(tmp_path: Path) -> None:
    for index in (1, 2):
        note_failure(tmp_path, "test", outcome(index), tries=1)
    clear_failures(tmp_path, "test", [1])
    assert noted_failures(tmp_path, "test") == {2}
    clear_failures(tmp_path, "test")
    assert not (tmp_path / failures_folder("test")).exists()


def test_a_link_is_refused(tmp_path: Path) -> None:
    (tmp_path / "victim").mkdir()
    folder = tmp_path / failures_folder("test")
    folder.parent.mkdir(parents=True)
    folder.symlink_to(tmp_path / "victim")
    with pytest.raises(DatasetError):
        noted_failures(tmp_path, "test")
