"""What a damaged JSON file of gear still tells."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.dataset.checks.salvage import MOST_RESTORED, listed_hashes, restored
from gear.dataset.sealed_json import sealed_json

CONTENT = {"seed": 7, "name": "board", "samples": [1, 2]}


def changed(data: bytes, place: int, change: int) -> bytes:
    return data[:place] + bytes([data[place] ^ change]) + data[place + 1 :]


@pytest.mark.parametrize("change", [0x01, 0x80, 0x5A])
def test_one_changed_byte_is_restored_wherever_it_is(change: int) -> None:
    data = sealed_json(CONTENT)
    assert all(restored(changed(data, place, change)) == data for place in range(len(data)))


def test_more_than_one_changed_byte_is_not_restored() -> None:
    data = sealed_json(CONTENT)
    assert restored(changed(changed(data, 3, 1), 9, 1)) is None
    assert restored(changed(changed(data, 3, 1), len(data) - 9, 1)) is None
    assert restored(data[:20]) is None and restored(b"") is None
    assert restored(changed(sealed_json({"text": "x" * MOST_RESTORED}), 3, 1)) is None


def test_hashes_are_read_from_files_that_are_no_json(tmp_path: Path) -> None:
    (tmp_path / "left").mkdir()
    for name in ("0.png", "7.txt"):
        (tmp_path / "left" / name).touch()
    digest, other, third = "a" * 64, "b" * 64, "c" * 64
    listing = {"sha256": digest, "left/0.png": digest, "left/1.png": third, "../x/y": digest, "/etc/passwd": digest}
    (tmp_path / "one.json").write_bytes(b"{" + sealed_json(listing))
    (tmp_path / "two.json").write_bytes(sealed_json({"lefv/0.png": digest, "left/0.png": other, "lost": other}))
    (tmp_path / "three.json").write_bytes(sealed_json({"leftX7.txt": other, "left/8.png": third}))
    found = listed_hashes(tmp_path, ["one.json", "two.json", "three.json"])
    assert found == {
        "left/0.png": {digest, other},
        "left/1.png": {third},
        "left/7.txt": {other},
        "left/8.png": {third},
    }


def test_similar_paths_are_searched_for_a_limited_number_of_listed_paths(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "images").mkdir()
    (tmp_path / "images/0.png").touch()
    (tmp_path / "one.json").write_text(f'{{"images/1.png": "{"a" * 64}"}}')
    assert listed_hashes(tmp_path, ["one.json"]).keys() == {"images/0.png"}
    monkeypatch.setattr("gear.dataset.checks.salvage.MOST_STRAYS", 0)
    assert listed_hashes(tmp_path, ["one.json"]).keys() == {"images/1.png"}
