"""What `gear defend` has cleaned is taken for done only as long as it is what the pictures of today come to."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from gear.cli.main import main
from gear.verbs.defend.run import DefendReport, defend
from tests.dataset.splits import tree
from tests.verbs.conftest import Copy


@pytest.fixture
def data(tmp_path: Path, copy_small: Copy) -> Path:
    copy_small("semseg", tmp_path / "data", patch="random")
    return tmp_path / "data"


def cleaned(data: Path, out: Path) -> DefendReport:
    return defend(data, defense="lgs", out=out)


def test_a_picture_that_changed_afterwards_is_refused(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "clean"
    cleaned(data, out)
    (picture, *_) = sorted(data.rglob("leftImg8bit/**/*.png"))
    before, kept = picture.read_bytes(), tree(out)
    cv2.imwrite(str(picture), np.full((160, 320, 3), 77, np.uint8))
    assert main(["defend", str(data), "--defense", "lgs", "--out", str(out)]) == 2
    assert "is damaged: its content does not match" in capsys.readouterr().err
    picture.write_bytes(before)
    again = cleaned(data, out)
    assert (again.made, again.outdated) == (0, 0) and tree(out) == kept


def test_what_was_damaged_is_made_again(data: Path, tmp_path: Path) -> None:
    out = tmp_path / "clean"
    cleaned(data, out)
    whole = tree(out)
    kept = [name for name in whole if name.endswith(".png")]
    assert len(kept) == 4, "two pictures and their masks"
    for name in kept:
        for data_now in (whole[name][:-9], None):
            (out / name).unlink() if data_now is None else (out / name).write_bytes(data_now)
            report = cleaned(data, out)
            assert (report.made, report.outdated) == (1, 1) and tree(out) == whole


def test_a_marker_that_says_something_else_is_none(data: Path, tmp_path: Path) -> None:
    out = tmp_path / "clean"
    cleaned(data, out)
    whole = tree(out)
    marker = out / "defense/debug/samples/000000.json"
    there = json.loads(marker.read_text())
    changes = ({"files": []}, {"source": None}, {"score": None}, {"score": "high"}, {"files": {"../x": "0"}})
    for text in ("[]", "{}", "{", '{"score": 0.5}', *(json.dumps(there | change) for change in changes)):
        marker.write_text(text)
        assert cleaned(data, out).made == 1
        assert tree(out) == whole
