"""Checks of a split whose plan names many more samples than there are, or whose manifest names other hashes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gear.dataset.checks import verification
from gear.dataset.checks.verification import Finding, check_split
from gear.dataset.plan import write_plan
from tests.dataset.splits import fill, plan


def test_a_plan_of_any_number_of_samples_costs_no_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fill(tmp_path, plan(samples=4), [0, 3], is_closed=False)
    write_plan(tmp_path, plan(samples=10**12))
    monkeypatch.setattr(verification, "MOST_MISSING", 3)
    calls: list[tuple[int, int]] = []
    check = check_split(tmp_path, "test", lambda done, total: calls.append((done, total)))
    assert check.broken_samples == {1, 2, 4} and calls[0] == (0, 2) and calls[-1] == (2, 2)
    samples = [one for one in check.findings if "/samples/" in one.path]
    assert [one.path[-11:] for one in samples] == ["000001.json", "000002.json", "000004.json", "000005.json"]
    last = Finding(path="gear/test/samples/000005.json", problem="missing", detail="and 999999999994 more samples")
    assert samples[-1] == last


def test_missing_samples_are_not_looked_for_one_by_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fill(tmp_path, plan(samples=4), [0, 3], is_closed=False)
    write_plan(tmp_path, plan(samples=10**12))
    looks: list[str] = []
    inside = verification.inside

    def counted(root: Path, relative: str) -> Path:
        looks.append(relative)
        return inside(root, relative)

    monkeypatch.setattr(verification, "inside", counted)
    assert len(check_split(tmp_path, "test").broken_samples) == verification.MOST_MISSING
    assert len(looks) < 20


def test_a_sidecar_of_any_number_costs_no_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(verification, "MOST_MISSING", 3)
    fill(tmp_path, plan(samples=2), is_closed=False)
    folder = tmp_path / "gear/test"
    (folder / "plan.json").unlink()
    (folder / "samples/000001.json").rename(folder / "samples/999999999999.json")
    check = check_split(tmp_path, "test")
    assert check.broken_samples == {1, 2, 3, 999999999999}


def test_a_manifest_with_other_hashes_than_the_sidecars_is_damaged(tmp_path: Path) -> None:
    fill(tmp_path, plan(samples=2))
    manifest = tmp_path / "gear/test/manifest.json"
    content = json.loads(manifest.read_text())
    assert not check_split(tmp_path, "test").findings
    name = next(iter(content["samples"][1]["files"]))
    content["samples"][1]["files"][name] = "0" * 64
    manifest.write_text(json.dumps(content))  # in another layout, so the seal is none
    (found,) = check_split(tmp_path, "test").findings
    assert (found.path, found.problem) == ("gear/test/manifest.json", "damaged")
    assert found.detail == "its hashes of sample 1 are not those of the sidecar"
