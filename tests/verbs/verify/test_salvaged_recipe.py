"""What a damaged plan and a damaged manifest still say together."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from gear.dataset.plan import read_plan
from gear.dataset.sealed_json import sealed_json
from gear.verbs.verify.salvaged_recipe import readable_entries, salvaged_recipe
from tests.verbs.conftest import Copy

CONTENT = {"seed": 7, "name": {"a": [1, 2]}, "samples": [{"x": 1}], "town": "tiny"}


def test_damage_to_one_entry_does_not_hide_the_others() -> None:
    data = sealed_json(CONTENT)
    assert CONTENT.items() <= readable_entries(data).items()
    for place in range(len(data)):
        damaged = data[:place] + bytes([data[place] ^ 0x10]) + data[place + 1 :]
        kept = sum(readable_entries(damaged).get(key) == value for key, value in CONTENT.items())
        assert kept >= 2, (place, damaged)
    assert readable_entries(b"") == {} and readable_entries(b"\xff{") == {}


@pytest.fixture
def root(tmp_path: Path, copy_small: Copy) -> Path:
    return copy_small("depth", tmp_path / "data")


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def test_the_files_complete_each_other(root: Path) -> None:
    """The plan lost its recipe and the hash of itself, the manifest its seed, its patch and its content key."""
    plan, manifest = (root / "gear/debug" / name for name in ("plan.json", "manifest.json"))
    whole = read_plan(root, "debug")
    assert whole is not None
    edit(plan, '"recipe": {', '"recipe": ]')
    data = bytearray(plan.read_bytes())
    data[-6] ^= 1
    plan.write_bytes(data)
    for key in ("seed", "patch", "content_key"):
        edit(manifest, f'\n "{key}":', f'\n "{key}"?')
    found = salvaged_recipe(root, "debug", 2)
    assert [one["recipe"] for one in found.candidates] == [whole.recipe]
    assert found.candidates[0]["seed"] == whole.content["seed"] and found.candidates[0]["patch"] == whole.patch
    assert found.content_key == "" and found.is_proven(whole), "63 of 64 digits of the plan's own hash are left"
    assert not found.is_proven(replace(whole, samples=whole.samples + 1))


def test_the_number_of_samples_that_most_files_say_comes_first(root: Path) -> None:
    plan = root / "gear/debug/plan.json"
    whole = read_plan(root, "debug")
    assert whole is not None
    edit(plan, f'\n "samples": {whole.samples}', '\n "samples": 9')
    found = salvaged_recipe(root, "debug", whole.samples)
    assert [one["samples"] for one in found.candidates] == [whole.samples, 9]
    assert found.is_proven(whole)
    plan.unlink()
    found = salvaged_recipe(root, "debug", whole.samples)
    assert found.seal == "" and found.is_proven(whole) and not found.is_proven(replace(whole, key_points="x"))


def test_values_of_other_types_are_not_tried(root: Path) -> None:
    for name in ("plan.json", "manifest.json"):
        content = json.loads((root / "gear/debug" / name).read_text())
        (root / "gear/debug" / name).write_bytes(sealed_json({**content, "patch": {"label": 3}}))
    assert salvaged_recipe(root, "debug", 2).candidates == ()
    for name in ("plan.json", "manifest.json"):
        (root / "gear/debug" / name).unlink()
    found = salvaged_recipe(root, "debug", 2)
    assert (found.candidates, found.content_key, found.seal) == ((), "", "")
