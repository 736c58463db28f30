"""Existing samples are checked, and counted, before a run adds the missing ones."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.dataset.checks.existing_samples import refuse_damaged
from gear.dataset.sealed_json import DamagedError
from tests.dataset.splits import fill, plan


def test_every_existing_sample_is_counted(tmp_path: Path) -> None:
    store = fill(tmp_path, plan(samples=5), [0, 2, 3], is_closed=False)
    seen: list[tuple[int, int]] = []
    refuse_damaged(store, on_progress=lambda *counts: seen.append(counts))
    assert seen == [(1, 3), (2, 3), (3, 3)] and store.missing() == [1, 4]


def test_a_sample_without_one_of_its_files_is_made_again(tmp_path: Path) -> None:
    store = fill(tmp_path, plan(samples=3))
    sorted((tmp_path / "leftImg8bit").rglob("*.png"))[1].unlink()
    refuse_damaged(store)
    assert store.missing() == [1]


def test_a_changed_file_is_refused_and_kept(tmp_path: Path) -> None:
    store = fill(tmp_path, plan(samples=3))
    changed = sorted((tmp_path / "leftImg8bit").rglob("*.png"))[1]
    changed.write_bytes(b"edited by its owner")
    with pytest.raises(DamagedError, match="is not as it was written; `gear verify DIR --repair`"):
        refuse_damaged(store)
    assert changed.read_bytes() == b"edited by its owner" and store.missing() == []
