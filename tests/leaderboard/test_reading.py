"""Files of strangers: forged, damaged, enormous and odd ones are refused with one line."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gear.leaderboard import reading
from gear.leaderboard.reading import encoded, read_record, read_records
from gear.leaderboard.record import canonical
from gear.values.errors import DatasetError
from tests.leaderboard.conftest import record


def content() -> Any:
    return json.loads(encoded(record()))


def test_a_record_is_read_as_it_was_written(tmp_path: Path) -> None:
    (tmp_path / "one.json").write_bytes(encoded(record()))
    assert read_record(tmp_path / "one.json").record == record()


def forged(change: Callable[[Any], Any]) -> bytes:
    value = content()
    change(value)
    return canonical(value)


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        (b"", "is not JSON"),
        (b"[" * 100_000, "is not JSON"),
        (b"[]\n", "is no gear-record"),
        (encoded(record())[:-40], "is not JSON"),
        (encoded(record()) + b" ", "canonical"),
        (json.dumps(content()).encode(), "canonical"),
        (forged(lambda one: one.update(version=2)), "has version 2"),
        (forged(lambda one: one.update(extra=1)), "unknown key"),
        (forged(lambda one: one.pop("attack")), "missing"),
        (forged(lambda one: one.update(checked_by=["the board"])), "checked_by"),
        (forged(lambda one: one["results"][0].update(value="0.9")), "value"),
        (forged(lambda one: one["data"][0].update(scene="../../x")), "scene"),
        (forged(lambda one: one["patches"][0].update(sha256=["../../x"])), "sha256"),
        (forged(lambda one: one["environment"].update({"<b>": "x"})), "environment"),
        (forged(lambda one: one["entry"].update(authors="a\nb")), "authors"),
        (forged(lambda one: one["attack"].update(steps=10**12)), "steps"),
    ],
)
def test_faulty_records_are_refused_with_one_line(tmp_path: Path, data: bytes, problem: str) -> None:
    path = tmp_path / "one.json"
    path.write_bytes(data)
    with pytest.raises(DatasetError, match=problem) as caught:
        read_record(path)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 500


def test_enormous_files_and_devices_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reading, "MOST_BYTES", 1000)
    (tmp_path / "large.json").write_bytes(encoded(record()))
    os.mkfifo(tmp_path / "pipe.json")
    (tmp_path / "folder.json").mkdir()
    found = list(read_records(tmp_path))
    assert len(found) == 3 and all(isinstance(one, DatasetError) for one in found)


def test_faulty_records_do_not_hide_others(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_bytes(b"x")
    (tmp_path / "b.json").write_bytes(encoded(record()))
    (tmp_path / "notes.txt").write_bytes(b"x")
    bad, good = read_records(tmp_path)
    assert isinstance(bad, DatasetError) and not isinstance(good, DatasetError)
