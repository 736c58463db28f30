"""Finished evaluations of strangers: what is damaged is one line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gear.dataset.files import sha256
from gear.formats.png import encode_labels
from gear.plugins.stored_evaluations import open_evaluation, read_defended
from gear.values.errors import DatasetError

RESULTS: Any = {"format": "gear-evaluation", "version": 1, "model": {"name": "m"}, "differences": [], "rows": []}


def test_an_evaluation_without_datasets_is_refused(tmp_path: Path) -> None:
    (tmp_path / "results.json").write_text(json.dumps(RESULTS))
    with pytest.raises(DatasetError, match=r"results\.json: .*rows: names no dataset.*evaluate again"):
        open_evaluation(tmp_path)


def stored(folder: Path, data: bytes) -> dict[str, Any]:
    (folder / "000000_left.png").write_bytes(data)
    return {"defended": {"000000_left.png": sha256(data)}}


def large_picture() -> bytes:
    """A picture whose header announces 100,000 x 100,000 pixels."""
    data = bytearray(encode_labels(np.zeros((2, 2), np.uint8)))
    data[16:24] = (100_000).to_bytes(4, "big") * 2
    return bytes(data)


@pytest.mark.parametrize("data", [b"", b"no picture", encode_labels(np.ones((2, 2), np.uint8))[:40]])
def test_a_file_that_is_no_picture_is_one_line(tmp_path: Path, data: bytes) -> None:
    with pytest.raises(DatasetError, match=r"000000_left\.png: (is no|cannot be read as a) picture") as caught:
        read_defended(tmp_path, stored(tmp_path, data))
    assert "\n" not in str(caught.value)


def test_a_picture_of_absurd_size_is_not_decoded(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="is 100000 x 100000 px"):
        read_defended(tmp_path, stored(tmp_path, large_picture()))


@pytest.mark.parametrize("hashes", [1, [1], {"a": 1}])
def test_hashes_that_are_none_are_one_line(tmp_path: Path, hashes: Any) -> None:
    with pytest.raises(DatasetError, match="damaged result"):
        read_defended(tmp_path, {"defended": hashes})


def test_a_picture_is_read_by_camera(tmp_path: Path) -> None:
    found = read_defended(tmp_path, stored(tmp_path, encode_labels(np.full((2, 3), 7, np.uint8))))
    assert list(found) == ["left"] and found["left"].shape == (2, 3, 3) and (found["left"] == 7).all()
