from __future__ import annotations

from pathlib import Path

import pytest

from gear.values import resources
from gear.values.resources import data_dir


def test_a_checkout_has_its_data_at_the_top() -> None:
    assert (data_dir("mjcf") / "towns").is_dir()
    assert (data_dir("configs") / "scenes").is_dir()


def test_an_installed_package_has_its_data_inside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    inside = tmp_path / "gear" / "data" / "mjcf"
    inside.mkdir(parents=True)
    (tmp_path / "mjcf").mkdir()
    monkeypatch.setattr(resources, "__file__", str(tmp_path / "gear" / "values" / "resources.py"))
    data_dir.cache_clear()
    try:
        assert data_dir("mjcf") == inside, "what is installed goes before what lies beside it"
        with pytest.raises(FileNotFoundError, match="install gear again"):
            data_dir("configs")
    finally:
        data_dir.cache_clear()
