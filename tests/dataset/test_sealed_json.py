from __future__ import annotations

import json
from pathlib import Path

import pytest

from gear.dataset.json_text import dump_json
from gear.dataset.sealed_json import LENGTH, DamagedError, is_whole, load_sealed, sealed_json

CONTENT = {"name": "straße", "numbers": [1, 2.5], "inner": {"sha256": "not a seal"}}


def test_a_sealed_file_reads_back_without_its_seal(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_bytes(sealed_json(CONTENT))
    assert load_sealed(tmp_path / "a.json") == CONTENT
    assert json.loads(sealed_json(CONTENT)).keys() == {*CONTENT, "sha256"}


def test_every_changed_bit_is_noticed(tmp_path: Path) -> None:
    path, whole = tmp_path / "a.json", sealed_json(CONTENT)
    for place in range(len(whole)):
        for bit in range(8):
            changed = bytearray(whole)
            changed[place] ^= 1 << bit
            assert not is_whole(bytes(changed)), (place, bit)
    for data in (*(whole[:length] for length in range(len(whole))), whole + b"\n", whole + b" "):
        path.write_bytes(data)
        with pytest.raises(DamagedError, match="gear verify DIR --repair"):
            load_sealed(path)


def test_files_without_a_seal_are_read(tmp_path: Path) -> None:
    """Earlier versions wrote none, and other programs change the layout."""
    path = tmp_path / "a.json"
    for data in (dump_json(CONTENT), dump_json({}), json.dumps(json.loads(sealed_json(CONTENT))).encode()):
        path.write_bytes(data)
        assert load_sealed(path) in (CONTENT, {})
    long = {"text": "x" * LENGTH}
    path.write_bytes(dump_json(long))
    assert load_sealed(path) == long
