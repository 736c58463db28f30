"""An output folder is new, empty or gear's own before it is written."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.dataset.own_output import check_own
from gear.values.errors import DatasetError


def check(root: Path) -> None:
    check_own(root, "board.json", lambda path: path.read_text() == "ours", "pages")


def test_missing_empty_and_hidden_are_free(tmp_path: Path) -> None:
    check(tmp_path / "missing")
    check(tmp_path)
    (tmp_path / ".git").mkdir()
    (tmp_path / "gear").mkdir()
    check(tmp_path)


def test_an_own_output_may_hold_further_files(tmp_path: Path) -> None:
    (tmp_path / "board.json").write_text("ours")
    (tmp_path / "CNAME").write_text("example.org")
    check(tmp_path)


@pytest.mark.parametrize(("name", "shown"), [("board.json", "board.json"), ("thesis.tex", "thesis.tex")])
def test_files_of_somebody_else_are_refused_by_name(tmp_path: Path, name: str, shown: str) -> None:
    (tmp_path / name).write_text("theirs")
    with pytest.raises(DatasetError, match=f"no pages of gear's, such as '{shown}'; use another --out"):
        check(tmp_path)
    assert (tmp_path / name).read_text() == "theirs"


def test_a_link_in_place_of_the_marker_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "elsewhere.json").write_text("ours")
    (tmp_path / "out/board.json").symlink_to(tmp_path / "elsewhere.json")
    with pytest.raises(DatasetError):
        check(tmp_path / "out")
