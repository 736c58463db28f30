"""A shelf of arrays: equal values, nothing stale, and damage that only costs time."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from gear.values import array_shelf
from gear.values.array_shelf import NO_SHELF, ArrayShelf, code_digest

RECORD = np.dtype([("position_m", "<f4", 3), ("number", "<i8")])


def some_arrays() -> list[npt.NDArray[Any]]:
    records = np.zeros(3, RECORD)
    records["position_m"], records["number"] = np.arange(9).reshape(3, 3) / 7, (1, 2, 1 << 40)
    return [np.linspace(-1, 1, 1001).reshape(7, 143), records, np.zeros((0, 3)), np.array(True), np.eye(5)[:, ::2]]


class Counted:
    """Arrays, and how often they were computed."""

    def __init__(self, arrays: Callable[[], list[npt.NDArray[Any]]] = some_arrays) -> None:
        self.arrays, self.times = arrays, 0

    def __call__(self) -> list[npt.NDArray[Any]]:
        self.times += 1
        return self.arrays()


@pytest.fixture
def shelf(tmp_path: Path) -> ArrayShelf:
    return ArrayShelf(folder=tmp_path, owner="town")


def test_the_second_call_reads_equal_arrays(shelf: ArrayShelf, tmp_path: Path) -> None:
    compute = Counted()
    shelf.arrays("geometry", [b"code"], compute)
    kept = shelf.arrays("geometry", [b"code"], compute)
    assert compute.times == 1
    for one, other in zip(kept, some_arrays(), strict=True):
        assert one.dtype == other.dtype and one.shape == other.shape
        np.testing.assert_array_equal(one, other)
    kept[0][:] = 5  # each caller has arrays of its own
    np.testing.assert_array_equal(shelf.arrays("geometry", [b"code"], compute)[0], some_arrays()[0])
    assert [path.name for path in tmp_path.iterdir()] == ["geometry.arrays"]


@pytest.mark.parametrize("owner, inputs", [("town", [b"co", b"de"]), ("town", [b"Code"]), ("city", [b"code"])])
def test_other_inputs_replace_the_file(shelf: ArrayShelf, tmp_path: Path, owner: str, inputs: list[bytes]) -> None:
    compute = Counted()
    shelf.arrays("geometry", [b"code"], compute)
    other = ArrayShelf(folder=tmp_path, owner=owner)
    other.arrays("geometry", inputs, compute)
    assert compute.times == 2
    other.arrays("geometry", inputs, compute)
    assert compute.times == 2 and len(list(tmp_path.iterdir())) == 1


def test_another_processor_or_numpy_computes_again(shelf: ArrayShelf, monkeypatch: pytest.MonkeyPatch) -> None:
    compute = Counted()
    shelf.arrays("geometry", [], compute)
    monkeypatch.setattr(array_shelf, "_processor", lambda: b"another")
    shelf.arrays("geometry", [], compute)
    monkeypatch.setattr(np, "__version__", "0.0")
    shelf.arrays("geometry", [], compute)
    assert compute.times == 3


def test_damage_is_noticed_wherever_it_is(shelf: ArrayShelf, tmp_path: Path) -> None:
    compute = Counted(lambda: [np.arange(40.0), np.arange(6, dtype=np.int32)])
    shelf.arrays("geometry", [b"code"], compute)
    path = tmp_path / "geometry.arrays"
    content = path.read_bytes()
    for place in range(0, len(content), 3):
        path.write_bytes(content[:place] + bytes([content[place] ^ 16]) + content[place + 1 :])
        compute.times = 0
        kept = shelf.arrays("geometry", [b"code"], compute)
        assert compute.times == 1 and np.array_equal(kept[0], np.arange(40.0))
        assert path.read_bytes() == content  # made whole again
    for size in (0, 5, 40, 49, 60, len(content) - 1):
        path.write_bytes(content[:size])
        compute.times = 0
        shelf.arrays("geometry", [b"code"], compute)
        assert compute.times == 1 and path.read_bytes() == content


def test_a_file_with_python_objects_is_not_written_or_read(shelf: ArrayShelf, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="Object arrays"):
        shelf.arrays("geometry", [], lambda: [np.array([{}], object)])
    assert list(tmp_path.iterdir()) == []


def test_what_is_no_file_is_not_read(shelf: ArrayShelf, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "geometry.arrays")  # opening it would wait for ever
    compute = Counted()
    shelf.arrays("geometry", [], compute)
    shelf.arrays("geometry", [], compute)
    assert compute.times == 1 and (tmp_path / "geometry.arrays").is_file()


def test_without_a_folder_everything_is_computed(tmp_path: Path) -> None:
    compute = Counted()
    removed = ArrayShelf(folder=tmp_path / "removed")
    for shelf in (NO_SHELF, NO_SHELF, removed, removed):
        assert len(shelf.arrays("geometry", [], compute)) == len(some_arrays())
    assert compute.times == 4 and list(tmp_path.iterdir()) == []


def test_what_killed_processes_left_is_removed(shelf: ArrayShelf, tmp_path: Path) -> None:
    old, new, foreign = (tmp_path / name for name in (".making-1.arrays", ".making-2.arrays", "render.mjb"))
    for path in (old, new, foreign):
        path.touch()
    for path in (old, foreign):
        os.utime(path, (0, time.time() - 7200))
    shelf.arrays("geometry", [], some_arrays)
    assert {path.name for path in tmp_path.iterdir()} == {"geometry.arrays", new.name, foreign.name}


def test_the_digest_of_code_changes_with_each_file(tmp_path: Path) -> None:
    paths = [tmp_path / name for name in ("a.py", "b.glsl")]
    for path in paths:
        path.write_text("one")
    one = code_digest(*map(str, paths))
    paths[1].write_text("two")
    code_digest.cache_clear()
    assert code_digest(*map(str, paths)) != one
