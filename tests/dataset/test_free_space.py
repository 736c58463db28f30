"""A job that does not fit its disk is refused before it writes."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from gear.dataset.free_space import check_free_space, free_bytes, size_text
from gear.values.errors import GearError


def test_what_does_not_fit_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=1000))
    check_free_space(tmp_path, 1000, what="the files need", advice="delete some")
    with pytest.raises(GearError, match="the files need about 1 kB, and 1 kB are free there; delete some"):
        check_free_space(tmp_path, 1001, what="the files need", advice="delete some")


def test_a_folder_that_does_not_exist_is_on_the_disk_of_its_parent(tmp_path: Path) -> None:
    assert free_bytes(tmp_path / "new/folder") == pytest.approx(shutil.disk_usage(tmp_path).free, rel=0.1)


def test_sizes_in_words() -> None:
    assert [size_text(size) for size in (3, 999, 1000, 4.24e6, 105e9, 2e20)] == [
        "3 bytes", "999 bytes", "1 kB", "4.2 MB", "105 GB", "200000 PB",
    ]  # fmt: skip
