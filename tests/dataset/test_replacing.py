"""Splits that are in the way: what replaces them, and what is said of those of another version of gear."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.dataset import store
from gear.dataset.plan import read_plan
from gear.dataset.store import remove_split
from gear.values.errors import ReplaceableError
from tests.dataset.test_store import fill, plan, tree


def test_replacing_a_split_reads_each_of_its_files_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The manifest of a hundred thousand samples is the longest of them."""
    fill(tmp_path, plan())
    read, load = list[Path](), store.load_json

    def counted(path: Path) -> object:
        read.append(path)
        return load(path)

    monkeypatch.setattr(store, "load_json", counted)
    remove_split(tmp_path, "test")
    assert sorted(path.name for path in read) == ["000000.json", "000001.json", "000002.json", "manifest.json"]
    assert not tree(tmp_path)


def test_a_plan_of_another_version_may_be_replaced(tmp_path: Path) -> None:
    """Whoever asks says how: a bench has no --force."""
    fill(tmp_path, plan())
    path = tmp_path / "gear/test/plan.json"
    path.write_text("{}")
    with pytest.raises(ReplaceableError) as caught:
        read_plan(tmp_path, "test")
    assert (caught.value.path, caught.value.problem.split(" (")[0]) == (
        str(tmp_path), "gear/test/plan.json: is not of this version of gear"
    )  # fmt: skip
    assert str(caught.value).endswith("; use another --out, or replace split 'test' with --force")
