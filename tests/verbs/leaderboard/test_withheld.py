"""Withheld scenes and their salted hash."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from gear.values.errors import GearError
from gear.verbs.leaderboard.withheld import Withheld, read_withheld

SALT = "ab" * 16


def put(path: Path, **changes: Any) -> Path:
    path.write_text(json.dumps({"salt": SALT, "seed": 7, "places": {"town10": ["truck"]}, **changes}))
    return path


def test_the_hash_depends_on_everything(tmp_path: Path) -> None:
    changes: list[dict[str, Any]] = [{}, {"seed": 8}, {"salt": "cd" * 16}, {"places": {}}]
    found = [read_withheld(put(tmp_path / "a.json", **one)) for one in changes]
    assert len({one.commitment for one in found}) == 4
    same = read_withheld(put(tmp_path / "a.json"), found[0].commitment)
    assert same == found[0] and same.places_setting == 'places={"town10": ["truck"]}'
    with pytest.raises(GearError, match="not the published"):
        read_withheld(put(tmp_path / "a.json"), found[1].commitment)


@pytest.mark.parametrize("changes", [{"salt": "short"}, {"seed": -1}, {"seed": "7"}, {"more": 1}, {"places": ["x"]}])
def test_odd_files_are_refused(tmp_path: Path, changes: dict[str, Any]) -> None:
    with pytest.raises(GearError, match="is no file of withheld scenes"):
        read_withheld(put(tmp_path / "a.json", **changes))


def test_a_seed_cannot_be_guessed_without_the_salt() -> None:
    one, other = (Withheld(salt=salt, seed=1, places={}) for salt in (SALT, "00" * 16))
    assert one.commitment != other.commitment
